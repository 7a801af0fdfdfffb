"""What a case reports."""

from __future__ import annotations

import numpy as np

from ...settings import Settings
from ...status import Status
from ...trace import RayEnds

EPSILON = 2.0**-24  # float32: what a rounding is at most wrong by, relative
EXACT = Settings(  # the product's own method, with a tight tolerance
    pipeline="fused",
    integrator="automatic",
    step_control="embedded",
    tolerance=1e-6,
    segments=20_000,
    max_steps=20_000,
)


def record(
    model: str,
    value: float | str,
    expectation: str,
    measure: str,
    figure: float,
    bound: float | None = None,
    *,
    also: bool = True,
    holds: bool | None = None,
    statuses: str = "",
    **more: float,
) -> dict:
    """measure : what the figure is, with its unit;  also : what has to hold beside figure <= bound
    holds : for expectations without a bound; None with no bound is a figure that is reported only
    more : further figures of the same runs
    """
    if bound is not None:
        holds = bool(figure <= bound) and also
    return {
        "model": model,
        "value": value,
        "expectation": expectation,
        "measure": measure,
        "figure": float(figure),
        "bound": None if bound is None else float(bound),
        "holds": holds,
        "statuses": statuses,
        **more,
    }


def counted(status: np.ndarray) -> str:
    """status : values of Status -> "12 escaped, 3 absorbed"."""
    counts = np.bincount(np.asarray(status, int).ravel(), minlength=len(Status))
    return ", ".join(f"{counts[each]} {each.name.lower().replace('_', ' ')}" for each in Status if counts[each])


def ended_well(ends: RayEnds) -> bool:
    """Every ray has a name for its end, and every figure is a number."""
    return bool((ends.status > Status.RUNNING).all()) and all(np.isfinite(part).all() for part in vars(ends).values())


def worst(values: np.ndarray) -> float:
    """The largest; NaN of none."""
    return float(np.max(values)) if len(values) else float("nan")
