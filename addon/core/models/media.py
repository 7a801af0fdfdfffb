"""Indices of refraction n(x), in float64: the twins of shaders/media/. Each knows its field, its scales and its limits.

field() gives half the gradient of n² and n² itself, which is all that the equation needs, and stays defined where n²
is negative and light cannot go.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from .base import Model, ParameterError
from .borders import FRONT, LEAVING, NO_BORDERS, RIM, SWALLOWING, Borders
from .noise import noise

BEYOND_BORDER = 1.01  # a ray has crossed a ball's border before it leaves the bounding sphere


class Medium:
    """One n(x). `model` holds the parameters; positions are in model lengths."""

    key: ClassVar[str]  # shaders/media/<key>.glsl
    label: ClassVar[str]
    description: ClassVar[str]
    parameters: ClassVar[tuple[str, ...]]  # those of the model that it reads
    straight_far_out: ClassVar[bool] = True  # False: n goes on changing beyond the flat radius
    more_files: ClassVar[tuple[str, ...]] = ()  # of shaders/, that it calls
    smooth: ClassVar[bool] = True  # as Model.smooth()
    capture_file: ClassVar[str] = "captures/none"  # as Model.capture_file()
    thins_out: ClassVar[bool] = False  # n falls towards 0 far out: |v| = n has to be put into the equation
    far_file: ClassVar[str] = "far/none"  # as Model.far_files()
    bends_within: ClassVar[float] = 1e30  # as Model.bends_within
    borders: ClassVar[Borders] = NO_BORDERS  # as Model.borders()
    symmetry: ClassVar[str] = ""  # "RADIAL": n(|x|); "LAYERED": n(z); a flag of the shader, for what is conserved

    def __init__(self, model: Model):
        self.model = model
        self.prepare()

    def prepare(self) -> None:
        """Check and derive. Raises ParameterError."""

    def field(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """float64, (n, 3) -> half the gradient of n², (n, 3), and n², (n,)."""
        raise NotImplementedError

    def dark(self, x: np.ndarray) -> np.ndarray:
        """bool, (n,): where no light goes and a ray counts as absorbed."""
        return np.zeros(len(x), bool)

    def clear_distances(self, x: np.ndarray) -> np.ndarray:
        """As Model.clear_distances(), at x : float64, (n, 3)."""
        return 0.25 * np.maximum(np.linalg.norm(x, axis=1), self.default_step())

    def default_step(self) -> float:
        raise NotImplementedError

    def flat_radius(self) -> float:
        raise NotImplementedError

    def escape_radius(self, reach: float) -> float:
        """As Model.escape_radius()."""
        return self.flat_radius()

    def files(self) -> tuple[str, ...]:
        return (f"media/{self.key}", *self.more_files)

    def generated(self) -> tuple[tuple[str, str], ...]:
        """Printed functions, as Model.generated()."""
        return ()

    def uniforms(self) -> dict[str, object]:
        """Uniforms beside the parameters."""
        return {}

    def textures(self) -> dict[str, np.ndarray]:
        return {}

    def refuse_dark_index(self, smallest: float, name: str) -> None:
        """A medium whose n falls to 0 or below has no rays."""
        if smallest <= 0.0:
            raise ParameterError(
                f"Model 'refraction': '{name}' {getattr(self.model, name):g} makes n as small as {smallest:g}, "
                f"but n must be positive. Bring '{name}' nearer to 0."
            )


def quintic(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From 0 at t <= 0 to 1 at t >= 1, twice continuously differentiable; and its derivative."""
    t = np.clip(t, 0.0, 1.0)
    return 6.0 * t**5 - 15.0 * t**4 + 10.0 * t**3, 30.0 * t**4 - 60.0 * t**3 + 30.0 * t**2


def radial(x: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """The gradient of a function of r = |x| with the derivative `slope` (n,)."""
    r = np.linalg.norm(x, axis=1)
    return (slope / np.maximum(r, 1e-300))[:, None] * x


def upwards(slope: np.ndarray) -> np.ndarray:
    """The gradient of a function of z with the derivative `slope` (n,)."""
    return np.stack([0.0 * slope, 0.0 * slope, slope], axis=1)


class Explosion(Medium):
    """n = 1 + strength · inside · front with y = x / R(t) and R = radius · t^(2/5), Sedov and Taylor's strong blast.

    inside = (1 + k) |y|⁴ − k: compressed air behind the front, thin air at the centre (k is the rarefaction);
    front = 1 within, 0 outside |y| = 1 + roughness · noise(frequency · y), a quintic of width `thickness`.
    """

    key = "explosion"
    borders = FRONT
    more_files = ("media/noise", "common/vacuum")
    label = "Explosion"
    description = "A blast wave: a rough front of dense air that expands with Time, thin air behind it"
    parameters = ("radius", "time", "strength", "thickness", "roughness", "frequency", "rarefaction", "seed")

    def prepare(self) -> None:
        p = self.model
        dense = (1.0 + p.rarefaction) * (1.0 + p.roughness + 0.5 * p.thickness) ** 4 - p.rarefaction
        self.refuse_dark_index(1.0 + min(-p.strength * p.rarefaction, p.strength * dense), "strength")

    def blast_radius(self) -> float:
        return self.model.radius * max(self.model.time**0.4, 1e-6)

    def above_front(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient and value of the height above the rough front, in units of R; of a smooth one where it is out of
        reach.
        """
        p = self.model
        height = np.linalg.norm(y, axis=1) - 1.0
        slope, value = np.zeros_like(y), np.zeros(len(y))
        near = np.abs(height) < p.roughness + 0.5 * p.thickness
        if near.any():
            slope[near], value[near] = noise(p.frequency * y[near], int(p.seed))
        height -= p.roughness * value
        return radial(y, np.ones(len(y))) - p.roughness * p.frequency * slope, height

    def field(self, x):
        p, R = self.model, self.blast_radius()
        y = x / R
        height_gradient, height = self.above_front(y)
        front, front_slope = quintic(0.5 - height / p.thickness)
        s = np.linalg.norm(y, axis=1)
        inside = (1.0 + p.rarefaction) * s**4 - p.rarefaction
        inside_gradient = radial(y, 4.0 * (1.0 + p.rarefaction) * s**3)
        n = 1.0 + p.strength * inside * front
        front_gradient = -front_slope[:, None] / p.thickness * height_gradient
        gradient = p.strength / R * (front[:, None] * inside_gradient + inside[:, None] * front_gradient)
        return n[:, None] * gradient, n**2

    def clear_distances(self, x):
        """As far as the front surely is, and a quarter of its thickness within."""
        p, R = self.model, self.blast_radius()
        gap = np.abs(np.linalg.norm(x, axis=1) / R - 1.0) - p.roughness - 0.5 * p.thickness
        return R * np.maximum(gap, 0.25 * p.thickness)

    def default_step(self) -> float:
        size = max(self.blast_radius(), 0.1 * self.model.radius)  # while it is a point, too
        return size * min(max(0.25 * self.model.thickness, 0.002), 0.05)

    def flat_radius(self) -> float:
        return BEYOND_BORDER * self.blast_radius() * (1.0 + self.model.roughness + 0.5 * self.model.thickness)


class Shell(Medium):
    """n = 1 + strength within the radius, 1 outside, a quintic of width thickness · radius between them."""

    key = "shell"
    borders = FRONT
    more_files = ("common/vacuum",)
    label = "Ball Behind a Front"
    description = "A ball whose index changes across a thin spherical front: Snell's law as Thickness falls"
    parameters = ("radius", "strength", "thickness")
    symmetry = "RADIAL"

    def prepare(self) -> None:
        self.refuse_dark_index(1.0 + min(self.model.strength, 0.0), "strength")

    def field(self, x):
        p = self.model
        width = p.thickness * p.radius
        front, slope = quintic(0.5 - (np.linalg.norm(x, axis=1) - p.radius) / width)
        n = 1.0 + p.strength * front
        return n[:, None] * radial(x, -p.strength * slope / width), n**2

    def clear_distances(self, x):
        """As far as the front is, and a quarter of its thickness within."""
        width = self.model.thickness * self.model.radius
        return np.maximum(np.abs(np.linalg.norm(x, axis=1) - self.model.radius) - 0.5 * width, 0.25 * width)

    def default_step(self) -> float:
        return self.model.radius * min(max(0.25 * self.model.thickness, 0.002), 0.05)

    def flat_radius(self) -> float:
        return BEYOND_BORDER * self.model.radius * (1.0 + 0.5 * self.model.thickness)


class Mirage(Medium):
    """n² = A + B e^(−c z), z up from the ground: hot ground has B < 0 and bends light up (inferior mirage).

    A ray that dips by the angle θ turns above the ground where sin²θ < |B| (1 − e^(−c z)).
    """

    key = "mirage"
    label = "Mirage"
    description = "Air over hot ground at z = 0: far ahead, the ground mirrors the sky"
    parameters = ("mirage_a", "mirage_b", "mirage_c")
    straight_far_out = False
    borders = LEAVING
    symmetry = "LAYERED"

    def field(self, x):
        p = self.model
        layer = p.mirage_b * np.exp(np.minimum(-p.mirage_c * x[:, 2], 60.0))
        return upwards(-0.5 * p.mirage_c * layer), p.mirage_a + layer

    def dark(self, x):
        return self.field(x)[1] <= 0.0

    def clear_distances(self, x):
        """Half of the height above the ground: no step dives through the layer."""
        return np.maximum(0.5 * x[:, 2], 0.5 / self.model.mirage_c)

    def default_step(self) -> float:
        return 0.5 / self.model.mirage_c

    def flat_radius(self) -> float:
        """Not flat beyond, but a ray has passed the layer or turned in it."""
        return 400.0 / self.model.mirage_c


class Luneburg(Medium):
    """n = √(2 − r²/R²) within R, 1 outside: every ray of a parallel beam meets one point of the rim. Luneburg 1944."""

    key = "luneburg"
    borders = RIM
    more_files = ("common/vacuum",)
    label = "Luneburg Lens"
    description = "A ball that focuses a parallel beam in a point of its rim"
    parameters = ("radius",)
    symmetry = "RADIAL"

    def field(self, x):
        squared = np.sum(x**2, axis=1) / self.model.radius**2
        inside = squared < 1.0
        return np.where(inside[:, None], -x / self.model.radius**2, 0.0), np.where(inside, 2.0 - squared, 1.0)

    def clear_distances(self, x):
        """As far as the rim is, and a tenth of the radius within."""
        return np.maximum(np.linalg.norm(x, axis=1) - self.model.radius, 0.1 * self.model.radius)

    def default_step(self) -> float:
        return 0.02 * self.model.radius

    def flat_radius(self) -> float:
        return BEYOND_BORDER * self.model.radius


class Fisheye(Medium):
    """n = n0 / (1 + r²/R²): rays are circles, and all from x pass −R² x / |x|². Maxwell 1854."""

    key = "fisheye"
    thins_out = True
    label = "Maxwell's Fisheye"
    description = "Rays are circles: everything has an image on the other side of the centre"
    parameters = ("radius", "index")
    symmetry = "RADIAL"

    def field(self, x):
        p = self.model
        r = np.linalg.norm(x, axis=1)
        n = p.index / (1.0 + r**2 / p.radius**2)
        slope = -2.0 * p.index * r * p.radius**2 / (p.radius**2 + r**2) ** 2
        return n[:, None] * radial(x, slope), n**2

    def default_step(self) -> float:
        return 0.02 * self.model.radius

    def flat_radius(self) -> float:
        return 20.0 * self.model.radius


class Linear(Medium):
    """n² = n0² + g z: rays are exact parabolas."""

    key = "linear"
    label = "Linear"
    description = "The square of the index grows with height z: rays are parabolas"
    parameters = ("index", "gradient")
    straight_far_out = False
    borders = LEAVING
    symmetry = "LAYERED"

    def field(self, x):
        p = self.model
        return upwards(np.full(len(x), 0.5 * p.gradient)), p.index**2 + p.gradient * x[:, 2]

    def dark(self, x):
        return self.field(x)[1] <= 0.0

    def _turning_length(self) -> float:
        """Radius of curvature at z = 0 of a horizontal ray: 2 n0² / g; at most a thousand."""
        square = 2.0 * self.model.index**2
        return square / max(abs(self.model.gradient), 1e-3 * square)

    def default_step(self) -> float:
        return 0.002 * self._turning_length() / self.model.index

    def flat_radius(self) -> float:
        return 10.0 * self._turning_length()


class Isotropic(Medium):
    """n(ρ) = (1 + u)³ / (1 − u), u = M/2ρ: the null geodesics of Schwarzschild in isotropic coordinates, for which
    ds² = −((1−u)/(1+u))² dt² + (1+u)⁴ dx² = 0 reads dt = n |dx|. The horizon is at ρ = M/2.
    """

    key = "isotropic"
    borders = SWALLOWING
    capture_file = "captures/isotropic"
    far_file = "far/isotropic"
    bends_within = 100.0
    label = "Black Hole as a Medium"
    description = "The index that bends light exactly as a Schwarzschild black hole does, in isotropic coordinates"
    parameters = ("mass",)
    symmetry = "RADIAL"

    def field(self, x):
        rho = np.maximum(np.linalg.norm(x, axis=1), max(0.5005 * self.model.mass, 1e-30))
        u = 0.5 * self.model.mass / rho
        n = (1.0 + u) ** 3 / (1.0 - u)
        # (log n)' = 3/(1+u) + 1/(1−u), and du/dρ = −u/ρ
        slope = n * (3.0 / (1.0 + u) + 1.0 / (1.0 - u)) * -u / rho
        return (n * slope / rho)[:, None] * x, n**2

    def dark(self, x):
        return np.linalg.norm(x, axis=1) <= 0.505 * self.model.mass

    def clear_distances(self, x):
        """Half of the way to where n is infinite."""
        return 0.5 * np.maximum(np.linalg.norm(x, axis=1) - 0.5 * self.model.mass, 0.1 * self.default_step())

    def default_step(self) -> float:
        return 0.05 * self.model.mass if self.model.mass > 0 else 1.0

    def flat_radius(self) -> float:
        """n − 1 falls only as 2M/ρ, but the far field's first order leaves out no more than M/ρ of the turn."""
        return 1000.0 * self.model.mass

    def escape_radius(self, reach: float) -> float:
        """Of what passes by farther out the far field has the whole turn, but for 12 M²/b²."""
        mass = self.model.mass
        return max(self.flat_radius(), min(1.1 * reach, 3e3 * mass)) if reach else 100.0 * mass
