"""The floor under every method: what rounding to float32 does to a ray before its first step.

In float64: a law that magnifies small differences magnifies these, whatever the method. Roundings of later steps come
on top, as a random walk of as many steps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..reference import Truth, angles, true_ends
from .cases import SEED, Case
from .errors import near_critical

TYPICAL = 0.425 * 2.0**-24  # of a number: what rounding to float32 changes it by, RMS over all mantissas
NEAR = 1e-3  # of a number: some ten thousand float32 numbers are as near


def reference_and_floor(
    case: Case, positions: np.ndarray, directions: np.ndarray, progress: Callable[[float], None]
) -> tuple[Truth, float]:
    """The truth of rays in the chart, (n, 3) each, and by how many pixels (99th percentile, without the near-critical
    band) their ends move when their first positions and directions move by a rounding. Both in one run.
    """
    n = len(positions)
    generator = np.random.default_rng(SEED)
    rounded = [_rounded(rays, generator) for rays in (positions, directions)]
    rounded[1] /= np.linalg.norm(rounded[1], axis=1, keepdims=True)
    rays = (np.concatenate(pair) for pair in zip((positions, directions), rounded, strict=True))
    ends = true_ends(case.model, *rays, progress=progress)
    truth, moved = ends[:n], ends[n:]
    same = truth.converged & moved.converged & (truth.status == moved.status)
    same &= ~near_critical(case.model, positions, directions)
    if not same.any():
        return truth, float("nan")
    apart = angles(moved.direction[same], truth.direction[same])
    return truth, float(np.percentile(apart, 99)) / case.pixel


def _rounded(vectors: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """(n, 3), each number moved by what rounding to float32 does to a random one near it."""
    near = vectors * (1.0 + NEAR * generator.uniform(-1.0, 1.0, vectors.shape))
    return vectors + (near.astype(np.float32) - near)
