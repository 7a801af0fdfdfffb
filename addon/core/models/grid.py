"""n = 1 + strength · density, density given as voxels: the twin of shaders/media/grid.glsl.

The density is the cubic B-spline over the voxels. Trilinear interpolation has a gradient that jumps at every voxel; a
smooth gradient taken elsewhere would not be that of n, and |v| = n would drift. The B-spline is one field and has a
smooth gradient, and it stays within the range of the densities, so that n cannot become negative between voxels. It
blurs: where density varies smoothly, by h²/6 of its second derivative. Voxels outside the array are 0, so that n is 1
from one and a half cells beyond the box on.
"""

from __future__ import annotations

import itertools
from functools import cached_property

import numpy as np

from .base import ParameterError
from .media import Medium
from .still_blocks import still_blocks

LARGEST_SIDE = 2048 - 6  # what drivers allow for a volume, less the voxels beyond the array


class Grid(Medium):
    """The model's extras: grid, float, (nz, ny, nx), densities; grid_min, grid_max : (3,), the box's corners."""

    key = "grid"
    smooth = False  # cubic splines: the force has a kink at every voxel
    label = "Volume"
    description = "The density of a volume: n = 1 + Strength · density"
    parameters = ("strength",)

    def prepare(self) -> None:
        grid = self.model.grid
        if grid is None:
            raise ParameterError(
                "Model 'refraction': medium 'grid' has no densities. "
                "Choose a volume, or give an array 'grid' (nz, ny, nx)."
            )
        try:
            self.density = np.asarray(grid, np.float32)
        except (TypeError, ValueError):
            raise ParameterError("Model 'refraction': 'grid' holds no numbers. Give floats, (nz, ny, nx).") from None
        if self.density.ndim != 3 or not all(1 <= side <= LARGEST_SIDE for side in self.density.shape):
            raise ParameterError(
                f"Model 'refraction': 'grid' has the shape {self.density.shape}, but needs three sides in "
                f"[1, {LARGEST_SIDE}]: (nz, ny, nx). Reshape or coarsen it."
            )
        if not np.isfinite(self.density).all():
            raise ParameterError("Model 'refraction': 'grid' holds values that are not finite. Remove them.")
        self.low = self._corner("grid_min", -1.0)
        self.high = self._corner("grid_max", 1.0)
        if not (self.low < self.high).all():
            raise ParameterError(
                f"Model 'refraction': the box from {self.low.tolist()} to {self.high.tolist()} is empty. "
                "'grid_min' must be below 'grid_max' on every axis."
            )
        self.cell = (self.high - self.low) / self.density.shape[::-1]
        extremes = (0.0, float(self.density.min()), float(self.density.max()))
        self.refuse_dark_index(1.0 + min(self.model.strength * value for value in extremes), "strength")

    def _corner(self, name: str, default: float) -> np.ndarray:
        given = self.model.values[name]
        corner = np.full(3, default) if given is None else np.asarray(given, np.float64)
        if corner.shape != (3,) or not np.isfinite(corner).all():
            raise ParameterError(f"Model 'refraction': '{name}' is {given!r}, but must be three finite numbers.")
        return corner

    def field(self, x):
        """Sum over the 64 nearest voxels of density · B(x) B(y) B(z), and of its derivatives."""
        at = (x - self.low) / self.cell - 0.5  # voxel centres at whole numbers
        second = np.floor(np.clip(at, -1e6, 1e6)).astype(np.int64)
        size = np.array(self.density.shape[::-1])
        value, gradient = np.zeros(len(x)), np.zeros_like(x)
        for offset in itertools.product((-1, 0, 1, 2), repeat=3):
            voxel = second + offset
            known = ((voxel >= 0) & (voxel < size)).all(axis=1)
            i, j, k = np.where(known[:, None], voxel, 0).T
            density = np.where(known, self.density[k, j, i], 0.0)
            weight, slope = b_spline(at - voxel)
            value += density * weight.prod(axis=1)
            for axis in range(3):
                others = [other for other in range(3) if other != axis]
                gradient[:, axis] += density * slope[:, axis] * weight[:, others].prod(axis=1)
        n = 1.0 + self.model.strength * value
        return n[:, None] * self.model.strength * gradient / self.cell, n**2

    def clear_distances(self, x):
        """As far as the box is, and a voxel within."""
        low, high = self.low - 1.5 * self.cell, self.high + 1.5 * self.cell
        gap = np.linalg.norm(np.maximum(np.maximum(low - x, x - high), 0.0), axis=1)
        return np.maximum(gap, self.cell.min())

    def default_step(self) -> float:
        return 0.5 * float(self.cell.min())

    def flat_radius(self) -> float:
        corners = np.maximum(np.abs(self.low - 1.5 * self.cell), np.abs(self.high + 1.5 * self.cell))
        return float(np.linalg.norm(corners))

    def uniforms(self) -> dict[str, object]:
        return {"u_grid_min": tuple(self.low), "u_grid_cell": tuple(self.cell)}

    def textures(self) -> dict[str, np.ndarray]:
        return self._texels

    @cached_property
    def _texels(self) -> dict[str, np.ndarray]:
        """Densities in rows of four, so that the shader's 64 voxels are 16 texels, and none is beyond the texture."""
        padded = np.pad(self.density, 3)
        count = padded.shape[2] - 3
        rows = np.stack([padded[:, :, first : first + count] for first in range(4)], axis=-1)
        return {"u_grid": rows, "u_still_blocks": still_blocks(self.density)[..., None]}


def b_spline(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cubic B-spline at distance d, in cells: 2/3 − d² + |d|³/2 to |d| = 1, (2 − |d|)³/6 to 2; and its slope."""
    size = np.abs(d)
    far = np.clip(2.0 - size, 0.0, None)
    near = size <= 1.0
    weight = np.where(near, 2.0 / 3.0 - d**2 + 0.5 * size**3, far**3 / 6.0)
    return weight, np.where(near, 1.5 * d * size - 2.0 * d, -0.5 * np.sign(d) * far**2)
