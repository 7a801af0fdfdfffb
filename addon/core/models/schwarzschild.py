"""A black hole at rest: Section 5.4 and Appendix A of the paper.

    f = −3 M h² x / r⁵,   h = |x × v|

These are exactly the orbits of the null geodesic equation in pseudo-Cartesian Schwarzschild coordinates with affine τ.
From the radial equation (dr/dτ)² = E² − L²/r² (1 − 2M/r) one has r'' = L²/r³ − 3ML²/r⁴, which is the centrifugal term
of flat space and a radial force −3ML²/r⁴; and h = L is conserved because the force is radial.
It is regular at r = 2M. A ray at r ≤ 2M is absorbed.
"""

from __future__ import annotations

import numpy as np

from .base import Model
from .borders import SWALLOWING, Borders
from .parameter import Parameter


class Schwarzschild(Model):
    name = "schwarzschild"
    label = "Schwarzschild"
    description = "Light around a black hole that does not rotate"
    menu_order = 10
    has_static_frame = True
    bends_within = 100.0  # E² changes by 2 M b² / r³ on the way in: by 4e-7 until there, for the critical b
    parameters = (
        Parameter(
            "mass", 1.0, "model lengths (G = c = 1)", "Mass; the horizon's radius is twice the mass", 0.0, 1e6, 0.0, 5.0
        ),
    )

    def rhs(self, states: np.ndarray) -> np.ndarray:
        x, v = states[:, :3], states[:, 3:]
        h_squared = np.sum(np.cross(x, v) ** 2, axis=1, keepdims=True)
        r = np.linalg.norm(x, axis=1, keepdims=True)
        return np.concatenate([v, -3.0 * self.mass * h_squared * x / r**5], axis=1)

    def absorbed(self, states: np.ndarray) -> np.ndarray:
        return self.distances(states) <= 2.0 * self.mass

    def force_of_position(self) -> bool:
        return True

    def capture_file(self) -> str:
        return "captures/schwarzschild"

    def far_files(self) -> tuple[str, ...]:
        return ("far/mass", "far/schwarzschild")

    def borders(self) -> Borders:
        return SWALLOWING

    def orbit_files(self) -> tuple[str, ...]:
        return ("models/schwarzschild_orbit",)

    def default_step(self) -> float:
        return 0.05 * self.mass if self.mass > 0 else 1.0

    def flat_radius(self) -> float:
        return 100.0 * self.mass

    def escape_radius(self, reach: float) -> float:
        """b may be as large as `reach`, and the places of loose steps are surer farther out. Of what passes by beyond
        1e4 M the far field has the whole turn.
        """
        return max(self.flat_radius(), min(10.0 * reach, 1e4 * self.mass))

    def observer_problem(self, observer: str, positions: np.ndarray) -> str | None:
        r = float(np.linalg.norm(positions, axis=-1).min())
        if r <= 2.0 * self.mass:
            return (
                f"The camera is at r = {r:g}, inside the horizon (r = {2 * self.mass:g} model lengths), "
                "where this picture has no meaning. Move the camera out or lower the mass or the scale."
            )
        return None
