"""Where the reference's rays meet the scene's objects, in float64 and without the shaders or their tree.

Every step of DOP853 is cut into chords along its cubic, which find what the ray may meet; where exactly it does is then
sought with steps of DOP853 itself, from the step's beginning to the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import dop853
from ..models import Model
from ..scene import Placement, Scene, Spheres, Triangles
from ..textures import spatial_order

CHORDS = 8  # of a step, which bends by a tenth of a radian or so: they stray by 1e-4 of its length from the ray
NEWTON = 5  # iterations from a place that is right to a percent of the chord
NONE = -1


@dataclass(frozen=True, eq=False)
class Hits:
    """surface : int, (n,), of Surfaces, or NONE;  position : (n, 3), model space, NaN where there is none"""

    surface: np.ndarray
    position: np.ndarray


class Surfaces:
    """Triangles and spheres of a scene in model space, numbered: first the triangles, in the scene's order."""

    def __init__(self, triangles: Triangles, spheres: Spheres, placement: Placement):
        self.corners = placement.points_to_model(triangles.positions)
        self.centres = placement.points_to_model(spheres.centres)
        self.radii = spheres.radii / placement.scale
        reach = self.radii[:, None]
        low = np.concatenate([self.corners.min(axis=1), self.centres - reach])
        high = np.concatenate([self.corners.max(axis=1), self.centres + reach])
        self.boxes = Boxes(low, high)

    def first_along(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the chords from a to b, (m, 3), meet first, (m,), or NONE; and at which fraction of them, (m,)."""
        chord, surface = self.boxes.near(np.minimum(a, b), np.maximum(a, b))
        along = b[chord] - a[chord]
        fraction = np.empty(len(chord))
        flat = surface < len(self.corners)
        fraction[flat] = _meet_triangles(a[chord[flat]], along[flat], self.corners[surface[flat]])
        round_ = surface[~flat] - len(self.corners)
        fraction[~flat] = _meet_spheres(a[chord[~flat]], along[~flat], self.centres[round_], self.radii[round_])
        met = np.isfinite(fraction)
        chord, surface, fraction = chord[met], surface[met], fraction[met]
        order = np.lexsort((fraction, chord))
        chord, first = np.unique(chord[order], return_index=True)
        found, where = np.full(len(a), NONE), np.full(len(a), np.nan)
        found[chord], where[chord] = surface[order][first], fraction[order][first]
        return found, where

    def heights(self, x: np.ndarray, surface: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far points x, (m, 3), are above these surfaces, (m,), and which way that grows, (m, 3)."""
        flat = surface < len(self.corners)
        value, gradient = np.empty(len(x)), np.empty((len(x), 3))
        a, b, c = np.moveaxis(self.corners[surface[flat]], 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        value[flat], gradient[flat] = np.sum(normal * (x[flat] - a), axis=1), normal
        round_ = surface[~flat] - len(self.corners)
        outward = x[~flat] - self.centres[round_]
        distance = np.linalg.norm(outward, axis=1)
        value[~flat], gradient[~flat] = distance - self.radii[round_], outward / distance[:, None]
        return value, gradient


class Boxes:
    """A binary tree over n boxes in the order of a space-filling curve. low, high : (n, 3)"""

    def __init__(self, low: np.ndarray, high: np.ndarray):
        self.order = spatial_order(np.nan_to_num(0.5 * (low + high))) if len(low) else np.zeros(0, int)
        low, high = low[self.order], high[self.order]
        self.levels = [(low, high)]
        while len(low) > 1:
            if len(low) % 2:  # an empty box makes them even
                low, high = np.vstack([low, np.full(3, np.inf)]), np.vstack([high, np.full(3, -np.inf)])
                self.levels[-1] = (low, high)
            # What is not a number has no box, and must not take its neighbours' away.
            low, high = np.fmin(low[::2], low[1::2]), np.fmax(high[::2], high[1::2])
            self.levels.append((low, high))

    def near(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (query, box), (p,) each, of query boxes, (m, 3), that overlap boxes."""
        query = np.arange(len(low) if len(self.order) else 0)
        node = np.zeros(len(query), int)
        for depth, (lows, highs) in enumerate(reversed(self.levels)):
            if depth:
                query, node = query.repeat(2), (2 * node[:, None] + [0, 1]).ravel()
            overlap = ((lows[node] <= high[query]) & (highs[node] >= low[query])).all(axis=1)
            query, node = query[overlap], node[overlap]
        return query, self.order[node]


class Finder:
    """Collects what n rays meet first, step by step: on_step of reference.true_ends()."""

    def __init__(self, model: Model, surfaces: Surfaces, n: int):
        self.model, self.surfaces = model, surfaces
        self.surface, self.position = np.full(n, NONE), np.full((n, 3), np.nan)

    @property
    def hits(self) -> Hits:
        return Hits(self.surface, self.position)

    def on_step(
        self, rows: np.ndarray, before: np.ndarray, rates: np.ndarray, h: np.ndarray, after: np.ndarray
    ) -> None:
        going = self.surface[rows] == NONE
        rows, before, rates, h, after = (values[going] for values in (rows, before, rates, h, after))
        if not len(rows):
            return
        ends = self.model.rhs(after)
        points = _cubic(before[:, :3], h[:, None] * rates[:, :3], after[:, :3], h[:, None] * ends[:, :3])
        a, b = points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3)
        found, fraction = (values.reshape(-1, CHORDS) for values in self.surfaces.first_along(a, b))
        met = (found != NONE).any(axis=1)
        first = np.argmax(found[met] != NONE, axis=1)
        at = np.arange(len(first))
        surface, part = found[met][at, first], (first + fraction[met][at, first]) / CHORDS
        self.surface[rows[met]] = surface
        self.position[rows[met]] = self._sought(before[met], rates[met], h[met], surface, part)

    def _sought(
        self, before: np.ndarray, rates: np.ndarray, h: np.ndarray, surface: np.ndarray, part: np.ndarray
    ) -> np.ndarray:
        """(m, 3): where the rays are on their surfaces. part : of the step, (m,), nearly right"""
        for _ in range(NEWTON):
            states, _ = dop853.step(self.model.rhs, before, rates, part * h)
            height, gradient = self.surfaces.heights(states[:, :3], surface)
            climb = np.sum(gradient * self.model.rhs(states)[:, :3], axis=1) * h
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.clip(np.where(climb == 0.0, part, part - height / climb), 0.0, 1.0)
        return dop853.step(self.model.rhs, before, rates, part * h)[0][:, :3]


def true_hits(scene: Scene, n: int) -> Finder:
    """For n rays of the scene's model, among its objects."""
    return Finder(scene.model, Surfaces(scene.triangles, scene.spheres, scene.placement), n)


def _cubic(a: np.ndarray, from_a: np.ndarray, b: np.ndarray, to_b: np.ndarray) -> np.ndarray:
    """Points of the cubics with these ends and tangents, (m, 3) each -> (m, CHORDS + 1, 3)."""
    t = np.linspace(0.0, 1.0, CHORDS + 1)[None, :, None]
    a, from_a, b, to_b = (values[:, None] for values in (a, from_a, b, to_b))
    return (
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * a
        + t * (1.0 - t) ** 2 * from_a
        + t * t * (3.0 - 2.0 * t) * b
        + t * t * (t - 1.0) * to_b
    )


def _meet_triangles(start: np.ndarray, along: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Fractions of the chords, (p,), in [0, 1], or infinity; corners : (p, 3, 3). A plane, and three sides of it."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.sum(normal * (a - start), axis=1) / np.sum(normal * along, axis=1)
        point = start + t[:, None] * along
        sides = [np.sum(normal * np.cross(q - p, point - p), axis=1) for p, q in ((a, b), (b, c), (c, a))]
        inside = (np.array(sides) >= 0.0).all(axis=0) & (t >= 0.0) & (t <= 1.0)
    return np.where(inside, t, np.inf)


def _meet_spheres(start: np.ndarray, along: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """As above: the first of the roots of a quadratic that lies on the chord."""
    gap = start - centres
    a, half_b = np.sum(along * along, axis=1), np.sum(along * gap, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(half_b**2 - a * (np.sum(gap * gap, axis=1) - radii**2))
        near, far = (-half_b - root) / a, (-half_b + root) / a
        t = np.where((near >= 0.0) & (near <= 1.0), near, far)
    return np.where((t >= 0.0) & (t <= 1.0), t, np.inf)
