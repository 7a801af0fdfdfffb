"""The empty space among objects: counts against their definition, and clearances against the boxes themselves."""

import numpy as np
import pytest

from addon.core.clear_cells import clear_around
from addon.core.empty_space import FEWEST, MOST, EmptySpace, build


@pytest.mark.parametrize(("shape", "farthest"), [((5, 7, 9), 254), ((1, 1, 1), 4), ((20, 3, 11), 4), ((2, 30, 1), 254)])
def test_counts_are_distances_to_the_nearest_cell_that_is_not_clear(shape, farthest):
    clear = np.random.default_rng(1).random(shape) > 0.02
    clear[0, 0, 0] = False
    taken = np.argwhere(~clear)
    counts = clear_around(clear, farthest)
    for cell in np.ndindex(shape):
        assert counts[cell] == min(np.abs(taken - cell).max(axis=1).min(), farthest)


def test_where_all_is_clear_counts_are_as_large_as_they_may_be():
    assert (clear_around(np.ones((4, 5, 6), bool), 7) == 7).all()


def boxes_of(kind: str) -> np.ndarray:
    generator = np.random.default_rng(5)
    count = 5_000 if kind == "many" else 40
    low = generator.uniform(-3.0, 5.0, (count, 3))
    size = generator.exponential(0.3 if kind != "many" else 0.03, (count, 3))
    if kind == "flat":
        low[:, 2], size[:, 2] = 1.0, 0.0
    if kind == "thin":
        low[:, 2] *= 1e-3
        size[:, 2] *= 1e-4
    if kind == "far away":
        low += 1e4
    if kind == "a point":
        low, size = np.full((1, 3), 7.0), np.zeros((1, 3))
    return np.stack([low, low + size], axis=1).astype(np.float32)


def clearance(space: EmptySpace, points: np.ndarray) -> np.ndarray:
    """What intersection/empty_space.glsl says of points, (n, 3), in cells; float64."""
    place = (points - space.corner) / space.cell
    inside = place.clip(0.5, np.array(space.clear.shape[::-1]) - 0.5)
    beyond = np.abs(place - inside).max(axis=1)
    x, y, z = inside.astype(int).T
    return np.maximum(beyond, space.clear[z, y, x] - beyond) - 1.0


@pytest.mark.parametrize("kind", ["scattered", "many", "flat", "thin", "far away", "a point"])
def test_no_box_is_nearer_than_the_clearance(kind):
    boxes = boxes_of(kind)
    space = build(boxes)
    assert max(space.clear.shape) <= MOST
    generator = np.random.default_rng(6)
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    reach = np.maximum(high - low, 10.0 * space.cell)
    points = generator.uniform(low - 0.3 * reach, high + 0.3 * reach, (4_000, 3))
    nearest = np.full(len(points), np.inf)  # cells, along the axis where a box is farthest; negative inside
    for few in np.array_split(boxes.astype(np.float64), len(boxes) // 500 + 1):
        gaps = np.maximum(few[None, :, 0] - points[:, None], points[:, None] - few[None, :, 1]) / space.cell
        nearest = np.minimum(nearest, gaps.max(axis=2).min(axis=1))
    found = clearance(space, points)
    assert (found <= np.maximum(nearest, 0.0)).all()
    # And not much less than there is: a box touches up to a cell more on its side, a place loses up to one on its own,
    # and at the edge of the grid half of one is given away.
    inside = ((points > low) & (points < high)).all(axis=1)
    if inside.any():
        assert (found[inside] > nearest[inside] - 2.6).all() and found[inside].max() > 3.0


def test_one_large_box_is_not_clear():
    space = build(np.array([[[0.0, 0.0, 0.0], [2.0, 1.0, 4.0]]], np.float32))
    assert space.clear.shape == (FEWEST, FEWEST, FEWEST) and not space.clear.any()


def test_over_a_floor_a_small_height_is_far_away():
    space = build(np.array([[[-300.0, -300.0, 0.0], [300.0, 300.0, 0.0]]], np.float32))
    assert space.clear.shape == (1, FEWEST, FEWEST)
    assert clearance(space, np.array([[0.0, 0.0, 1.0]])) > FEWEST
