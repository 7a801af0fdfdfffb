"""Where the L-stable Rosenbrock method wins, and by how much: stiff laws, against the explicit methods at equal error.

Stiff is a law in which something decays much faster than the ray bends: an explicit method has to follow the decay
with steps of about 3 / kappa, long after it is over. It is not enough that a law is steep, or that rays come to rest:
then accuracy keeps the steps short, and the method of highest order wins.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..models import MODELS, Model
from ..nystrom import NYSTROM_METHODS
from ..reference import angles, true_ends
from ..settings import WITH_ERROR_ESTIMATE, Settings
from ..status import Status
from ..trace import RayEnds, trace_rays
from .methods import LABELS
from .work_precision import Progress

GOAL = 1e-4  # radians, of the 99th percentile; at rest: of the way
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)  # radians; the loosest that meets the goal counts
RAYS = 256
MOST_STEPS = {True: 8000, False: 40_000}  # quick or not
REPEATS = {True: 3, False: 7}
RADIUS = 10.0  # model lengths, where rays leave the wind
FAR = 1e5  # model lengths: where no flow gets within its duration
WIND = {"turn": 1.0, "lift": 1.0}  # radians and model lengths a tau
IMPLICIT = "rosenbrock_32"
EXPLICIT = tuple(name for name in WITH_ERROR_ESTIMATE if name not in (IMPLICIT, "automatic"))
NAN = float("nan")


@dataclass(frozen=True, eq=False)
class StiffCase:
    """error : what the ends are wrong by, radians, (n,); infinite for rays that did not end
    limits : steps after which rays may be stopped, where they do not end by themselves; None: the most
    """

    title: str
    model: Model
    value: str
    positions: np.ndarray
    directions: np.ndarray
    error: Callable[[RayEnds], np.ndarray]
    radius: float | None = None
    limits: tuple[int, ...] | None = None


def run(quick: bool, progress: Progress = lambda fraction, text: None) -> list[dict]:
    """A record for every case and every method with an error estimate; times of methods that miss the goal are NaN.
    gain : the time of the best explicit method, as a multiple of its own. What progress() raises ends the work.
    """
    cases = all_cases(quick)
    records = []
    for index, case in enumerate(cases):
        progress(index / len(cases), f"{case.title}, {case.value}")
        suiting = [name for name in EXPLICIT if name not in NYSTROM_METHODS or case.model.force_of_position()]
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
        elif row["gain"] >= 1.0:
            verdict = f"is {row['gain']:.2g} times as fast as the best explicit method"
        else:
            verdict = f"is {1.0 / row['gain']:.2g} times slower than the best explicit method"
        said.append(f"{row['case']}, {row['value']}: {LABELS[IMPLICIT]} {verdict}.")
    return said


def all_cases(quick: bool) -> list[StiffCase]:
    kappas = (1e2, 1e4) if quick else (1.0, 1e2, 1e3, 1e4, 1e5)
    thicknesses = (1e-2,) if quick else (1e-1, 1e-2, 1e-3)
    return [
        *(whirl(kappa) for kappa in kappas),
        *(rest(kappa) for kappa in kappas[-1:]),
        *(front(thickness) for thickness in thicknesses),
        system("roessler", "flow", gamma=100.0, duration=5.0),
        system("roessler", "force", gamma=100.0, strength=0.1),
        system("lorenz", "flow", rho=1000.0, duration=0.05),
        system("lorenz", "force", rho=1000.0, strength=0.01),
    ]


# The cases


def whirl(kappa: float) -> StiffCase:
    """Friction in a wind that turns around the z axis and rises: dv/dtau = kappa (wind(x) - v). After some 1 / kappa a
    ray goes nearly with the wind.
    """
    forces = {"fx": "kappa * (-turn * y - vx)", "fy": "kappa * (turn * x - vy)", "fz": "kappa * (lift - vz)"}
    model = MODELS["custom"](**forces, parameters={"kappa": kappa, **WIND}, reach=1e6)
    positions, directions = _beam(2.0, 1.5)

    def error(ends: RayEnds) -> np.ndarray:
        truth = whirl_directions(kappa, positions, directions, ends.parameter.astype(float))
        return np.where(ends.status == Status.ESCAPED, angles(ends.direction.astype(float), truth), np.inf)

    return StiffCase("Friction in a wind", model, f"kappa = {kappa:g}", positions, directions, error, RADIUS)


def whirl_directions(kappa: float, positions: np.ndarray, directions: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """(n, 3), unit. With q = x + i y: q'' = kappa (i turn q - q'), a sum of two exponentials; z' goes from its start to
    the lift as exp(-kappa tau).
    """
    turn, lift = WIND["turn"], WIND["lift"]
    fast = -0.5 * (kappa + np.sqrt(kappa * kappa + 4j * kappa * turn))
    slow = -1j * kappa * turn / fast  # the product of both: their sum would cancel
    q, rate = (values[:, 0] + 1j * values[:, 1] for values in (positions, directions))
    slow_part = (rate - fast * q) / (slow - fast)
    rate = slow * slow_part * np.exp(slow * tau) + fast * (q - slow_part) * np.exp(fast * tau)
    rise = lift + (directions[:, 2] - lift) * np.exp(-kappa * tau)
    way = np.stack([rate.real, rate.imag, rise], axis=1)
    return way / np.linalg.norm(way, axis=1, keepdims=True)


def rest(kappa: float) -> StiffCase:
    """dv/dtau = -kappa v: a ray comes to rest after the way 1 / kappa, at the latest when it is stopped."""
    forces = {f"f{axis}": f"-kappa * v{axis}" for axis in "xyz"}
    model = MODELS["custom"](**forces, parameters={"kappa": kappa})
    positions, directions = np.zeros((RAYS, 3)), _directions()

    def error(ends: RayEnds) -> np.ndarray:
        return np.linalg.norm(ends.position * kappa - directions, axis=1)

    limits = (25, 50, 100, 200, 400, 800)
    return StiffCase("Friction at rest", model, f"kappa = {kappa:g}", positions, directions, error, limits=limits)


def front(thickness: float) -> StiffCase:
    """A ball with n = 1.5 behind a thin front, and rays that do not graze it: those would magnify every error."""
    model = MODELS["refraction"](medium="shell", strength=0.5, thickness=thickness)
    positions, directions = _beam(2.0, 0.6)
    return _against_reference("Ball behind a front", model, f"thickness = {thickness:g} R", positions, directions)


def system(name: str, mode: str, **values: float) -> StiffCase:
    first = next(iter(values.items()))
    more = {"plane_distance": 0.0} if mode == "flow" else {}
    model = MODELS[name](mode=mode, **values, **more)
    positions, directions = _beam(1.0, 2.0)
    radius = FAR if mode == "flow" else None
    return _against_reference(model.label, model, f"{mode}, {first[0]} = {first[1]:g}", positions, directions, radius)


def _against_reference(
    title: str,
    model: Model,
    value: str,
    positions: np.ndarray,
    directions: np.ndarray,
    radius: float | None = None,
) -> StiffCase:
    truth = true_ends(model, positions, directions, radius=radius)

    def error(ends: RayEnds) -> np.ndarray:
        apart = angles(ends.direction.astype(float), truth.direction)
        return np.where(ends.status == truth.status, apart, np.inf)[truth.converged]

    return StiffCase(title, model, value, positions, directions, error, radius)


def _beam(start: float, half: float) -> tuple[np.ndarray, np.ndarray]:
    """RAYS of them along +X from x = -start, over a square; float32's numbers, (n, 3)."""
    across = np.random.default_rng(1).uniform(-half, half, (RAYS, 2))
    positions = np.column_stack([np.full(RAYS, -start), across]).astype(np.float32).astype(float)
    return positions, np.tile((1.0, 0.0, 0.0), (RAYS, 1))


def _directions() -> np.ndarray:
    """RAYS of them all around, (n, 3), unit."""
    directions = np.random.default_rng(2).normal(size=(RAYS, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


# Measuring


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
