"""The work-precision diagram of a case: error across, time up, a curve for every method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

from ..settings import PIPELINES, STEP_CONTROLS
from .methods import LABELS, Method
from .plots import NEUTRAL, Curve, Diagram
from .recommend import GOALS

ERROR, TIME = "error_p99_px_outside_band", "ns_per_ray"
ABOVE = 10.0  # times the least error: where a curve has not turned yet
AGREE = 0.5  # orders that two halvings of a step may differ by; a halving that brings less is at the floor
CONTROL_LABELS = {"constant": "constant step", "doubling": "step doubling", "embedded": "embedded estimate"}
PIPELINE_LABELS = {"paper": "paper's pipeline", "fused": "fused pipeline"}


def diagram(title: str, rows: Sequence[Mapping]) -> Diagram:
    """rows : of one case, as work_precision.run_case() gives them."""
    curves = [
        Curve(
            method.label,
            [(row[ERROR], row[TIME]) for row in own],
            color=list(LABELS).index(method.integrator),
            dash=STEP_CONTROLS.index(method.step_control),
            hollow=method.pipeline == "paper",
        )
        for method, own in by_method(rows).items()
    ]
    front = sorted((row[ERROR], row[TIME]) for row in rows if row["front"])
    verticals = [(goal, f"{goal:g} pixel") for goal in GOALS]
    verticals += [(rows[0]["rounding_px"], "float32's floor")] if rows[0]["rounding_px"] > 0.0 else []
    return Diagram(
        title,
        "error that 99 of 100 rays stay below, pixels",
        "time, nanoseconds a ray",
        curves,
        [(x, y) for x, y in front if 0 < x < math.inf and 0 < y < math.inf],
        [(row[ERROR], row[TIME], "the paper's default") for row in rows if row["papers_default"]],
        verticals,
        _legend(rows),
    )


def by_method(rows: Sequence[Mapping]) -> dict[Method, list[Mapping]]:
    """Each method's rows from coarse to fine, without the paper's default."""
    methods: dict[Method, list[Mapping]] = {}
    for row in rows:
        if not row["papers_default"]:
            method = Method(row["pipeline"], row["integrator"], row["step_control"])
            methods.setdefault(method, []).append(row)
    return methods


def orders(rows: Sequence[Mapping]) -> dict[str, float]:
    """Integrator -> its order as measured: how often the median ray's error is halved where a constant step is halved.
    Of the two finest halvings above the method's floor that agree; none where steps are too coarse for any order.
    """
    found: dict[str, float] = {}
    for method, own in by_method(rows).items():
        if method.step_control != "constant":
            continue
        errors = [row["error_median_px"] for row in own if row["error_median_px"] > 0.0]
        halvings = [math.log2(a / b) for a, b in pairwise(errors)]
        floor = min(errors) if halvings and halvings[-1] < AGREE else 0.0
        above = [order for order, error in zip(halvings, errors[1:], strict=True) if error > ABOVE * floor]
        agreed = [finer for coarser, finer in pairwise(above) if abs(finer - coarser) < AGREE]
        if agreed:
            found[method.integrator] = agreed[-1]
    return found


def _legend(rows: Sequence[Mapping]) -> list[Curve]:
    """Colours, lines and markers apart: methods are many."""
    drawn = [row for row in rows if not row["papers_default"]]
    used = {key: {row[key] for row in drawn} for key in ("integrator", "step_control", "pipeline")}
    return [
        *(
            Curve(label, color=index)
            for index, (name, label) in enumerate(LABELS.items())
            if name in used["integrator"]
        ),
        *(
            Curve(CONTROL_LABELS[name], color=NEUTRAL, dash=index, dots=False)
            for index, name in enumerate(STEP_CONTROLS)
            if name in used["step_control"]
        ),
        *(
            Curve(PIPELINE_LABELS[name], color=NEUTRAL, hollow=name == "paper", lines=False)
            for name in PIPELINES
            if name in used["pipeline"]
        ),
    ]
