"""A black hole that rotates: Kerr 1963, in Cartesian Kerr–Schild coordinates (Visser 2007, arXiv:0706.0622, Eq. 33).

    g^{μν} = η^{μν} − F l^μ l^ν,   l^μ = (−1, (rx + ay)/(r² + a²), (ry − ax)/(r² + a²), z/r),
    F = 2Mr³ / (r⁴ + a²z²),   r⁴ − (x² + y² + z² − a²) r² − a²z² = 0
    H = ½ g^{μν} p_μ p_ν = 0,   dx/dλ = ∂H/∂p,   dp/dλ = −∂H/∂x

The state is (x, p), p covariant. E = −p_t is the root of H = 0 of a ray into the future,

    (1 + F) E² + 2F (l·p) E + F (l·p)² − |p|² = 0   (the greater root),

so that every state is a state of light, and an E ≤ 0, which the ergosphere has, is no special case. E is conserved, for
the flow of H with this E put in is the flow of the Hamiltonian E(x, p) with another parameter. The first state is
scaled to |dx/dλ| = 1 at the camera.

**The sense of rotation.** A camera's ray runs against the light, into the past. These coordinates are regular at the
horizon for rays that enter it into the *future*; traced into the past a ray would have to leave a horizon that they do
not cover. t → −t takes the hole to one that rotates the other way and the ray to one into the future. So rays are
integrated as future ones with a = −spin · M: the hole that the user sees has its axis along +z for spin > 0, and the
chart is its outgoing Kerr–Schild chart. A ray that the camera on the equator sends past the side that comes towards it
is the way of a photon that orbits with the hole: this side of the shadow is the flattened one.
"""

from __future__ import annotations

import math

import numpy as np

from .base import Model
from .borders import SWALLOWING, Borders
from .parameter import Parameter


class Kerr(Model):
    name = "kerr"
    label = "Kerr"
    description = "Light around a black hole that rotates about the model's Z axis"
    menu_order = 11
    has_static_frame = True
    bends_within = 100.0
    observers = ("chart", "static", "moving", "falling")
    parameters = (
        Parameter("mass", 1.0, "model lengths (G = c = 1)", "Mass of the black hole", 0.0, 1e6, 0.0, 5.0),
        Parameter(
            "spin",
            0.9,
            "a/M",
            "Angular momentum per squared mass: 0 is Schwarzschild, 1 the fastest; negative turns clockwise",
            -1.0,
            1.0,
            -1.0,
            1.0,
        ),
    )

    @property
    def traced_a(self) -> float:
        """a of the hole turned round in time, model lengths."""
        return -self.spin * self.mass

    @property
    def horizon(self) -> float:
        """r₊, model lengths."""
        return self.mass * (1.0 + math.sqrt(max(1.0 - self.spin**2, 0.0)))

    # The metric

    def radius(self, x: np.ndarray) -> np.ndarray:
        """r of the Kerr–Schild coordinates; x : float64, (n, 3) -> (n,)."""
        a = self.traced_a
        q = np.sum(x * x, axis=1) - a * a
        return np.sqrt(0.5 * (q + np.sqrt(q * q + 4.0 * (a * x[:, 2]) ** 2)))

    def fields(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """x : float64, (n, 3) -> F, (n,); l_i, (n, 3); ∂F/∂x_k, (n, 3); ∂l_i/∂x_k, (n, 3, 3) with axis 2 for k."""
        a, r, z = self.traced_a, self.radius(x), x[:, 2]
        # The quartic differentiated: (4r³ − 2r(x·x − a²)) dr = 2r² x·dx + 2a²z dz
        numerator = 2.0 * r[:, None] ** 2 * x
        numerator[:, 2] += 2.0 * a * a * z
        dr = numerator / (4.0 * r**3 - 2.0 * r * (np.sum(x * x, axis=1) - a * a))[:, None]
        dz = np.broadcast_to([0.0, 0.0, 1.0], x.shape)
        bottom = r**4 + (a * z) ** 2
        f = 2.0 * self.mass * r**3 / bottom
        d_bottom = 4.0 * r[:, None] ** 3 * dr + 2.0 * a * a * z[:, None] * dz
        df = 2.0 * self.mass * (3.0 * (r**2 / bottom)[:, None] * dr - (r**3 / bottom**2)[:, None] * d_bottom)
        d = (r * r + a * a)[:, None]
        crossed = np.stack([x[:, 1], -x[:, 0], 0.0 * z], axis=1)
        flat = x * [1.0, 1.0, 0.0]
        across = (r[:, None] * flat + a * crossed) / d  # l_x, l_y
        l_i = across + (z / r)[:, None] * dz
        d_across = flat[:, :, None] * dr[:, None, :] - 2.0 * (r[:, None] * across)[:, :, None] * dr[:, None, :]
        d_across += r[:, None, None] * np.diag([1.0, 1.0, 0.0]) + a * np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
        dl = d_across / d[:, :, None]
        dl[:, 2, :] += dz / r[:, None] - (z / r**2)[:, None] * dr
        return f, l_i, df, dl

    def energies(self, states: np.ndarray) -> np.ndarray:
        """E = −p_t; states : float64, (n, 6) -> (n,)."""
        f, l_i, _, _ = self.fields(states[:, :3])
        p = states[:, 3:]
        return energies(f, np.sum(l_i * p, axis=1), p)

    # The equation

    def rhs(self, states: np.ndarray) -> np.ndarray:
        f, l_i, df, dl = self.fields(states[:, :3])
        p = states[:, 3:]
        along = np.sum(l_i * p, axis=1)
        contracted = -(energies(f, along, p) + along)  # −l^μ p_μ
        dx = p + (f * contracted)[:, None] * l_i
        dp = 0.5 * (contracted**2)[:, None] * df - (f * contracted)[:, None] * np.einsum("ni,nik->nk", p, dl)
        return np.concatenate([dx, dp], axis=1)

    def initial_states(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """p_i = g_{iμ} k^μ of the null vector k = (T, d), T into the future."""
        f, l_i, _, _ = self.fields(positions)
        along = np.sum(l_i * directions, axis=1)
        time = (f * along + np.sqrt((f * along) ** 2 + (1.0 - f) * (1.0 + f * along**2))) / (1.0 - f)
        return np.concatenate([positions, directions + (f * (time + along))[:, None] * l_i], axis=1)

    def absorbed(self, states: np.ndarray) -> np.ndarray:
        """A little outside the horizon, as in the shader."""
        return self.radius(states[:, :3]) <= (1.0 + 1e-5) * self.horizon

    def far_files(self) -> tuple[str, ...]:
        return ("far/mass", "far/kerr")

    def borders(self) -> Borders:
        return SWALLOWING

    def shader_files(self) -> tuple[str, ...]:
        return ("models/kerr", "models/kerr_horizon")

    def files_of_long_rays(self) -> dict[str, str]:
        return {"models/kerr_horizon": "models/kerr_capture"}

    def default_step(self) -> float:
        return 0.05 * self.mass if self.mass > 0 else 1.0

    def flat_radius(self) -> float:
        """The far field's first order leaves out some M²a/r³."""
        return 300.0 * self.mass

    def escape_radius(self, reach: float) -> float:
        """Of what passes by farther out the far field has the whole turn, but for 12 M²/b²."""
        return max(self.flat_radius(), min(1.1 * reach, 3e3 * self.mass))

    def observer_problem(self, observer: str, positions: np.ndarray) -> str | None:
        if self.mass == 0.0:
            return None
        x = np.asarray(positions, np.float64).reshape(-1, 3)
        radii = self.radius(x)
        r = float(radii.min())
        if r <= self.horizon:
            return (
                f"The camera is at r = {r:g}, inside the horizon (r = {self.horizon:g} model lengths), "
                "where this picture has no meaning. Move the camera out or lower the mass or the scale."
            )
        inside = self.fields(x)[0] >= 1.0
        if observer != "falling" and inside.any():
            r = float(radii[inside].min())
            return (
                f"The camera is at r = {r:g}, inside the ergosphere, where nothing stays at rest, so that an observer "
                f"'{observer}' cannot exist. Move the camera out, or choose the observer 'falling'."
            )
        return None


def energies(f: np.ndarray, along: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The greater root of H = 0. f, along = l·p : (n,);  p : (n, 3) -> (n,)."""
    return (-f * along + np.sqrt((1.0 + f) * np.sum(p * p, axis=1) - f * along**2)) / (1.0 + f)
