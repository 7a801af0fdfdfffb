"""How far rays of the GPU are from the reference: physics.md, Section 4."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..models import Model
from ..reference import Truth, angles
from ..status import FAILURES, Status
from ..trace import RayEnds

BAND = 1e-3  # of |b / b_c - 1|: rays nearer to critical wind around the hole, and magnify every error
FIGURES = ("max", "rms", "median", "p99")
CRITICAL = 3.0 * np.sqrt(3.0)  # M
ROUNDING = 2.0 * 2.0**-24  # radians: a direction is rounded to float32 at the camera and at the end


@dataclass(frozen=True, eq=False)
class Errors:
    """For n rays.

    angle      (n,), radians between the final directions; NaN where there are not two of them
    elsewhere  bool, (n,): it ended in another way than the truth, or on another side
    known      bool, (n,): the reference has converged
    failed     bool, (n,): it ended in a failure
    factor     (n,): the angle as a multiple of the integrator's own estimate; both within float32's rounding: at most 1
    """

    angle: np.ndarray
    elsewhere: np.ndarray
    known: np.ndarray
    failed: np.ndarray
    factor: np.ndarray

    @property
    def exceeds(self) -> np.ndarray:
        """bool, (n,): whether the angle is larger than the integrator's own estimate."""
        with np.errstate(invalid="ignore"):
            return self.factor > 1.0


def compare(model: Model, ends: RayEnds, truth: Truth) -> Errors:
    elsewhere = ends.status != truth.status
    escaped = (ends.status == Status.ESCAPED) & (truth.status == Status.ESCAPED)
    if model.has_far_side:
        sides = [model.far_side(np.pad(which.position, ((0, 0), (0, 3)))) for which in (ends, truth)]
        elsewhere |= escaped & (sides[0] != sides[1])
    left = (ends.status == Status.LEFT_DOMAIN) & (truth.status == Status.LEFT_DOMAIN)
    both = (escaped | left) & ~elsewhere & truth.converged
    angle = np.full(len(elsewhere), np.nan)
    angle[both] = angles(ends.direction[both].astype(np.float64), truth.direction[both])
    factor = angle / (ends.error + ROUNDING)
    return Errors(angle, elsewhere, truth.converged, np.isin(ends.status, FAILURES), factor)


def near_critical(model: Model, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """bool, (n,): within BAND of the photon sphere's impact parameter, for a camera's chart directions; Schwarzschild
    only. b = h / E with E² = 1 - 2 M h² / r³.
    """
    if model.name != "schwarzschild" or model.mass <= 0.0:
        return np.zeros(len(positions), bool)
    h_squared = np.sum(np.cross(positions, directions) ** 2, axis=1)
    r = np.linalg.norm(positions, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        b = np.sqrt(h_squared / (1.0 - 2.0 * model.mass * h_squared / r**3))
    return np.abs(b / (CRITICAL * model.mass) - 1.0) < BAND


def summary(errors: Errors, pixel: float, chosen: np.ndarray, suffix: str = "") -> dict[str, float]:
    """The figures of the chosen rays, bool, (n,). Errors in pixels, of rays that escape as the truth does."""
    rows = chosen & errors.known
    found = errors.angle[rows & np.isfinite(errors.angle)] / pixel
    figures = dict.fromkeys(FIGURES, float("nan"))
    if len(found):
        figures = {
            "max": float(found.max()),
            "rms": float(np.sqrt(np.mean(found**2))),
            "median": float(np.median(found)),
            "p99": float(np.percentile(found, 99)),
        }
    misclassified = 100.0 * float(errors.elsewhere[rows].mean()) if rows.any() else float("nan")
    named = {f"error_{name}_px{suffix}": value for name, value in figures.items()}
    return named | {f"misclassified_percent{suffix}": misclassified}
