"""The truth that rays on the GPU are held against: DOP853 in float64 on the models' own float64 right-hand sides.

Nothing here knows the shaders. Every ray has a step size of its own; rays that ended drop out. A ray ends as the
shaders end it: absorbed where the model says so, escaped at a radius, or stopped at a given τ. How far the result can
be trusted is measured by a second run with a tolerance a hundred times looser.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from . import dop853
from .models import Model
from .status import Status

TOLERANCE, LOOSER = 1e-12, 1e-10  # of a step, as a part of |x| and of |v|
CONVERGED = 1e-7  # radians that the two runs may differ by; the tighter one is then right to some 1e-9
FAR_OUT = 1000.0  # flat radii: where what is left of a 1/r² field turns a ray by less than the tolerance
MOST_STEPS = 5_000
SMALLEST_STEP = 1e-14  # of |x| / |dx/dτ|: below it x no longer changes
RAYS_AT_ONCE = 512  # so that the stages stay in the processor's cache
SAFETY, LARGEST_CUT, LARGEST_GROWTH = 0.9, 0.2, 8.0

# Of some rays: their rows (m,), states before the step and the rates there (m, 6), h (m,), states after it (m, 6).
OnStep = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], None]


@dataclass(frozen=True, eq=False)
class Truth:
    """How n rays end, in model space, float64.

    position     (n, 3), model lengths;  direction (n, 3), unit;  parameter (n,), τ
    status       int32, (n,), values of Status; RUNNING where a ray was stopped at its τ
    steps        int32, (n,)
    uncertainty  (n,), radians: the angle to the direction of the looser run; infinite where the runs end differently
    """

    position: np.ndarray
    direction: np.ndarray
    parameter: np.ndarray
    status: np.ndarray
    steps: np.ndarray
    uncertainty: np.ndarray

    @property
    def converged(self) -> np.ndarray:
        """bool, (n,): whether this is a reference."""
        ended = np.isin(self.status, (Status.RUNNING, Status.ESCAPED, Status.ABSORBED, Status.LEFT_DOMAIN))
        return ended & (self.uncertainty <= CONVERGED)

    def __getitem__(self, rows) -> Truth:
        return Truth(*(getattr(self, field.name)[rows] for field in fields(self)))


def true_ends(
    model: Model,
    positions: np.ndarray,
    directions: np.ndarray,
    *,
    radius: float | None = None,
    parameters: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    on_step: OnStep | None = None,
) -> Truth:
    """positions, unit directions in the chart : (n, 3), model space.

    radius     : where rays escape, model lengths; None: far out, where the model's rays are straight, or where the
                 shaders end them if they never are
    parameters : (n,), τ: stop there, if not ended before
    progress   : called with the fraction done; what it raises ends the work
    on_step    : called with every step of the tighter run that stands
    """
    positions, directions = (np.asarray(rays, np.float64) for rays in (positions, directions))
    states = model.initial_states(positions, directions)
    stops = np.full(len(states), np.inf) if parameters is None else np.asarray(parameters, np.float64)
    stops = np.minimum(stops, model.last_parameter())
    if radius is None:
        reach = np.linalg.norm(positions, axis=1).max(initial=1.0)
        far_out = max(FAR_OUT * model.flat_radius(), 10.0 * reach)
        radius = far_out if model.straight_far_out() else model.escape_radius(reach)
    parts = []
    for first in range(0, len(states), RAYS_AT_ONCE):
        progress(first / len(states))
        rows = slice(first, first + RAYS_AT_ONCE)
        told = on_step and partial(_with_rows_from, first, on_step)
        parts.append(_checked(model, states[rows], stops[rows], radius, told))
    if not parts:
        parts = [_checked(model, states, stops, radius, None)]
    return Truth(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Truth)))


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Radians between unit vectors, (n, 3) each -> (n,); right for small angles, which arccos is not for."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))


def _with_rows_from(first: int, on_step: OnStep, rows: np.ndarray, *step: np.ndarray) -> None:
    on_step(first + rows, *step)


def _checked(model: Model, states: np.ndarray, stops: np.ndarray, radius: float, on_step: OnStep | None) -> Truth:
    tight = _Run(model, states, stops, radius, TOLERANCE, on_step).ends()
    loose = _Run(model, states, stops, radius, LOOSER).ends()
    apart = np.where(tight.status == loose.status, angles(tight.direction, loose.direction), np.inf)
    apart[tight.status == Status.ABSORBED] *= 0.0  # swallowed is swallowed, whichever way
    apart = np.where(np.isnan(apart), np.inf, apart)
    return Truth(tight.position, tight.direction, tight.parameter, tight.status, tight.steps, apart)


class _Run:
    """One integration of n rays. states : (n, 6);  stops : τ, (n,);  radius : model lengths."""

    def __init__(
        self,
        model: Model,
        states: np.ndarray,
        stops: np.ndarray,
        radius: float,
        tolerance: float,
        on_step: OnStep | None = None,
    ):
        self.model, self.radius, self.tolerance, self.on_step = model, radius, tolerance, on_step
        n = len(states)
        self.final = states.copy()
        self.parameter, self.status, self.steps = np.zeros(n), np.zeros(n, np.int32), np.zeros(n, np.int32)
        self.last = states.copy()  # before the step that ended the ray, for where it crosses the radius
        self.last_h = np.zeros(n)
        with np.errstate(all="ignore"):  # a state that is no number is an outcome, not an accident
            self._integrate(stops)
            self._cut_at_radius()

    def ends(self) -> Truth:
        with np.errstate(all="ignore"):
            direction = self.model.ray_directions(self.final) if len(self.final) else self.final[:, 3:]
        unknown = np.zeros(len(self.final))
        return Truth(self.final[:, :3], direction, self.parameter, self.status, self.steps, unknown)

    def _integrate(self, stops: np.ndarray) -> None:
        model, rhs = self.model, self.model.rhs
        rows = np.arange(len(self.final))  # the rays that are not at their end
        states, tau, stops = self.final, self.parameter.copy(), stops.copy()
        rates = rhs(states)
        h = np.full(len(states), np.inf)
        for taken in range(MOST_STEPS):
            speed = np.maximum(np.linalg.norm(rates[:, :3], axis=1), 1e-300)
            h = np.minimum(np.minimum(h, model.clear_distances(states) / speed), stops - tau)
            after, stages = dop853.step(rhs, states, rates, h)
            scale = self.tolerance * np.maximum(_sizes(states), _sizes(after))
            error = dop853.error(stages, h, scale)
            stands = error <= 1.0  # false for NaN, too
            if self.on_step is not None:
                self.on_step(rows[stands], states[stands], rates[stands], h[stands], after[stands])
            status = np.full(len(rows), -1)
            status[~stands & (h * speed < SMALLEST_STEP * np.linalg.norm(states[:, :3], axis=1))] = (
                Status.STEP_TOO_SMALL
            )
            status[stands & (tau + h >= stops)] = Status.RUNNING
            status[stands & (tau + h >= model.last_parameter())] = Status.LEFT_DOMAIN
            status[stands & self._outside(after)] = Status.ESCAPED
            status[stands & model.absorbed(after)] = Status.ABSORBED
            ended = status >= 0
            if ended.any():
                at = rows[ended]
                self.last[at], self.last_h[at] = states[ended], h[ended]
                self.status[at], self.steps[at] = status[ended], taken + 1
            states = np.where(stands[:, None], after, states)
            tau = np.where(stands, tau + h, tau)
            self.final[rows], self.parameter[rows] = states, tau
            factor = SAFETY * np.maximum(error, 1e-14) ** (-1.0 / dop853.ERROR_ORDER)
            h = h * np.clip(np.where(np.isfinite(factor), factor, LARGEST_CUT), LARGEST_CUT, LARGEST_GROWTH)
            if ended.any():
                go_on = ~ended
                rows, states, tau, h, stops = rows[go_on], states[go_on], tau[go_on], h[go_on], stops[go_on]
            if not len(rows):
                return
            rates = rhs(states)
        self.status[rows], self.steps[rows] = Status.STEP_LIMIT, MOST_STEPS

    def _outside(self, states: np.ndarray) -> np.ndarray:
        outward = np.sum(states[:, :3] * self.model.ray_directions(states), axis=1) > 0.0
        return outward & (self.model.distances(states) > self.radius)

    def _cut_at_radius(self) -> None:
        """The last step of a ray that escaped is shortened until it ends on the radius: regula falsi (Illinois)."""
        model = self.model
        rows = np.flatnonzero((self.status == Status.ESCAPED) & (model.distances(self.last) < self.radius))
        if not len(rows):
            return
        start, low, high = self.last[rows], np.zeros(len(rows)), self.last_h[rows]
        rates = model.rhs(start)
        below, above = model.distances(start) - self.radius, model.distances(self.final[rows]) - self.radius
        begin = self.parameter[rows] - high
        was_above = np.ones(len(rows), bool)
        for _ in range(12):
            h = np.clip(low - below * (high - low) / (above - below), low, high)
            ends, _ = dop853.step(model.rhs, start, rates, h)
            beyond = model.distances(ends) - self.radius
            is_above = beyond > 0.0
            # The end that stays a second time counts half, so that the other one moves, too.
            above, below = (
                np.where(is_above, beyond, np.where(was_above, 1.0, 0.5) * above),
                np.where(is_above, np.where(was_above, 0.5, 1.0) * below, beyond),
            )
            high, low = np.where(is_above, h, high), np.where(is_above, low, h)
            was_above = is_above
        self.final[rows], self.parameter[rows] = ends, begin + h


def _sizes(states: np.ndarray) -> np.ndarray:
    """(n, 6): |x| and |v|, each three times."""
    x, v = (np.linalg.norm(part, axis=1, keepdims=True) for part in (states[:, :3], states[:, 3:]))
    return np.repeat(np.concatenate([x, v], axis=1), 3, axis=1) + 1e-300
