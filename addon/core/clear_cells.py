"""How far the cells of a grid are clear around each: of what, the caller knows."""

from __future__ import annotations

import numpy as np


def clear_around(clear: np.ndarray, farthest: int) -> np.ndarray:
    """clear : bool, (nz, ny, nx) -> uint8, the same shape: how many cells are clear from each on in all directions, up
    to `farthest` (254 at most), itself included; 0 where it is not. What lies beyond the grid is clear.

    It is the number of steps, each to one of the 26 cells around, to the nearest cell that is not clear (Rosenfeld and
    Pfaltz 1968). Of these steps those along z can come first, then those along y: so every axis is gone through once
    forth and once back, with steps along the axes before it at the same time.
    """
    steps = np.where(clear, np.uint8(farthest), np.uint8(0))
    for axis, others in ((2, ()), (1, (1,)), (0, (0, 1))):
        planes = np.ascontiguousarray(np.moveaxis(steps, axis, 0))
        for order in (range(1, len(planes)), range(len(planes) - 2, -1, -1)):
            for i in order:
                before = planes[i - order.step]
                for other in others:
                    before = least_of_three(before, other)
                np.minimum(planes[i], before + np.uint8(1), out=planes[i])
        steps = np.moveaxis(planes, 0, axis)
    return np.ascontiguousarray(np.minimum(steps, np.uint8(farthest)))


def least_of_three(plane: np.ndarray, axis: int) -> np.ndarray:
    """The least of every element and its two neighbours along the axis."""
    least = plane.copy()
    rows, source = np.moveaxis(least, axis, 0), np.moveaxis(plane, axis, 0)
    np.minimum(rows[1:], source[:-1], out=rows[1:])
    np.minimum(rows[:-1], source[1:], out=rows[:-1])
    return least
