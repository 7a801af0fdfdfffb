"""Where the reference's rays meet objects: against closed forms, and the tree of boxes against all pairs. No GPU."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.reference import true_ends
from addon.core.report.hits import NONE, Boxes, Finder, Surfaces
from addon.core.scene import Placement, Spheres, Triangles
from addon.core.status import Status

EXACT = 1e-9  # the reference's own, at a tolerance of 1e-12 a step


def triangles(positions):
    positions = np.asarray(positions, float)
    n = len(positions)
    index = np.zeros(n, np.int32)
    return Triangles(positions, np.zeros((n, 3, 3), np.float32), np.zeros((n, 3, 2), np.float32), index, index)


def spheres(centres, radii):
    n = len(radii)
    index = np.zeros(n, np.int32)
    return Spheres(
        np.asarray(centres, float).reshape(-1, 3), np.asarray(radii, float), np.zeros((n, 3, 3)), index, index
    )


def hits(model, positions, directions, flat=(), round_=((), ()), placement=None):
    flat = triangles(np.asarray(flat).reshape(-1, 3, 3))
    finder = Finder(model, Surfaces(flat, spheres(*round_), placement or Placement()), len(positions))
    ends = true_ends(model, np.asarray(positions, float), np.asarray(directions, float), on_step=finder.on_step)
    return finder, ends


def wall(x, size=50.0):
    """Two triangles that are the square |y|, |z| < size at x."""
    a, b, c, d = ([x, y, z] for y, z in ((-size, -size), (size, -size), (size, size), (-size, size)))
    return [[a, b, c], [a, c, d]]


def test_the_first_of_several_walls_and_spheres():
    """Straight rays along x: at y = 0 a sphere is before the wall, at y = 5 the wall is alone, at y = 70 nothing is."""
    positions = [[-20.0, 0.0, 0.0], [-20.0, 5.0, 1.0], [-20.0, 70.0, 0.0], [4.0, 0.0, 0.0]]
    directions = np.tile((1.0, 0.0, 0.0), (4, 1))
    found, ends = hits(MODELS["straight"](), positions, directions, wall(8.0), ([[4.0, 0.0, 0.0]], [1.5]))
    assert found.surface.tolist() == [2, 0, NONE, 2]
    expected = [[2.5, 0.0, 0.0], [8.0, 5.0, 1.0], [np.nan] * 3, [5.5, 0.0, 0.0]]  # the last one begins inside
    assert np.allclose(found.position, expected, rtol=0.0, atol=EXACT, equal_nan=True)
    assert (ends.status == Status.ESCAPED).all()  # what they meet does not end them here


def test_light_in_a_linear_index_meets_a_wall_on_its_parabola():
    """n² = 1 + g z: x = t cos a, z = t sin a + g t² / 4."""
    model = MODELS["refraction"](medium="linear", index=1.0, gradient=0.05)
    a = np.linspace(-0.4, 0.4, 9)
    directions = np.stack([np.cos(a), 0.0 * a, np.sin(a)], axis=1)
    found, _ = hits(model, np.zeros((9, 3)), directions, wall(6.0))
    t = 6.0 / np.cos(a)
    expected = np.stack([0.0 * a + 6.0, 0.0 * a, t * np.sin(a) + 0.25 * 0.05 * t * t], axis=1)
    assert (found.surface != NONE).all()
    assert np.abs(found.position - expected).max() < EXACT * 6.0


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_light_around_a_hole_meets_a_shell_behind_it(scale):
    """A sphere of 12 M around the camera's side too: rays begin outside it and meet it twice, first from outside. All
    places are on the sphere; those of rays that miss it are none.
    """
    model, placement = MODELS["schwarzschild"](), Placement(scale=scale)
    b = np.array([0.0, 3.0, 8.0, 11.0, 14.0])
    positions = np.stack([np.full(5, -30.0), b, 0.0 * b], axis=1)
    directions = np.tile((1.0, 0.0, 0.0), (5, 1))
    found, _ = hits(model, positions, directions, round_=([[0.0, 0.0, 0.0]], [12.0 * scale]), placement=placement)
    assert found.surface.tolist() == [0, 0, 0, 0, NONE]
    assert np.abs(np.linalg.norm(found.position[:4], axis=1) - 12.0).max() < 12.0 * EXACT
    # A ray at y = 11 is bent inwards before it is there: by some M b / r² of way, a few percent of a length.
    straight = np.sqrt(144.0 - b[:4] ** 2)
    assert (found.position[1:4, 1] < b[1:4]).all() and np.abs(found.position[:4, 0] + straight).max() < 1.0


def test_near_boxes_are_those_of_all_pairs():
    generator = np.random.default_rng(4)
    low = generator.uniform(-5.0, 5.0, (137, 3))
    high = low + generator.uniform(0.0, 1.0, (137, 3))
    low[5] = high[5] = np.nan  # a broken triangle has no box, and hides no other
    query_low = generator.uniform(-5.0, 5.0, (60, 3))
    query_high = query_low + generator.uniform(0.0, 2.0, (60, 3))
    query, box = Boxes(low, high).near(query_low, query_high)
    overlap = ((low[None] <= query_high[:, None]) & (high[None] >= query_low[:, None])).all(axis=2)
    assert overlap.sum() > 20
    assert set(zip(query.tolist(), box.tolist(), strict=True)) == set(zip(*np.nonzero(overlap), strict=True))
    nothing, _ = Boxes(np.zeros((0, 3)), np.zeros((0, 3))).near(query_low, query_high)
    assert len(nothing) == 0
