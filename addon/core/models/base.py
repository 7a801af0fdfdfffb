"""What every model answers. Positions are in the model's own space: centred at its origin, in model lengths."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from .borders import NO_BORDERS, Borders
from .parameter import Option, Parameter, Text


class ParameterError(ValueError):
    """A model was given a parameter it does not have or cannot use."""


class Model:
    """dx/dτ = v, dv/dτ = f(x, v): Eq. (1) of the paper.

    The float64 right-hand side here is written from the equation, not from the GLSL: each checks the other.
    Values are numbers (parameters: uniforms, so that changing one compiles nothing), options (which shader files) and
    texts (formulas, printed as GLSL); all are attributes by their name.
    """

    name: ClassVar[str]  # key in MODELS; the GLSL is shaders/models/<name>.glsl
    label: ClassVar[str]
    description: ClassVar[str]
    menu_order: ClassVar[int] = 100
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    options: ClassVar[tuple[Option, ...]] = ()
    texts: ClassVar[tuple[Text, ...]] = ()
    extras: ClassVar[tuple[str, ...]] = ()  # names of array arguments, e.g. centres: see the model
    observers: ClassVar[tuple[str, ...]] = ("chart", "static", "moving")
    curved: ClassVar[bool] = True  # False: rays are straight and nothing is integrated
    has_static_frame: ClassVar[bool] = False  # the GLSL defines static_frame(), clock_rate(): spacetime is curved
    bends_within: ClassVar[float] = 1e30  # impact parameters from the centre, before which a ray is straight
    has_far_side: ClassVar[bool] = False  # the GLSL defines far_side() and own_side(): rays may end in another world

    def __init__(self, **values):
        named = {entry.name: entry for entry in (*self.parameters, *self.options, *self.texts)}
        for name in values:
            if name not in named and name not in self.extras:
                known = sorted([*named, *self.extras])
                raise ParameterError(f"Model '{self.name}' has no parameter '{name}'. It has: {known}.")
        try:
            self.values = {name: entry.check(values.get(name, entry.default)) for name, entry in named.items()}
        except ValueError as error:
            raise ParameterError(f"Model '{self.name}': {error}") from None
        self.values |= {name: values.get(name) for name in self.extras}
        self.prepare()

    def __getattr__(self, name: str):
        try:
            return self.__dict__["values"][name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no attribute '{name}'") from None

    def prepare(self) -> None:
        """Check what concerns several values, and derive what the other methods need. Raises ParameterError."""

    @classmethod
    def unused(cls, chosen: Mapping[str, str]) -> frozenset[str]:
        """Parameters and texts that do nothing with these options; the panel hides them."""
        return frozenset()

    # The equation

    def rhs(self, states: np.ndarray) -> np.ndarray:
        """d/dτ of (x, v). states : float64, (n, 6) -> float64, (n, 6)."""
        raise NotImplementedError

    def initial_states(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """positions, unit directions in the chart : float64, (n, 3) -> float64, (n, 6), the first state."""
        return np.concatenate([positions, directions], axis=1)

    def ray_directions(self, states: np.ndarray) -> np.ndarray:
        """states : float64, (n, 6) -> float64, (n, 3), unit."""
        v = self.rhs(states)[:, :3]
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    # Where it ends

    def absorbed(self, states: np.ndarray) -> np.ndarray:
        """states : float64, (n, 6) -> bool, (n,): swallowed, e.g. by a horizon."""
        return np.zeros(len(states), bool)

    def distances(self, states: np.ndarray) -> np.ndarray:
        """From the centre, in the chart of the side that the ray is on. float64, (n, 6) -> (n,), model lengths."""
        return np.linalg.norm(states[:, :3], axis=1)

    def straight_far_out(self) -> bool:
        """Whether rays that have left the flat radius keep their direction for ever."""
        return True

    def force_of_position(self) -> bool:
        """Whether dx/dτ is v and dv/dτ depends on x alone, but for what the ray conserves: Nyström's methods need it.
        The GLSL defines vec3 acceleration(vec3 x, RayState s) then, the force at x on the ray that comes through s.
        """
        return False

    def capture_file(self) -> str:
        """The file of shaders/captures: whether a ray is certain to be absorbed before it is."""
        return "captures/none"

    def smooth(self) -> bool:
        """Whether the force has the derivatives that a method of sixth order needs, but for its borders."""
        return True

    def borders(self) -> Borders:
        """Where the law is not smooth or swallows rays."""
        return NO_BORDERS

    def orbit_files(self) -> tuple[str, ...]:
        """Files of shaders/ that define the same rays as orbits in a chart of their own, for where nothing but their
        ends is asked for; none if the model has no such chart. They are given the flag ORBIT.
        """
        return ()

    def last_parameter(self) -> float:
        """τ at which a ray ends that has met nothing until then. If finite, the GLSL defines time_left(tau)."""
        return math.inf

    # Its scales

    def clear_distances(self, states: np.ndarray) -> np.ndarray:
        """How far a ray may go in one step without leaping over something small. float64, (n, 6) -> (n,), lengths."""
        return 0.25 * np.maximum(self.distances(states), self.default_step())

    def default_step(self) -> float:
        """A constant step of τ, model lengths, that is accurate to about a pixel."""
        raise NotImplementedError

    def flat_radius(self) -> float:
        """Outside this radius (model lengths) rays count as straight: the smallest bounding sphere of Section 4.1."""
        raise NotImplementedError

    def escape_radius(self, reach: float) -> float:
        """Where a ray that begins at the radius `reach` may count as straight, model lengths. A reach of 0 is asked
        where steps are constant, and every length of way costs time.
        """
        return self.flat_radius()

    def observer_problem(self, observer: str, positions: np.ndarray) -> str | None:
        """Why this observer cannot exist at one of these positions ((3,) or (n, 3), model space); None where he can."""
        return None

    # Its shader

    def shader_files(self) -> tuple[str, ...]:
        """Files of shaders/ that define the model's functions."""
        return (f"models/{self.name}",)

    def files_of_long_rays(self) -> dict[str, str]:
        """What replaces some of these files for rays that have taken many steps, where there are no objects to meet: a
        look ahead, whether they are certain to be absorbed, is worth its time then.
        """
        return {}

    def flags(self) -> frozenset[str]:
        """Names for #ifdef in these files."""
        return frozenset()

    def generated(self) -> tuple[tuple[str, str], ...]:
        """(name, GLSL) of functions that are printed, e.g. from a formula."""
        return ()

    def uniforms(self) -> dict[str, object]:
        """Uniform name -> value: u_<parameter> for every number."""
        return {f"u_{parameter.name}": self.values[parameter.name] for parameter in self.parameters}

    def textures(self) -> dict[str, np.ndarray]:
        """Sampler name -> float32, (rows, columns, 4) for texelFetch, or (depth, rows, columns, channels): a volume."""
        return {}

    def own_integrator(self) -> str | None:
        """A file of shaders/integrators instead of the user's choice, e.g. for Snell stepping, or None."""
        return None
