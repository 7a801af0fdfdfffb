"""Where rays begin to escape, by repeated division."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def edge(
    escapes: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, rungs: int = 32, rounds: int = 3
) -> np.ndarray:
    """low, high : (n,), where rays do not escape, and where they do
    escapes : (n, rungs) places in between -> bool, (n, rungs)
    Returns (n,), right to (high - low) / rungs ** rounds / 2.
    """
    for _ in range(rounds):
        width = (high - low) / rungs
        places = low[:, None] + width[:, None] * (np.arange(rungs) + 0.5)
        inside = np.sum(~escapes(places), axis=1)
        low, high = low + width * (inside - 0.5), low + width * (inside + 0.5)
    return 0.5 * (low + high)
