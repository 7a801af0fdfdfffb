"""Work and precision: what every method costs and how right it is, for every law of light."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..models import Model
from ..reference import Truth, angles, true_ends
from ..settings import PIPELINES, WITH_ERROR_ESTIMATE, Settings
from ..status import Status
from ..trace import render, trace_rays
from . import errors, rounding
from .cases import Case
from .methods import METHODS, SEGMENTS, Method, papers_default, too_many_steps

Progress = Callable[[float, str], None]
WARM_UP = 4  # pixels a side
SHARE_OF_FLOOR = 8  # every eighth ray
GOALS = (1.0, 0.1)  # pixels, of the 99th percentile
FAILED = 50.0  # percent of the rays, from which on a setting has failed and is not timed
MARGIN = 0.25  # of the goal: measured, the 99th percentile of other rays of the picture was 3.7 times as large
MISCLASSIFIED = 0.5  # percent of the rays that a recommended setting may end elsewhere


@dataclass(frozen=True)
class Effort:
    """side : side² rays against the reference;  picture : picture² pixels for the time;  repeats : after a warm-up;
    patience : seconds after which a setting is not repeated any more;  most_steps : that a ray may take
    all_methods : or with embedded control alone where the integrator estimates its error itself
    """

    side: int
    picture: int
    repeats: int
    patience: float
    most_steps: int
    all_methods: bool = True

    def methods(self, model: Model) -> list[Method]:
        """What is tried; for a law without curvature, one way of each pipeline: there is nothing to integrate."""
        if not model.curved:
            return [Method(pipeline, "euler", "constant") for pipeline in PIPELINES]
        return [
            method
            for method in METHODS
            if self.all_methods or method.step_control == "embedded" or method.integrator not in WITH_ERROR_ESTIMATE
        ]


QUICK = Effort(12, 24, 2, 0.02, 2000, all_methods=False)
FULL = Effort(24, 48, 5, 0.2, 10_000)


def run(cases: Iterable[Case], effort: Effort, progress: Progress) -> list[dict]:
    """A record for every case, method and setting. What progress() raises ends the work."""
    cases = list(cases)
    rows = []
    for index, case in enumerate(cases):

        def told(fraction: float, text: str, begin: int = index) -> None:
            progress((begin + fraction) / len(cases), text)

        rows += run_case(case, effort, told)
    return rows


def run_case(case: Case, effort: Effort, progress: Progress) -> list[dict]:
    positions, directions = case.rays(effort.side)
    truth, rounding_floor = rounding.reference_and_floor(
        case, positions, directions, lambda part: progress(0.2 * part, f"{case.title}: the reference")
    )
    methods = effort.methods(case.model)
    rows = []
    for index, method in enumerate(methods):
        for value, settings in method.settings(case.model, effort.most_steps):
            progress(0.2 + 0.8 * index / len(methods), f"{case.title}: {method.label}")
            rows.append(_record(case, method, value, settings, positions, directions, truth, effort))
            if not case.model.curved:
                break
    if case.model.curved:
        settings = papers_default(effort.most_steps)
        method = Method(settings.pipeline, settings.integrator, settings.step_control)
        row = _record(case, method, settings.tolerance, settings, positions, directions, truth, effort)
        rows.append(row | {"papers_default": True})
    mark_front(rows)
    floor = bounding_sphere_floor(case, positions, directions, truth) / case.pixel
    return [row | {"bounding_sphere_px": floor, "rounding_px": rounding_floor} for row in rows]


def bounding_sphere_floor(case: Case, positions: np.ndarray, directions: np.ndarray, truth: Truth) -> float:
    """What no constant step can improve: the 99th percentile of the angle, radians, by which true rays have still to
    turn where the shaders end them. Of a part of the rays.
    """
    some = np.arange(0, len(positions), SHARE_OF_FLOOR)
    radius = case.model.escape_radius(0.0)
    if not case.model.straight_far_out() or radius <= 0.0:
        return 0.0
    ended, far = true_ends(case.model, positions[some], directions[some], radius=radius), truth[some]
    both = (ended.status == Status.ESCAPED) & (far.status == Status.ESCAPED) & ended.converged & far.converged
    return float(np.percentile(angles(ended.direction[both], far.direction[both]), 99)) if both.any() else float("nan")


def _record(
    case: Case,
    method: Method,
    value: float,
    settings: Settings,
    positions: np.ndarray,
    directions: np.ndarray,
    truth: Truth,
    effort: Effort,
) -> dict:
    row = {
        "model": case.name,
        "case": case.title,
        "pipeline": method.pipeline,
        "integrator": method.integrator,
        "step_control": method.step_control,
        "value": value,
        "steps_per_segment": settings.steps_per_segment,
        "papers_default": False,
        "rays": len(positions),
        "unresolved": int((~truth.converged).sum()),
    }
    if too_many_steps(case.model, settings):
        return row | NO_PRECISION | NO_WORK | {"ns_per_ray_step": float("nan")}
    row |= precision(case, settings, positions, directions, truth)
    usable = row["failed_percent"] < FAILED
    row |= work(case, settings, effort) if usable else NO_WORK
    return row | {"ns_per_ray_step": row["ns_per_ray"] / max(row["steps_mean"], 1.0)}


def precision(
    case: Case, settings: Settings, positions: np.ndarray, directions: np.ndarray, truth: Truth
) -> dict[str, float]:
    """Errors, drift and steps of one setting."""
    ends = trace_rays(case.model, positions, directions, settings)
    found = errors.compare(case.model, ends, truth)
    everything = np.ones(len(positions), bool)
    away = ~errors.near_critical(case.model, positions, directions)
    row = errors.summary(found, case.pixel, everything)
    row |= errors.summary(found, case.pixel, away, "_outside_band")
    measured = np.isfinite(found.angle)
    drifting = ends.invariant_drift[ends.status == truth.status]
    estimated = settings.step_control != "constant" and measured.any()
    return row | {
        "failed_percent": 100.0 * float(found.failed.mean()),
        "estimate_exceeded_percent": 100.0 * float(found.exceeds[measured].mean()) if estimated else float("nan"),
        "drift_max": float(drifting.max()) if len(drifting) else float("nan"),
        "steps_mean": float(ends.steps.mean()),
        "steps_max": int(ends.steps.max()),
    }


def work(case: Case, settings: Settings, effort: Effort) -> dict[str, float]:
    """The time that tracing takes: the least of several, and the median. The warm-up is a picture of a few pixels:
    drivers compile at the first draw. What only long rays need may still be compiled after it: there are two runs at
    least.
    """
    settings = replace(settings, passes=("Direction",))
    compiled = render(case.small(WARM_UP, WARM_UP), settings).statistics.milliseconds["compile"]
    scene, begin, times = case.small(effort.picture, effort.picture), time.perf_counter(), []
    while len(times) < effort.repeats and (len(times) < 2 or time.perf_counter() - begin < effort.patience):
        times.append(render(scene, settings).statistics.milliseconds["trace"])
    rays = effort.picture**2
    return {
        "time_min_ms": min(times),
        "time_median_ms": statistics.median(times),
        "repeats": len(times),
        "compile_ms": compiled,
        "rays_per_second": 1e3 * rays / min(times),
        "ns_per_ray": 1e6 * min(times) / rays,
    }


NO_PRECISION = dict.fromkeys(
    (
        *(f"error_{figure}_px{band}" for band in ("", "_outside_band") for figure in errors.FIGURES),
        *(f"misclassified_percent{band}" for band in ("", "_outside_band")),
        "failed_percent",
        "estimate_exceeded_percent",
        "drift_max",
        "steps_mean",
        "steps_max",
    ),
    float("nan"),
)
NO_WORK = dict.fromkeys(
    ("time_min_ms", "time_median_ms", "repeats", "compile_ms", "rays_per_second", "ns_per_ray"), float("nan")
)


def mark_front(rows: list[dict]) -> None:
    """Set `front`: no other setting is both faster and more precise."""
    best = float("inf")
    for row in rows:
        row["front"] = False
    for row in sorted((row for row in rows if row["ns_per_ray"] > 0), key=lambda row: row["ns_per_ray"]):
        error = row["error_p99_px_outside_band"]
        row["front"] = bool(error < best and row["failed_percent"] == 0.0)
        if row["front"]:
            best = error


def recommendation(rows: list[dict], goal: float) -> dict | None:
    """A case's cheapest row with a 99th percentile safely below the goal, pixels, where hardly a ray ends elsewhere."""
    good = [
        row
        for row in rows
        if row["error_p99_px_outside_band"] < MARGIN * goal
        and row["misclassified_percent_outside_band"] <= MISCLASSIFIED
        and row["failed_percent"] == 0.0
    ]
    return min(good, key=lambda row: row["ns_per_ray"], default=None)


def settings_of(row: dict, effort: Effort) -> Settings:
    """The settings of a row."""
    tried = Method(row["pipeline"], row["integrator"], row["step_control"])
    value = {"step" if row["step_control"] == "constant" else "tolerance": row["value"]}
    return Settings(
        pipeline=tried.pipeline,
        integrator=tried.integrator,
        step_control=tried.step_control,
        steps_per_segment=row["steps_per_segment"],
        segments=SEGMENTS,
        max_steps=effort.most_steps,
        **value,
    )


def sentence(rows: list[dict], goal: float) -> str:
    """A recommendation in words."""
    row = recommendation(rows, goal)
    if row is None:
        return f"No setting tried has errors below {goal:g} pixel."
    method = Method(row["pipeline"], row["integrator"], row["step_control"])
    what = "step" if row["step_control"] == "constant" else "tolerance"
    unit = "model lengths" if row["step_control"] == "constant" else "radians"
    return (
        f"Cheapest below {goal:g} pixel: {method.label}, {what} {row['value']:.3g} {unit}: "
        f"{row['error_p99_px_outside_band']:.2g} pixel (99th percentile), {row['ns_per_ray']:.0f} ns a ray."
    )
