"""Where the L-stable Rosenbrock method wins, and by how much: stiff laws, against the explicit methods at equal error.

Stiff is a law in which something decays much faster than the ray bends: an explicit method has to follow the decay
with steps of about 3 / kappa, long after it is over. It is not enough that a law is steep, or that rays come to rest:
then accuracy keeps the steps short, and the method of highest order wins.
"""

from __future__ import annotations

import time

import numpy as np

from ..settings import WITH_ERROR_ESTIMATE, Settings
from ..status import Status
from ..trace import suits, trace_rays
from .methods import LABELS
from .recommend import TIE
from .stiff_cases import StiffCase, all_cases
from .work_precision import Progress

GOAL = 1e-4  # radians, of the 99th percentile; at rest: of the way
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)  # radians; the loosest that meets the goal counts
MOST_STEPS = {True: 8000, False: 40_000}  # quick or not
REPEATS = {True: 3, False: 7}
IMPLICIT = "rosenbrock_32"
EXPLICIT = tuple(name for name in WITH_ERROR_ESTIMATE if name not in (IMPLICIT, "automatic"))
NAN = float("nan")


def run(quick: bool, progress: Progress = lambda fraction, text: None) -> list[dict]:
    """A record for every case and every method with an error estimate; times of methods that miss the goal are NaN.
    gain : the time of the best explicit method, as a multiple of its own. What progress() raises ends the work.
    """
    cases = all_cases(quick)
    records = []
    for index, case in enumerate(cases):
        progress(index / len(cases), f"{case.title}, {case.value}")
        suiting = [name for name in EXPLICIT if suits(name, case.model)]
        rows = [_cheapest(case, integrator, quick) for integrator in (*suiting, IMPLICIT)]
        explicit = min(
            (row["time_min_ms"] for row in rows if row["integrator"] in EXPLICIT and row["reached"]), default=NAN
        )
        for row in rows:
            row["gain"] = explicit / row["time_min_ms"]
        records += rows
    return records


def sentences(records: list[dict]) -> list[str]:
    """What the Rosenbrock method does for each case."""
    said = []
    for row in (each for each in records if each["integrator"] == IMPLICIT):
        same = [each for each in records if (each["case"], each["value"]) == (row["case"], row["value"])]
        if not any(each["reached"] for each in same if each["integrator"] in EXPLICIT):
            verdict = "alone reaches the goal" if row["reached"] else "misses the goal, as the explicit methods do"
        elif not row["reached"]:
            verdict = "misses the goal, which an explicit method reaches"
        elif 1.0 / TIE < row["gain"] < TIE:
            verdict = "is about as fast as the best explicit method"
        elif row["gain"] >= TIE:
            verdict = f"is {row['gain']:.2g} times as fast as the best explicit method"
        else:
            verdict = f"takes {1.0 / row['gain']:.2g} times as long as the best explicit method"
        said.append(f"{row['case']}, {row['value']}: {LABELS[IMPLICIT]} {verdict}.")
    return said


def _cheapest(case: StiffCase, integrator: str, quick: bool) -> dict:
    """The fastest setting that meets the goal; where none does, the one with the least error."""
    tried = []
    for limit in case.limits or (MOST_STEPS[quick],):
        for tolerance in TOLERANCES:
            settings = Settings(
                pipeline="fused",
                integrator=integrator,
                step_control="embedded",
                tolerance=tolerance,
                segments=100_000,
                max_steps=limit,
                escape_radius=case.radius,
            )
            ends = trace_rays(case.model, case.positions, case.directions, settings)
            error = float(np.percentile(case.error(ends), 99, method="higher"))
            tried.append((error, settings, ends))
            if error <= GOAL or (ends.status == Status.STEP_LIMIT).all():
                break
        if tried[-1][0] <= GOAL:
            break
    error, settings, ends = tried[-1] if tried[-1][0] <= GOAL else min(tried, key=lambda each: each[0])
    reached = error <= GOAL
    return {
        "case": case.title,
        "model": case.model.name,
        "value": case.value,
        "integrator": integrator,
        "reached": reached,
        "tolerance": settings.tolerance,
        "error_p99_rad": error,
        "steps_mean": float(ends.steps.mean()),
        "steps_max": int(ends.steps.max()),
        "time_min_ms": _milliseconds(case, settings, REPEATS[quick]) if reached else NAN,
    }


def _milliseconds(case: StiffCase, settings: Settings, repeats: int) -> float:
    """Of the whole call, which has compiled by now: the least."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        trace_rays(case.model, case.positions, case.directions, settings)
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)
