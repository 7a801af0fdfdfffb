"""How much empty space there is around every place among the objects. A ray passes by what is far from it without a
look at the tree, in strides as long as the space is empty: sphere tracing (Hart 1996), with cubes of cells for spheres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .clear_cells import clear_around

FEWEST, MOST = 32, 128  # cells along an axis
CELLS_PER_ROOT = 10.0  # and between: for every object's share of the axis, the cubic root of how many there are
FARTHEST = 254  # cells: what a byte holds
MARGIN = 0.02  # cells around every box
FINEST = 4e-5  # cells, as parts of the largest coordinate: float32 rounds places, and the corner, by 0.006 cells then


@dataclass(frozen=True, eq=False)
class EmptySpace:
    """clear : uint8, (nz, ny, nx), how many cells are empty from each on in all directions, itself included; 0 where
        an object's box reaches into it
    corner : float64, (3,), the low corner of the first cell, model lengths
    cell : float64, (3,), a cell's sides, model lengths
    """

    clear: np.ndarray
    corner: np.ndarray
    cell: np.ndarray

    def uniforms(self) -> dict[str, object]:
        """Of intersection/empty_space.glsl."""
        return {
            "u_empty_corner": tuple(self.corner),
            "u_empty_size": tuple(float(side) for side in self.clear.shape[::-1]),
            "u_cells_per_length": tuple(1.0 / self.cell),
        }


def build(boxes: np.ndarray) -> EmptySpace:
    """boxes : float32, (n, 2, 3), low and high corners of the objects, model space, finite, at least one.

    Cells are as flat as all objects together are: over a floor of many lengths, a ray at a small height is far away.
    """
    low, high = boxes[:, 0].min(axis=0).astype(np.float64), boxes[:, 1].max(axis=0).astype(np.float64)
    finest = max(FINEST * float(np.abs(boxes).max()), 1e-30)
    most = np.clip(CELLS_PER_ROOT * np.cbrt(len(boxes)), FEWEST, MOST)
    size = np.clip((high - low) / finest, 1, most).astype(np.int64)
    cell = np.maximum(high - low, finest) / (size - 2.0 * MARGIN)
    corner = low - MARGIN * cell
    first = ((boxes[:, 0] - corner) / cell - MARGIN).astype(np.int64)
    last = ((boxes[:, 1] - corner) / cell + MARGIN).astype(np.int64)
    clear = ~covered(first.clip(0, size - 1), last.clip(0, size - 1), size)
    return EmptySpace(clear_around(clear, FARTHEST), corner, cell)


def covered(first: np.ndarray, last: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Whether any box of cells, first … last, (n, 3) each, holds a cell: bool, (nz, ny, nx).

    A box adds 1 at its corner and takes it away again behind its end, along each axis; the running sums are how many
    boxes hold a cell.
    """
    shape = tuple(size[::-1] + 1)
    count = np.zeros(np.prod(shape), np.int32)
    ends = first, last + 1
    for corner in np.ndindex(2, 2, 2):
        x, y, z = (ends[end][:, axis] for axis, end in enumerate(corner))
        place = (z * shape[1] + y) * shape[2] + x
        np.add.at(count, place, np.int32((-1) ** sum(corner)))
    count = count.reshape(shape)
    for axis in range(3):
        np.cumsum(count, axis=axis, out=count)
    return count[:-1, :-1, :-1] > 0
