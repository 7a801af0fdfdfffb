"""The Rössler system: Section 5.1 of the paper; Rössler, An equation for continuous chaos, Phys. Lett. A 57 (1976).

    field = (−(x + z), x + α y, β + z (x − γ))

Its attractor is some 15 lengths wide. See lorenz.py on the strength of the force.
"""

from __future__ import annotations

import numpy as np

from .base import Model
from .dynamics import DURATION, PLANE_DISTANCE, STRENGTH, Dynamics
from .parameter import Parameter
from .reach import REACH


class Roessler(Dynamics, Model):
    name = "roessler"
    label = "Rössler"
    description = "The chaotic system of Rössler as the force on a ray, or as its way"
    menu_order = 41
    parameters = (
        Parameter("alpha", 0.375, "1 / τ", "α, how fast the spiral in x and y grows", -1e6, 1e6, 0.0, 1.0),
        Parameter("beta", 2.0, "model lengths / τ", "β, what drives z", -1e6, 1e6, 0.0, 10.0),
        Parameter("gamma", 4.0, "model lengths", "γ, the x beyond which z grows", -1e6, 1e6, 0.0, 20.0),
        STRENGTH,
        REACH,
        PLANE_DISTANCE,
        DURATION,
    )
    flow_step = 0.02

    def field(self, x: np.ndarray) -> np.ndarray:
        x, y, z = x.T
        return np.stack([-(x + z), x + self.alpha * y, self.beta + z * (x - self.gamma)], axis=1)

    def field_change(self, x: np.ndarray, along: np.ndarray) -> np.ndarray:
        (x, _, z), (a, b, c) = x.T, along.T
        return np.stack([-(a + c), a + self.alpha * b, c * (x - self.gamma) + z * a], axis=1)
