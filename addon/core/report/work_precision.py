"""Work and precision: what every method costs and how right it is, for every law of light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..models import Model
from ..reference import Truth, angles, true_ends
from ..settings import PIPELINES, WITH_ERROR_ESTIMATE, Settings
from ..status import Status
from ..trace import suits, trace_rays
from . import errors, rounding
from .cases import Case
from .clock import Clock, run_in_turns
from .methods import METHODS, Method, papers_default, too_many_steps
from .recommend import CONTENDER, GOALS, near_the_cheapest

Progress = Callable[[float, str], None]
SHARE_OF_FLOOR = 8  # every eighth ray
FAILED = 50.0  # percent of the rays, from which on a setting has failed and is not timed


@dataclass(frozen=True)
class Effort:
    """side : side² rays against the reference;  picture : picture² pixels for the time;  repeats : after a warm-up;
    patience : seconds of a setting's runs after which it is not repeated any more, beyond the second run
    again : further runs of those that may be recommended;  most_steps : that a ray may take
    all_methods : or with embedded control alone where the integrator estimates its error itself
    """

    side: int
    picture: int
    repeats: int
    patience: float
    again: int
    most_steps: int
    all_methods: bool = True

    def methods(self, model: Model) -> list[Method]:
        """What is tried; for a law without curvature, one way of each pipeline: there is nothing to integrate."""
        if not model.curved:
            return [Method(pipeline, "euler", "constant") for pipeline in PIPELINES]
        return [
            method
            for method in METHODS
            if suits(method.integrator, model)
            and (self.all_methods or method.step_control == "embedded" or method.integrator not in WITH_ERROR_ESTIMATE)
        ]


QUICK = Effort(12, 24, 2, 0.02, 6, 2000, all_methods=False)
FULL = Effort(24, 32, 5, 0.2, 10, 10_000)


def run_case(case: Case, effort: Effort, progress: Progress) -> list[dict]:
    """A record for every method and setting. What progress() raises ends the work."""
    positions, directions = case.rays(effort.side)
    in_chart = case.in_chart(positions, directions)
    truth, rounding_floor = rounding.reference_and_floor(
        case, positions, in_chart, lambda part: progress(0.2 * part, f"{case.title}: the reference")
    )
    tried = _settings_to_try(case, effort)
    rows = []
    for index, (method, value, settings, is_default) in enumerate(tried):
        progress(0.2 + 0.4 * index / len(tried), f"{case.title}: {method.label}")
        row = _record(case, method, value, settings, positions, directions, truth)
        rows.append(row | {"papers_default": is_default})
    progress(0.6, f"{case.title}: time")
    settings = [settings for _, _, settings, _ in tried]
    _measure_times(case, rows, settings, effort, lambda part: progress(0.6 + 0.4 * part, f"{case.title}: time"))
    mark_front(rows)
    floor = bounding_sphere_floor(case, positions, in_chart, truth) / case.pixel
    return [row | {"bounding_sphere_px": floor, "rounding_px": rounding_floor} for row in rows]


def _settings_to_try(case: Case, effort: Effort) -> list[tuple[Method, float, Settings, bool]]:
    """(method, its step or tolerance, settings, whether it is the paper's default)."""
    tried = []
    for method in effort.methods(case.model):
        several = list(method.settings(case.model, effort.most_steps))
        tried += [(method, *each, False) for each in (several if case.model.curved else several[:1])]
    if case.model.curved:
        settings = papers_default(effort.most_steps)
        method = Method(settings.pipeline, settings.integrator, settings.step_control)
        tried.append((method, settings.tolerance, settings, True))
    return tried


def bounding_sphere_floor(case: Case, positions: np.ndarray, directions: np.ndarray, truth: Truth) -> float:
    """What no constant step can improve: the 99th percentile of the angle, radians, by which true rays have still to
    turn where the shaders end them. Of a part of the rays.  directions : of the chart
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
) -> dict:
    row = {
        "model": case.name,
        "case": case.title,
        "pipeline": method.pipeline,
        "integrator": method.integrator,
        "step_control": method.step_control,
        "value": value,
        "steps_per_segment": settings.steps_per_segment,
        "rays": len(positions),
        "unresolved": int((~truth.converged).sum()),
    }
    if too_many_steps(case.model, settings):
        return row | NO_PRECISION | NO_WORK
    return row | precision(case, settings, positions, directions, truth) | NO_WORK


def precision(
    case: Case, settings: Settings, positions: np.ndarray, directions: np.ndarray, truth: Truth
) -> dict[str, float]:
    """Errors, drift and steps of one setting.  directions : that the case's observer sees"""
    ends = trace_rays(case.model, positions, directions, case.seen(settings), scene=case.scene)
    found = errors.compare(case.model, ends, truth)
    everything = np.ones(len(positions), bool)
    away = ~errors.near_critical(case.model, positions, case.in_chart(positions, directions))
    row = errors.summary(found, case.pixel, everything)
    row |= errors.summary(found, case.pixel, away, "_outside_band")
    measured = np.isfinite(found.angle)
    drifting = ends.invariant_drift[ends.status == truth.status]
    estimated = settings.step_control != "constant" and measured.any()
    return row | {
        "failed_percent": 100.0 * float(found.failed.mean()),
        "estimate_exceeded_percent": 100.0 * float(found.exceeds[measured].mean()) if estimated else float("nan"),
        "estimate_factor_p99": float(np.percentile(found.factor[measured], 99)) if estimated else float("nan"),
        "estimate_over_median": _over(found.factor[measured]) if estimated else float("nan"),
        "drift_max": float(drifting.max()) if len(drifting) else float("nan"),
        "steps_mean": float(ends.steps.mean()),
        "steps_max": int(ends.steps.max()),
        "rejected_mean": float(ends.rejected.mean()),
    }


def _measure_times(
    case: Case, rows: list[dict], settings: list[Settings], effort: Effort, progress: Callable[[float], None]
) -> None:
    """Write the times into the rows of those settings that have not failed. What may be recommended is timed again."""
    usable = [index for index, row in enumerate(rows) if row["failed_percent"] < FAILED]  # no NaN
    clocks = {index: Clock(case, settings[index], effort.picture) for index in usable}

    def write_down() -> None:
        for index, clock in clocks.items():
            steps = max(rows[index]["steps_mean"], 1.0)
            rows[index] |= (figures := clock.figures()) | {"ns_per_ray_step": figures["ns_per_ray"] / steps}

    run_in_turns(list(clocks.values()), effort.repeats, effort.patience, lambda part: progress(0.8 * part))
    write_down()
    contenders = {id(row) for goal in GOALS for row in near_the_cheapest(rows, goal, CONTENDER)}
    again = [clock for index, clock in clocks.items() if id(rows[index]) in contenders]
    for turn in range(effort.again):
        progress(0.8 + 0.2 * turn / effort.again)
        for clock in again:
            clock.run()
    write_down()


def _over(factor: np.ndarray) -> float:
    """How many times the truth an estimate is, in the median. factor : (n,), the truth as multiples of it"""
    return float(1.0 / max(np.median(factor), 1e-12))


NO_PRECISION = dict.fromkeys(
    (
        *(f"error_{figure}_px{band}" for band in ("", "_outside_band") for figure in errors.FIGURES),
        *(f"misclassified_percent{band}" for band in ("", "_outside_band")),
        "failed_percent",
        "estimate_exceeded_percent",
        "estimate_factor_p99",
        "estimate_over_median",
        "drift_max",
        "steps_mean",
        "steps_max",
        "rejected_mean",
    ),
    float("nan"),
)
NO_WORK = dict.fromkeys(
    ("time_min_ms", "time_median_ms", "repeats", "compile_ms", "rays_per_second", "ns_per_ray", "ns_per_ray_step"),
    float("nan"),
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
