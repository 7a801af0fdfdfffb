"""Where a grid's spline is constant, in blocks of cells: there rays are straight, and steps may be long.

A cell is the cube between the centres of eight voxels; the cubic spline in it is made of the 64 voxels around it. It is
still where these are equal. The cells of n voxels are n + 3 along an axis, since beyond the array all voxels are 0.
"""

from __future__ import annotations

import numpy as np

from ..clear_cells import clear_around

BLOCK = 2  # cells along a block's side; shaders/media/grid.glsl has the same
FARTHEST = 64  # blocks: still ones are not counted farther


def still_cells(density: np.ndarray) -> np.ndarray:
    """density : (nz, ny, nx) -> bool, (nz + 3, ny + 3, nx + 3): whether the spline is constant in a cell."""
    least = most = np.pad(density, 3)
    for axis in range(3):
        least, most = _sliding(np.minimum, least, 4, axis), _sliding(np.maximum, most, 4, axis)
    return least == most


def still_blocks(density: np.ndarray) -> np.ndarray:
    """density : (nz, ny, nx) -> float32, (bz, by, bx): how many blocks are still from each on in all directions, itself
    included; 0 where it is not. What lies beyond the last cells is still.
    """
    cells = still_cells(density)
    cells = np.pad(cells, [(0, -side % BLOCK) for side in cells.shape], constant_values=True)
    bz, by, bx = (side // BLOCK for side in cells.shape)
    still = cells.reshape(bz, BLOCK, by, BLOCK, bx, BLOCK).all(axis=(1, 3, 5))
    return clear_around(still, FARTHEST).astype(np.float32)


def _sliding(join: np.ufunc, values: np.ndarray, width: int, axis: int) -> np.ndarray:
    """`join` of every `width` neighbours along the axis, which becomes shorter by width - 1."""
    values = np.moveaxis(values, axis, 0)
    count = len(values) - width + 1
    joined = values[:count]
    for first in range(1, width):
        joined = join(joined, values[first : first + count])
    return np.moveaxis(joined, 0, axis)
