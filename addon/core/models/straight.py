"""f = 0: the undistorted picture, Figure 4 (a) of the paper."""

from __future__ import annotations

import numpy as np

from .base import Model


class Straight(Model):
    name = "straight"
    label = "Straight"
    description = "Ordinary straight light rays, for comparison"
    menu_order = 0
    curved = False

    def rhs(self, states: np.ndarray) -> np.ndarray:
        return np.concatenate([states[:, 3:], np.zeros_like(states[:, 3:])], axis=1)

    def default_step(self) -> float:
        return 1.0

    def flat_radius(self) -> float:
        return 0.0
