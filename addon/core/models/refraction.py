"""Air, glass, blasts: light in a medium whose index of refraction varies. Section 5.3 of the paper.

    f = ½ ∇(n²),   |v| = n along the ray

Fermat's principle, δ∫ n ds = 0, gives d/ds (n dx/ds) = ∇n. With dτ = ds / n it is x'' = n ∇n = ½ ∇(n²), and
v = n dx/ds.

`stepping` "continuous" integrates this equation; "snell" is the paper's: a straight ray, which Snell's law turns
whenever n has changed by more than `threshold`, with ∇n as the surface's normal (shaders/integrators/snell.glsl).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .base import Model
from .borders import Borders
from .grid import Grid
from .media import Explosion, Fisheye, Isotropic, Linear, Luneburg, Medium, Mirage, Shell
from .parameter import Option, Parameter, Text
from .typed_index import Typed

MEDIA: dict[str, type[Medium]] = {
    medium.key: medium for medium in (Explosion, Mirage, Luneburg, Fisheye, Linear, Isotropic, Shell, Grid, Typed)
}
LENGTHS = "model lengths"
PURE = "no unit"
OF_RADIUS = "parts of the radius"


class Refraction(Model):
    """extras, for the medium "grid": grid, float, (nz, ny, nx), densities at the centres of the voxels of the box from
    grid_min to grid_max, (3,) each, model lengths; by default from -1 to 1.
    """

    name = "refraction"
    label = "Refraction"
    description = "Light in a medium with a varying index of refraction n: explosion, mirage, lenses, volumes, formulas"
    menu_order = 40
    options = (
        Option(
            "medium",
            "Medium",
            "The index of refraction n as a function of the position",
            tuple((medium.key, medium.label, medium.description) for medium in MEDIA.values()),
            "explosion",
        ),
        Option(
            "stepping",
            "Stepping",
            "How the ray is bent",
            (
                ("continuous", "Continuous", "Integrate the ray equation with the chosen integrator"),
                (
                    "snell",
                    "Snell",
                    "As in the paper: go straight, and refract by Snell's law when n has changed enough",
                ),
            ),
            "continuous",
        ),
    )
    parameters = (
        Parameter("radius", 1.0, LENGTHS, "Radius of the ball, the lens, or the blast at time 1", 1e-6, 1e6, 0.1, 20.0),
        Parameter(
            "strength",
            0.3,
            PURE,
            "Change of the index: Δn of the front, or n − 1 for density 1",
            -100.0,
            100.0,
            -0.5,
            1.0,
        ),
        Parameter(
            "thickness", 0.1, OF_RADIUS, "Width of the front over which the index changes", 1e-6, 0.5, 0.001, 0.5
        ),
        Parameter(
            "time",
            1.0,
            PURE,
            "Age of the blast (its radius grows with the power 2/5), or t of the formula",
            0.0,
            1e6,
            0.0,
            10.0,
        ),
        Parameter("roughness", 0.15, OF_RADIUS, "How far noise displaces the front of the blast", 0.0, 0.5, 0.0, 0.5),
        Parameter("frequency", 3.0, "waves per radius", "How fine the noise on the front is", 0.0, 1000.0, 0.0, 20.0),
        Parameter(
            "rarefaction",
            0.3,
            PURE,
            "How much thinner the air amid the blast is, in parts of the strength",
            0.0,
            10.0,
            0.0,
            1.0,
        ),
        Parameter("seed", 0.0, PURE, "Which noise; whole numbers", 0.0, 1e6, 0.0, 100.0),
        Parameter(
            "mirage_a",
            1.0,
            PURE,
            "A of n² = A + B e^(−c z): the square of the index high above the ground",
            1e-6,
            1e6,
            0.5,
            2.0,
        ),
        Parameter(
            "mirage_b",
            -1e-3,
            PURE,
            "B of n² = A + B e^(−c z): below 0 over hot ground, above 0 over cold ground",
            -1e6,
            1e6,
            -0.01,
            0.01,
        ),
        Parameter(
            "mirage_c",
            2.0,
            "per model length",
            "c of n² = A + B e^(−c z): the inverse height of the layer above the ground at z = 0",
            1e-6,
            1e6,
            0.1,
            10.0,
        ),
        Parameter(
            "index",
            1.0,
            PURE,
            "n0: the index at the centre of the fisheye, or at z = 0 of the linear medium",
            1e-3,
            1e3,
            1.0,
            3.0,
        ),
        Parameter("gradient", 0.02, "per model length", "g of n² = n0² + g z", -1e6, 1e6, -1.0, 1.0),
        Parameter(
            "mass",
            1.0,
            "model lengths (G = c = 1)",
            "Mass of the black hole that the medium imitates",
            0.0,
            1e6,
            0.0,
            5.0,
        ),
        Parameter("grain", 0.1, LENGTHS, "The smallest detail of the formula: no step is longer", 1e-6, 1e6, 0.01, 1.0),
        Parameter(
            "threshold", 1e-3, PURE, "Relative change of the index at which Snell stepping refracts", 0.0, 1.0, 0.0, 0.1
        ),
    )
    texts = (
        Text(
            "formula",
            "Index n",
            "n as a formula in x, y, z, the distance r from the centre (model lengths) and the time t",
            "1 + 0.3 * exp(-r^2)",
        ),
    )
    extras = ("grid", "grid_min", "grid_max")

    @classmethod
    def unused(cls, chosen: Mapping[str, str]) -> frozenset[str]:
        used = set(MEDIA[chosen["medium"]].parameters)
        used |= {"threshold"} if chosen["stepping"] == "snell" else set()
        used |= {"formula"} if chosen["medium"] == Typed.key else set()
        return frozenset(entry.name for entry in (*cls.parameters, *cls.texts)) - used

    def prepare(self) -> None:
        self.law = MEDIA[self.medium](self)

    def rhs(self, states: np.ndarray) -> np.ndarray:
        force, n_squared = self.law.field(states[:, :3])
        if not self.law.thins_out:
            return np.concatenate([states[:, 3:], force], axis=1)
        stretched = np.linalg.norm(states[:, 3:], axis=1, keepdims=True) / np.sqrt(n_squared)[:, None]
        return np.concatenate([states[:, 3:] / stretched, stretched * force], axis=1)

    def initial_states(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        n = np.sqrt(np.maximum(self.law.field(positions)[1], 0.0))
        return np.concatenate([positions, n[:, None] * directions], axis=1)

    def absorbed(self, states: np.ndarray) -> np.ndarray:
        return self.law.dark(states[:, :3])

    def straight_far_out(self) -> bool:
        return self.law.straight_far_out

    def clear_distances(self, states: np.ndarray) -> np.ndarray:
        return self.law.clear_distances(states[:, :3])

    def force_of_position(self) -> bool:
        return not self.law.thins_out

    def default_step(self) -> float:
        return self.law.default_step()

    def flat_radius(self) -> float:
        return self.law.flat_radius()

    def escape_radius(self, reach: float) -> float:
        return self.law.escape_radius(reach)

    def observer_problem(self, observer: str, positions: np.ndarray) -> str | None:
        x = np.asarray(positions, np.float64).reshape(-1, 3)
        dark = self.law.dark(x)
        if dark.any():
            place = ", ".join(f"{value:g}" for value in x[dark.argmax()])
            return (
                f"The camera is at ({place}) model lengths, where the medium "
                f"'{self.law.label}' has no light (its n is not a positive number there). Move the camera or the model."
            )
        return None

    def capture_file(self) -> str:
        return self.law.capture_file

    def far_files(self) -> tuple[str, ...]:
        return (self.law.far_file,)

    @property
    def bends_within(self) -> float:
        return self.law.bends_within

    def smooth(self) -> bool:
        return self.law.smooth

    def borders(self) -> Borders:
        return self.law.borders

    def shader_files(self) -> tuple[str, ...]:
        equation = "models/refraction_speed" if self.law.thins_out else "models/refraction_force"
        return (f"models/{self.name}", equation, *self.law.files())

    def flags(self) -> frozenset[str]:
        return frozenset({self.law.symmetry} - {""})

    def generated(self) -> tuple[tuple[str, str], ...]:
        return self.law.generated()

    def uniforms(self) -> dict[str, object]:
        return super().uniforms() | self.law.uniforms()

    def textures(self) -> dict[str, np.ndarray]:
        return self.law.textures()

    def own_integrator(self) -> str | None:
        return "snell" if self.stepping == "snell" else None
