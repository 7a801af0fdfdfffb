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
        try:
            value = float(value)
        except (TypeError, ValueError):
            raise ValueError(f"'{self.name}' is {value!r}, but must be a number. Change it.") from None
        if not (math.isfinite(value) and self.minimum <= value <= self.maximum):
            raise ValueError(
                f"'{self.name}' is {value:g}, but must lie in [{self.minimum:g}, {self.maximum:g}]. Change it."
            )
        return value


@dataclass(frozen=True)
class Option:
    """A choice that changes the shader's text. choices : (key, label, description) each; the default is a key."""

    name: str
    label: str
    description: str
    choices: tuple[tuple[str, str, str], ...]
    default: str

    def check(self, value: str) -> str:
        keys = [key for key, _, _ in self.choices]
        if value not in keys:
            raise ValueError(f"'{self.name}' is {value!r}, but must be one of {keys}. Choose one of them.")
        return value


@dataclass(frozen=True)
class Text:
    """A formula typed by the user; the model parses it."""

    name: str
    label: str
    description: str
    default: str
    longest: int = 1000

    def check(self, value: str) -> str:
        if not isinstance(value, str) or len(value) > self.longest:
            raise ValueError(f"'{self.name}' must be a text of at most {self.longest} characters. Shorten it.")
        return value
