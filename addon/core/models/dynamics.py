"""Rays along a dynamical system x' = field(x): Section 5.1 of the paper, in two ways.

    force   dx/dτ = v        dv/dτ = strength · field(x)      Eq. (1) of the paper; |v| = 1 at the camera
    flow    dx/dτ = field(x)                                  Gröller 1995

A force ends at its reach (reach.py). A flow needs a point only; its state carries dx/dτ as v, with the equation that
follows, dv/dτ = (v·∇) field. It goes on for ever: a ray that has met nothing ends after a duration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .parameter import Option, Parameter
from .reach import within_reach

MODE = Option(
    "mode",
    "Mode",
    "What the system says of a ray",
    (
        ("force", "Force", "The system is the force that bends a ray (Eq. 1 of the paper)"),
        ("flow", "Flow", "The system is the way a ray goes, from its own point of the image plane (Gröller 1995)"),
    ),
    "force",
)
STRENGTH = Parameter(
    "strength", 1.0, "a factor", "Force mode: what the force is multiplied by; 0 is straight", -1e6, 1e6, 0.0, 1.0
)
PLANE_DISTANCE = Parameter(
    "plane_distance",
    10.0,
    "model lengths",
    "Flow mode: how far from the camera, along its ray, the image plane lies in which the ray begins",
    0.0,
    1e6,
    0.0,
    100.0,
)
DURATION = Parameter(
    "duration",
    5.0,
    "τ",
    "Flow mode: how long a ray goes with the flow; one that has met nothing by then shows the sky where it is heading",
    1e-6,
    1e6,
    0.1,
    20.0,
)


class Dynamics:
    """Mixed into the Model of a system, which gives field() and field_change()."""

    options = (MODE,)
    flow_step = 0.01  # τ: accurate to about a pixel with constant steps

    @classmethod
    def unused(cls, chosen: Mapping[str, str]) -> frozenset[str]:
        return frozenset({"strength", "reach"} if chosen["mode"] == "flow" else {"plane_distance", "duration"})

    def field(self, x: np.ndarray) -> np.ndarray:
        """x : float64, (n, 3), model lengths -> float64, (n, 3)."""
        raise NotImplementedError

    def field_change(self, x: np.ndarray, along: np.ndarray) -> np.ndarray:
        """(along·∇) field at x. Both float64, (n, 3) -> float64, (n, 3)."""
        raise NotImplementedError

    @property
    def flows(self) -> bool:
        return self.mode == "flow"

    def rhs(self, states: np.ndarray) -> np.ndarray:
        x, v = states[:, :3], states[:, 3:]
        f = self.field(x)
        if self.flows:
            return np.concatenate([f, self.field_change(x, f)], axis=1)
        part = within_reach(np.linalg.norm(x, axis=1, keepdims=True), self.reach)
        return np.concatenate([v, self.strength * part * f], axis=1)

    def initial_states(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        if not self.flows:
            return np.concatenate([positions, directions], axis=1)
        start = positions + self.plane_distance * directions
        v = self.field(start)
        rests = ~v.any(axis=1, keepdims=True)
        return np.concatenate([start, np.where(rests, directions, v)], axis=1)

    def ray_directions(self, states: np.ndarray) -> np.ndarray:
        way = self.rhs(states)[:, :3]
        way = np.where(way.any(axis=1, keepdims=True), way, states[:, 3:])
        return way / np.linalg.norm(way, axis=1, keepdims=True)

    def straight_far_out(self) -> bool:
        return not self.flows

    def last_parameter(self) -> float:
        return self.duration if self.flows else math.inf

    def force_of_position(self) -> bool:
        return not self.flows

    def default_step(self) -> float:
        if self.flows:
            return self.flow_step
        # A force that grows by `strength` times some 30 a length turns a ray within 0.2 lengths / √strength.
        return min(0.5, 0.01 / max(abs(self.strength), 1e-12) ** 0.5)

    def flat_radius(self) -> float:
        """A flow goes on everywhere: a ray counts as escaped where it is far from what the system is known for."""
        return 1000.0 if self.flows else self.reach

    def shader_files(self) -> tuple[str, ...]:
        return ("models/reach", f"models/{self.name}", "models/dynamics")

    def flags(self) -> frozenset[str]:
        return frozenset({"FLOW"} if self.flows else ())
