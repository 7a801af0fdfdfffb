"""What every model answers. Positions are in the model's own space: centred at its origin, in model lengths."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from .parameter import Parameter


class ParameterError(ValueError):
    """A model was given a parameter it does not have or cannot use."""


class Model:
    """dx/dτ = v, dv/dτ = f(x, v): Eq. (1) of the paper.

    The float64 right-hand side here is written from the equation, not from the GLSL: each checks the other.
    """

    name: ClassVar[str]  # key in MODELS; the GLSL is shaders/models/<name>.glsl
    label: ClassVar[str]
    description: ClassVar[str]
    menu_order: ClassVar[int] = 100
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    observers: ClassVar[tuple[str, ...]] = ("chart", "static")
    curved: ClassVar[bool] = True  # False: rays are straight and nothing is integrated
    has_static_frame: ClassVar[bool] = False  # the GLSL defines static_frame(): space itself is curved

    def __init__(self, **values: float):
        known = {parameter.name for parameter in self.parameters}
        for name in values:
            if name not in known:
                raise ParameterError(f"Model '{self.name}' has no parameter '{name}'. It has: {sorted(known)}.")
        try:
            self.values = {p.name: p.check(values.get(p.name, p.default)) for p in self.parameters}
        except ValueError as error:
            raise ParameterError(f"Model '{self.name}': {error}") from None

    def __getattr__(self, name: str) -> float:
        try:
            return self.__dict__["values"][name]
        except KeyError:
            raise AttributeError(f"{type(self).__name__} has no attribute '{name}'") from None

    def rhs(self, states: np.ndarray) -> np.ndarray:
        """d/dτ of (x, v). states : float64, (n, 6) -> float64, (n, 6)."""
        raise NotImplementedError

    def default_step(self) -> float:
        """A constant step of τ, model lengths, that is accurate to about a pixel."""
        raise NotImplementedError

    def flat_radius(self) -> float:
        """Outside this radius (model lengths) rays count as straight: the smallest bounding sphere of Section 4.1."""
        raise NotImplementedError

    def observer_problem(self, observer: str, position: np.ndarray) -> str | None:
        """Why this observer cannot exist at this position ((3,), model space); None where it can."""
        return None
