"""Diagrams of the cases in which a value is swept."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from ..methods import LABELS
from ..plots import NEUTRAL, Curve, Diagram

Rows = Sequence[Mapping]


def diagrams(case: str, rows: Rows) -> list[Diagram]:
    """rows : a case's records.  Nothing where no value is swept."""
    return SWEPT[case](rows) if case in SWEPT else []


def _near_critical(rows: Rows) -> list[Diagram]:
    outside = [row for row in rows if row["value"] > 0 and row["bound"] is not None]
    error = [(row["value"], row["figure"]) for row in outside]
    bound = [(row["value"], row["bound"]) for row in outside]
    curves = [Curve("largest error", error), _line("100 roundings x condition", bound)]
    return [Diagram("Near-critical rays", "distance from critical, b / b_c − 1", "largest error, radians", curves)]


def _long_run(rows: Rows) -> list[Diagram]:
    curves = _by_integrator(rows, "value", "figure")
    return [Diagram("A closed orbit", "steps", "drift of energy and angular momentum, relative", curves)]


def _thin_front(rows: Rows) -> list[Diagram]:
    swept = [row for row in rows if isinstance(row["value"], float)]
    bound = [(row["value"], row["bound"]) for row in swept if row["bound"] is not None]
    front = [(thickness, thickness) for thickness, _ in bound]
    passed = [row for row in swept if not math.isnan(row["figure"])]  # where no ray gets through, there is no step
    across = "thickness of the front / R"
    return [
        Diagram(
            "A ball behind a thin front: the error",
            across,
            "largest angle off Snell's law, radians",
            [*_by_integrator(swept, "value", "figure"), _line("thickness + float32's floor", bound)],
        ),
        Diagram(
            "A ball behind a thin front: the step",
            across,
            "mean step of τ over the whole ray, R",
            [*_by_integrator(passed, "value", "mean_step"), _line("the thickness itself", front)],
        ),
    ]


def _damping(rows: Rows) -> list[Diagram]:
    curves = _by_integrator(rows, "kappa", "steps_max")
    return [Diagram("Damping: the way to rest", "damping κ, 1/τ", "most steps of a ray", curves)]


SWEPT: dict[str, Callable[[Rows], list[Diagram]]] = {
    "near-critical rays": _near_critical,
    "thin front": _thin_front,
    "stiff damping": _damping,
    "long run": _long_run,
}


def _by_integrator(rows: Rows, across: str, up: str) -> list[Curve]:
    """across, up : keys of the rows."""
    return [
        Curve(
            LABELS[integrator],
            [(row[across], row[up]) for row in rows if row["integrator"] == integrator],
            color=list(LABELS).index(integrator),
        )
        for integrator in dict.fromkeys(row["integrator"] for row in rows)
    ]


def _line(label: str, points: Sequence[tuple[float, float]]) -> Curve:
    """What was not measured but is compared with."""
    return Curve(label, points, color=NEUTRAL, dash=1, dots=False)
