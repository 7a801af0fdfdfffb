"""A force typed by the user, as three formulas in x y z, vx vy vz, r = |x|, t and named parameters.

    dx/dτ = v        dv/dτ = (fx, fy, fz)      Eq. (1) of the paper; f = 0 beyond reach

t is the parameter `time`, the same for the whole picture. Values of parameters are uniforms: only a new formula, or a
new name, compiles anything.
"""

from __future__ import annotations

import math
import re

import numpy as np

from ..expressions import ALIASES, CONSTANTS, FUNCTIONS, GLSL_FILE, LARGEST_NUMBER, ExpressionError, parse
from .base import Model, ParameterError
from .parameter import Parameter, Text
from .reach import REACH, within_reach

COMPONENTS = ("fx", "fy", "fz")
VARIABLES = {  # name in a formula -> in GLSL
    "x": "x.x",
    "y": "x.y",
    "z": "x.z",
    "vx": "v.x",
    "vy": "v.y",
    "vz": "v.z",
    "r": "r",
    "t": "u_time",
}
MOST_PARAMETERS = 16
IDENTIFIER = re.compile(r"[A-Za-z](?:_?[A-Za-z0-9])*")  # GLSL keeps names with two underscores to itself
LONGEST_NAME = 32


def _component(axis: str) -> Text:
    description = f"Force along {axis.upper()}, a formula in x y z vx vy vz r t and the parameters"
    return Text(f"f{axis}", f"F{axis}", description, f"-{axis} / (r^2 + 1)^1.5")


class Custom(Model):
    """parameters : of the formulas, name -> value; None is none."""

    name = "custom"
    label = "Custom"
    description = "A force typed as three formulas"
    menu_order = 90
    parameters = (
        Parameter("time", 0.0, "seconds", "t in the formulas; animate it", -1e9, 1e9, 0.0, 10.0),
        REACH,
    )
    texts = tuple(_component(axis) for axis in "xyz")
    extras = ("parameters",)
    observers = ("chart",)

    def prepare(self) -> None:
        self.values["parameters"] = {name: self._checked(name, value) for name, value in self._pairs()}
        names = (*VARIABLES, *self.named)
        formulas = []
        for component in COMPONENTS:
            try:
                formulas.append(parse(self.values[component], names))
            except ExpressionError as error:
                raise ParameterError(f"Model '{self.name}': '{component}', {error}") from None
        self._formulas = tuple(formulas)

    @property
    def named(self) -> dict[str, float]:
        """Name -> value of the formulas' parameters."""
        return self.values["parameters"]

    def _pairs(self) -> list[tuple[str, float]]:
        try:
            pairs = list(dict(self.named or {}).items())
        except (TypeError, ValueError):
            raise ParameterError(f"Model '{self.name}': 'parameters' must map names to numbers. Change it.") from None
        if len(pairs) > MOST_PARAMETERS:
            raise ParameterError(
                f"Model '{self.name}': there are {len(pairs)} named parameters, but {MOST_PARAMETERS} are allowed. "
                "Remove some."
            )
        return pairs

    def _checked(self, name: str, value: float) -> float:
        """A named parameter's value, where both can be used."""
        usable = isinstance(name, str) and len(name) <= LONGEST_NAME and IDENTIFIER.fullmatch(name)
        if not usable:
            raise ParameterError(
                f"Model '{self.name}': {str(name)[:40]!r} cannot be a parameter's name: a letter, then letters, "
                f"digits and single underscores, at most {LONGEST_NAME}. Rename it."
            )
        if name in {*VARIABLES, *CONSTANTS, *FUNCTIONS, *ALIASES}:
            raise ParameterError(f"Model '{self.name}': parameter '{name}' has the name of something else. Rename it.")
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not abs(number) <= LARGEST_NUMBER:
            raise ParameterError(f"Model '{self.name}': parameter '{name}' is {value!r}, not a number. Change it.")
        return number

    def rhs(self, states: np.ndarray) -> np.ndarray:
        values = dict(zip(VARIABLES, states.T, strict=False))
        values |= {"r": np.linalg.norm(states[:, :3], axis=1), "t": self.time}
        force = np.stack([formula.numpy(values | self.named) for formula in self._formulas], axis=1)
        return np.concatenate([states[:, 3:], within_reach(values["r"], self.reach)[:, None] * force], axis=1)

    def force_of_position(self) -> bool:
        used = frozenset().union(*(formula.names for formula in self._formulas))
        return used.isdisjoint({"vx", "vy", "vz"})

    def default_step(self) -> float:
        return 0.05

    def flat_radius(self) -> float:
        return self.reach

    def shader_files(self) -> tuple[str, ...]:
        return (GLSL_FILE, "models/reach", "models/custom")

    def generated(self) -> tuple[tuple[str, str], ...]:
        declared = [f"uniform float u_custom_{name};" for name in self.named]
        rename = VARIABLES | {name: f"u_custom_{name}" for name in self.named}
        components = ",\n".join(f"        {formula.glsl(rename)}" for formula in self._formulas)
        lines = [
            "// Provides the typed force.",
            "",
            *declared,
            "vec3 typed_force(vec3 x, vec3 v, float r) {",
            f"    return vec3(\n{components});",
            "}",
            "",
        ]
        return (("the formulas", "\n".join(lines)),)

    def uniforms(self) -> dict[str, object]:
        return super().uniforms() | {f"u_custom_{name}": value for name, value in self.named.items()}
