"""One number of a model, with all that the panel, the shader and the error messages need to know of it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """`unit` is text for the tooltip ("model lengths"); the value reaches the shader as the uniform u_<name>."""

    name: str
    default: float
    unit: str
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf
    soft_minimum: float = -10.0
    soft_maximum: float = 10.0

    def check(self, value: float) -> float:
        """The value as a float; ValueError where it is not finite or outside the range."""
        value = float(value)
        if not (math.isfinite(value) and self.minimum <= value <= self.maximum):
            raise ValueError(
                f"'{self.name}' is {value:g}, but must lie in [{self.minimum:g}, {self.maximum:g}]. Change it."
            )
        return value
