"""The Lorenz system: Section 5.1 of the paper; Lorenz, Deterministic nonperiodic flow, J. Atmos. Sci. 20 (1963).

    field = (σ (y − x), ρ x − y − x z, x y − β z)

Its attractor is some 50 lengths wide. As a force of strength 1 it throws rays about; where the scene is as large as the
attractor, a strength of 1e-4 bends them gently, as in Figure 4 (b).
"""

from __future__ import annotations

import numpy as np

from .base import Model
from .dynamics import DURATION, PLANE_DISTANCE, STRENGTH, Dynamics
from .parameter import Parameter
from .reach import REACH


class Lorenz(Dynamics, Model):
    name = "lorenz"
    label = "Lorenz"
    description = "The chaotic system of Lorenz as the force on a ray, or as its way"
    menu_order = 40
    parameters = (
        Parameter("sigma", 10.0, "1 / τ", "σ, the Prandtl number", -1e6, 1e6, 0.0, 30.0),
        Parameter("rho", 28.0, "1 / τ", "ρ, the Rayleigh number; chaos begins at 24.74", -1e6, 1e6, 0.0, 200.0),
        Parameter("beta", 8.0 / 3.0, "1 / τ", "β, the shape of the convection cells", -1e6, 1e6, 0.0, 10.0),
        STRENGTH,
        REACH,
        PLANE_DISTANCE,
        DURATION,
    )
    flow_step = 0.005

    def field(self, x: np.ndarray) -> np.ndarray:
        x, y, z = x.T
        return np.stack([self.sigma * (y - x), self.rho * x - y - x * z, x * y - self.beta * z], axis=1)

    def field_change(self, x: np.ndarray, along: np.ndarray) -> np.ndarray:
        (x, y, z), (a, b, c) = x.T, along.T
        return np.stack(
            [self.sigma * (b - a), self.rho * a - b - (a * z + x * c), a * y + x * b - self.beta * c], axis=1
        )
