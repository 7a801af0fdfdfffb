"""Value noise with its gradient, in float64: the twin of shaders/media/noise.glsl.

Random values in [-1, 1] at whole-numbered points, blended by quintics. The hash is arithmetic on 32-bit unsigned
integers and takes 24 bits of the result, so that both give the very same values at the points.
"""

from __future__ import annotations

import itertools

import numpy as np

OCTAVES = 3
CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))  # of a cell, (8, 3)


def corner_values(cells: np.ndarray, seed: int) -> np.ndarray:
    """cells : int64, (n, 3) -> float64, (n,), in [-1, 1]."""
    c = cells.astype(np.uint32)  # wraps negative numbers as GLSL does
    with np.errstate(over="ignore"):
        h = c[:, 0] * np.uint32(73856093) ^ c[:, 1] * np.uint32(19349663) ^ c[:, 2] * np.uint32(83492791)
        h ^= np.uint32(seed * 2654435761 % 2**32)
        h ^= h >> np.uint32(16)
        h *= np.uint32(0x7FEB352D)
        h ^= h >> np.uint32(15)
        h *= np.uint32(0x846CA68B)
        h ^= h >> np.uint32(16)
    return (h >> np.uint32(8)).astype(np.float64) / 2**23 - 1.0


def value_noise(q: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (n, 3) and value (n,) of one octave at q, float64, (n, 3): the sum over a cell's eight corners of their
    values, each times a weight for every axis: w(t) or 1 - w(t), w(t) = 6 t^5 - 15 t^4 + 10 t^3.
    """
    corner = np.floor(q)
    t = q - corner
    w = 6.0 * t**5 - 15.0 * t**4 + 10.0 * t**3
    w_prime = 30.0 * t**4 - 60.0 * t**3 + 30.0 * t**2
    cells = (corner.astype(np.int64)[:, None] + CORNERS).reshape(-1, 3)
    values = corner_values(cells, seed).reshape(-1, 2, 2, 2)
    weights = np.stack([1.0 - w, w], axis=2)  # (n, axis, low or high)
    slopes = np.stack([-w_prime, w_prime], axis=2)
    gradient = np.empty_like(q)
    for axis in range(3):
        x, y, z = (slopes[:, other] if other == axis else weights[:, other] for other in range(3))
        gradient[:, axis] = np.einsum("nijk,ni,nj,nk->n", values, x, y, z)
    return gradient, np.einsum("nijk,ni,nj,nk->n", values, weights[:, 0], weights[:, 1], weights[:, 2])


def noise(q: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (n, 3) and value (n,), in [-1, 1], of OCTAVES octaves of half the amplitude and twice the frequency."""
    total = 2.0 - 0.5 ** (OCTAVES - 1)
    gradient, value = np.zeros_like(q), np.zeros(len(q))
    for octave in range(OCTAVES):
        slope, height = value_noise(2.0**octave * q, seed + octave)
        gradient += slope / total
        value += 0.5**octave / total * height
    return gradient, value
