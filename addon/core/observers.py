"""Which way in the chart an observer looks, in float64, from the metric and not from the shaders.

For an observer at rest in a Kerr–Schild chart space has the metric delta + F / (1 - F) l l, and its symmetric inverse
root turns his directions into the chart's. Schwarzschild's hole has the same form with F = 2M / r and l = x / r.
"""

from __future__ import annotations

import numpy as np

from .models import Model

MINKOWSKI = np.diag([-1.0, 1.0, 1.0, 1.0])


def chart_directions(
    model: Model, observer: str, velocity: tuple[float, float, float], positions: np.ndarray, directions: np.ndarray
) -> np.ndarray:
    """(n, 3), unit. observer : as Settings has it;  velocity : his, where he moves, model space, of light's
    positions, unit directions that he sees : float64, (n, 3), model space
    """
    if observer == "chart":
        return directions
    if observer == "falling":
        return model.ray_directions(_falling_states(model, positions, directions))
    if observer == "moving":
        directions = directions_at_rest(np.asarray(velocity, np.float64), directions)
    if model.has_static_frame:
        f, l_i = _field(model, positions)
        space = np.eye(3) + (f / (1.0 - f))[:, None, None] * l_i[:, :, None] * l_i[:, None, :]
        directions = np.einsum("nij,nj->ni", _inverse_root(space), directions)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def directions_at_rest(velocity: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Aberration: the light that he sees coming from n' has the wave vector (1, -n'), which a boost takes to rest."""
    speed_squared = velocity @ velocity
    if speed_squared == 0.0:
        return directions
    gamma = 1.0 / np.sqrt(1.0 - speed_squared)
    boost = np.eye(4)
    boost[0, 0] = gamma
    boost[0, 1:] = boost[1:, 0] = gamma * velocity
    boost[1:, 1:] += (gamma - 1.0) * np.outer(velocity, velocity) / speed_squared
    light = np.column_stack([np.ones(len(directions)), -directions]) @ boost
    return -light[:, 1:] / light[:, :1]


def _field(model: Model, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """F, (n,), and l, (n, 3)."""
    if model.name == "kerr":
        f, l_i, _, _ = model.fields(x)
        return f, l_i
    r = np.linalg.norm(x, axis=1)
    return 2.0 * model.mass / r, x / r[:, None]


def _inverse_root(metric: np.ndarray) -> np.ndarray:
    """(n, 3, 3), symmetric, of a symmetric positive (n, 3, 3)."""
    values, vectors = np.linalg.eigh(metric)
    return np.einsum("nij,nj,nkj->nik", vectors, 1.0 / np.sqrt(values), vectors)


def _falling_states(model: Model, x: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n, 6): x, and the covariant momentum of a ray with the energy 1 for one who falls with the slices of ingoing
    Kerr–Schild time, in the chart turned round in time that the model traces rays in: u = alpha (-dt + 4Mr / Delta dr).
    His axes are those of the chart's own slices, boosted.
    """
    f, l_i = _field(model, x)
    n = len(x)
    along = np.column_stack([np.ones(n), l_i])  # l_m
    metric = MINKOWSKI + f[:, None, None] * along[:, :, None] * along[:, None, :]
    inverse = np.linalg.inv(metric)
    alpha = 1.0 / np.sqrt(1.0 + f)
    a, r = model.traced_a, model.radius(x)
    gradient = 2.0 * r[:, None] ** 2 * x
    gradient[:, 2] += 2.0 * a * a * x[:, 2]
    gradient /= (4.0 * r**3 - 2.0 * r * (np.sum(x * x, axis=1) - a * a))[:, None]  # of r
    delta = r * r - 2.0 * model.mass * r + a * a
    slices = np.column_stack([-alpha, np.zeros((n, 3))])
    falling = alpha[:, None] * np.column_stack([-np.ones(n), (4.0 * model.mass * r / delta)[:, None] * gradient])
    axis = np.einsum("nij,nj->ni", _inverse_root(metric[:, 1:, 1:]), directions)
    axis = np.einsum("nij,nj->ni", metric[:, :, 1:], axis)

    def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.einsum("ni,nij,nj->n", p, inverse, q)

    boosted = axis + (product(falling, axis) / (1.0 - product(slices, falling)))[:, None] * (slices + falling)
    return np.concatenate([x, (falling + boosted)[:, 1:]], axis=1)
