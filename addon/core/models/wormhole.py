"""A wormhole between two flat worlds: Ellis 1973; Morris and Thorne 1988.

    ds² = −dt² + dl² + (b² + l²) dΩ²

With the isotropic radius ρ, l = ρ − b²/(4ρ), space is conformally flat: dl² + (b² + l²) dΩ² = n² dx·dx with
n = 1 + b²/(4ρ²). Light then obeys Fermat's principle in the index n; with the length λ measured in space and the unit
tangent u, of which only the direction enters,

    dx/dλ = u / n        du/dλ = (∇n − (u·∇n) u) / n²

Near side: ρ > b/2. Far side: ρ < b/2, a mirrored copy of the near one under the inversion x → b² x / (4ρ²); ρ = 0 is
its infinity. A ray there shrinks towards the origin in this chart, but λ keeps its steps as long as on the near side.
"""

from __future__ import annotations

import numpy as np

from .base import Model
from .parameter import Parameter


class Wormhole(Model):
    name = "wormhole"
    label = "Wormhole"
    description = "Light through a throat to a far side that has a sky of its own"
    menu_order = 12
    has_far_side = True
    bends_within = 100.0
    parameters = (
        Parameter(
            "throat_radius",
            1.0,
            "model lengths",
            "Radius of the throat; in the scene it is the sphere of half this radius, and what stands inside that "
            "stands on the far side",
            1e-6,
            1e6,
            0.01,
            10.0,
        ),
    )

    def rhs(self, states: np.ndarray) -> np.ndarray:
        x, u = states[:, :3], states[:, 3:]
        rho = np.linalg.norm(x, axis=1, keepdims=True)
        n = 1.0 + self.throat_radius**2 / (4.0 * rho**2)
        gradient = -(self.throat_radius**2) * x / (2.0 * rho**4)
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        across = gradient - np.sum(u * gradient, axis=1, keepdims=True) * u
        return np.concatenate([u / n, across / n**2], axis=1)

    def ray_directions(self, states: np.ndarray) -> np.ndarray:
        """On the far side in the far chart."""
        x, u = states[:, :3], states[:, 3:]
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        outward = x / np.linalg.norm(x, axis=1, keepdims=True)
        reflected = u - 2.0 * np.sum(u * outward, axis=1, keepdims=True) * outward
        return np.where(self.far_side(states)[:, None], reflected, u)

    def far_side(self, states: np.ndarray) -> np.ndarray:
        """states : float64, (n, 6) -> bool, (n,)."""
        return np.linalg.norm(states[:, :3], axis=1) < 0.5 * self.throat_radius

    def distances(self, states: np.ndarray) -> np.ndarray:
        """ρ, or on the far side b²/(4ρ)."""
        rho = np.maximum(np.linalg.norm(states[:, :3], axis=1), 1e-300)
        return np.maximum(rho, 0.25 * self.throat_radius**2 / rho)

    def default_step(self) -> float:
        return 0.05 * self.throat_radius

    def far_files(self) -> tuple[str, ...]:
        return ("far/wormhole",)

    def flat_radius(self) -> float:
        """Of what passes by farther out, the far field has the whole turn, but for 1e-8."""
        return 100.0 * self.throat_radius

    def observer_problem(self, observer: str, positions: np.ndarray) -> str | None:
        rho = float(np.linalg.norm(positions, axis=-1).min())
        nearest = 1e-6 * self.throat_radius
        if rho <= nearest:
            return (
                f"The camera is at the model's centre (within {nearest:g} model lengths), which is infinitely far away "
                "on the far side. Move the camera out."
            )
        return None
