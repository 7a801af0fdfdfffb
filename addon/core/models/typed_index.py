"""n(x, y, z, r, t) as the user types it, with the gradient that follows from the formula by differentiation."""

from __future__ import annotations

import numpy as np

from ..expressions import GLSL_FILE, ExpressionError, parse
from .base import ParameterError
from .media import Medium

NAMES = ("x", "y", "z", "r", "t")
LARGEST_INDEX = 1e18  # its square is a float32


class Typed(Medium):
    """n of the position x, y, z, the distance r from the centre (model lengths) and t, the parameter `time`."""

    key = "expression"
    label = "Formula"
    description = "An index n that you type, as a formula in x, y, z, r and the time t"
    parameters = ("time", "grain")
    straight_far_out = False

    def prepare(self) -> None:
        try:
            self.index = parse(self.model.formula, NAMES)
            self.slopes = {name: self.index.derivative(name) for name in "xyzr"}
        except ExpressionError as error:
            raise ParameterError(f"Model 'refraction': formula for n, {error}") from None

    def _values(self, x: np.ndarray) -> dict[str, np.ndarray]:
        r = np.linalg.norm(x, axis=1)
        return {"x": x[:, 0], "y": x[:, 1], "z": x[:, 2], "r": r, "t": np.full(len(x), self.model.time)}

    def field(self, x):
        values = self._values(x)
        n = self.index.numpy(values)
        slopes = {name: slope.numpy(values) for name, slope in self.slopes.items()}
        outward = x / np.maximum(values["r"], 1e-30)[:, None]
        gradient = np.stack([slopes[axis] for axis in "xyz"], axis=1) + slopes["r"][:, None] * outward
        return n[:, None] * gradient, n**2

    def dark(self, x):
        n = self.index.numpy(self._values(x))
        return ~((n > 0.0) & (n < LARGEST_INDEX))

    def clear_distances(self, x):
        """The user says how fine the formula is."""
        return np.full(len(x), self.model.grain)

    def default_step(self) -> float:
        return 0.5 * self.model.grain

    def flat_radius(self) -> float:
        return 100.0 * self.model.grain

    def files(self):
        return (*super().files(), GLSL_FILE)

    def generated(self) -> tuple[tuple[str, str], ...]:
        """typed_index(): the gradient of n, and n."""
        renamed = {"x": "p.x", "y": "p.y", "z": "p.z"}
        slope = {name: expression.glsl(renamed) for name, expression in self.slopes.items()}
        text = f"""// Provides the index that the user typed. Printed by addon/core/models/typed_index.py.

vec4 typed_index(vec3 p, float t) {{
    float r = length(p);
    vec3 outward = p / max(r, 1e-30);
    return vec4(vec3({slope["x"]}, {slope["y"]}, {slope["z"]}) + {slope["r"]} * outward, {self.index.glsl(renamed)});
}}
"""
        return (("media/typed_index", text),)
