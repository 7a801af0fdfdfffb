"""Where a force that would go on for ever ends, so that a ray has a direction to look up the sky with."""

from __future__ import annotations

import numpy as np

from .parameter import Parameter

RIM = 0.2  # part of the reach in which the force fades
REACH = Parameter(
    "reach",
    100.0,
    "model lengths",
    "Beyond this radius there is no force and rays are straight; the force fades over the last fifth",
    1e-3,
    1e6,
    1.0,
    1000.0,
)


def within_reach(r: np.ndarray, reach: float) -> np.ndarray:
    """1 inside, 0 outside, smooth between 0.8 and 1 of the reach. r : float64, model lengths -> the same shape."""
    s = np.clip((reach - r) / (RIM * reach), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)
