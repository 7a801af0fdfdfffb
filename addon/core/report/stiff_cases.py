"""Laws that are stiff, or only steep: friction, a thin front, chaotic systems. Each knows how wrong a ray's end is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..models import MODELS, Model
from ..reference import angles, true_ends
from ..status import Status
from ..trace import RayEnds

RAYS = 256
RADIUS = 10.0  # model lengths, where rays leave the wind
FAR = 1e5  # model lengths: where no flow gets within its duration
WIND = {"turn": 1.0, "lift": 1.0}  # radians and model lengths a tau


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
