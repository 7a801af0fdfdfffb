"""The tree of boxes: every primitive once, boxes that contain what is below them, no deeper than the shader's stack."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from addon.core import bvh
from addon.core.bvh import LEAF_SIZE, SPHERES_A_LEAF, STACK_SIZE, build
from addon.core.compose import read

NONE = np.zeros((0, 2, 3), np.float32)


def boxes_of(n, seed=0, size=0.1):
    generator = np.random.default_rng(seed)
    low = generator.uniform(-1, 1, (n, 3))
    return np.stack([low, low + size * generator.random((n, 3))], axis=1).astype(np.float32)


def decoded(nodes):
    """As the shader does it. (n, 2, 2, 3) boxes of both children, low and high; (n, 2) their codes."""
    frame, boxes = nodes[:, 0], nodes[:, 1]
    corner = (frame[:, :3] & np.uint32(0xFFFFFF00)).view(np.float32)
    cell = ((frame[:, :3] & np.uint32(0xFF)) << np.uint32(23)).view(np.float32)
    sides = [
        corner + cell * ((boxes[:, :3] >> np.uint32(8 * i)) & np.uint32(0xFF)).astype(np.float32) for i in range(4)
    ]
    return np.stack(sides, axis=1).reshape(-1, 2, 2, 3), np.ascontiguousarray(nodes[:, :, 3]).view(np.int32)


def leaf(code):
    """(first row, count, kind) of a leaf's code."""
    packed = -2 - code
    return packed >> 3, ((packed >> 1) & 3) + 1, -1 if packed & 1 else 1


def check(triangles, spheres):
    """Walk the whole tree; its depth."""
    tree = build(triangles, spheres)
    assert tree.nodes.dtype == np.uint32 and tree.nodes.shape[1:] == (2, 4)
    boxes, codes = decoded(tree.nodes)
    assert np.array_equal(np.sort(tree.triangles), np.arange(len(triangles)))
    assert np.array_equal(np.sort(tree.spheres), np.arange(len(spheres)))
    seen = {1: np.zeros(len(triangles), int), -1: np.zeros(len(spheres), int)}
    reached = np.zeros(len(tree.nodes), int)
    reached[0] = 1
    deepest = 0
    kinds = {1: triangles[tree.triangles], -1: spheres[tree.spheres]}

    def walk(row, depth):
        """What is below a node: its rows of both kinds. Its boxes hold it, and are at most two cells too large."""
        nonlocal deepest
        deepest = max(deepest, depth)
        below = []
        for box, code in zip(boxes[row], codes[row].tolist(), strict=True):
            if code >= 0:
                assert code > row
                reached[code] += 1
                inside = walk(code, depth + 1)
            else:
                first, count, kind = leaf(code)
                assert count <= (LEAF_SIZE if kind == 1 else SPHERES_A_LEAF)
                rows = np.arange(first, first + count)
                seen[kind][rows] += 1
                inside = kinds[kind][rows]
            assert (box[0] <= inside[:, 0]).all() and (inside[:, 1] <= box[1]).all()
            below.append((box, inside))
        both = np.concatenate([inside for _, inside in below])
        low, high = both[:, 0].min(axis=0).astype(float), both[:, 1].max(axis=0).astype(float)
        # Cells are powers of two, of which at least 127 are used; the corner has 16 bits.
        cell = np.maximum((high - low) / 127.0 + abs(low) * 2.0**-15, 2.0**-125)
        for box, inside in below:
            assert (box[0] >= inside[:, 0].min(axis=0) - 2.0 * cell).all()
            assert (box[1] <= inside[:, 1].max(axis=0) + 2.0 * cell).all()
        return both

    walk(0, 0)
    if len(tree.nodes) == 1 and codes[0, 0] == codes[0, 1]:  # one leaf, which the node has twice
        seen = {kind: counts // 2 for kind, counts in seen.items()}
    assert (reached == 1).all() and (seen[1] == 1).all() and (seen[-1] == 1).all()
    assert deepest + 1 < STACK_SIZE
    return deepest


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 8, 9, 100, 257, 3000])
@pytest.mark.parametrize("kind", ["triangles", "spheres", "both"])
def test_every_primitive_once_in_boxes_that_contain_it(n, kind):
    triangles = boxes_of(n, 1) if kind != "spheres" else NONE
    spheres = boxes_of(max(1, n // 3), 2) if kind != "triangles" else NONE
    check(triangles, spheres)


@settings(max_examples=60, deadline=None)
@given(
    arrays.arrays(
        np.float32,
        st.tuples(st.integers(1, 60), st.just(2), st.just(3)),
        elements=st.sampled_from(
            np.float32([-1e15, -1.0, -1e-30, 0.0, 1e-30, 0.5, 0.5000001, 1.0, 7.0, 1e15]).tolist()
        ),
    ),
    st.integers(0, 60),
)
def test_degenerate_flat_and_coincident_boxes(corners, sphere_count):
    boxes = np.sort(corners, axis=1)
    sphere_count = min(sphere_count, len(boxes))
    check(boxes[sphere_count:], boxes[:sphere_count])


def test_a_thousand_boxes_in_one_place_make_a_balanced_tree():
    assert check(np.repeat(boxes_of(1), 1000, axis=0), NONE) <= 10


def test_sizes_that_grow_from_box_to_box_stay_within_the_stack():
    """Each box is twice as far out as the one before: the cheapest cut takes one box off at a time."""
    low = (2.0 ** np.arange(-60, 45))[:, None] * np.ones(3)
    check(np.repeat(np.stack([low, 1.1 * low], axis=1).astype(np.float32), 20, axis=0), NONE)


def test_trees_of_many_cells_are_joined():
    """Enough boxes for a grid, for several batches, and for cells of both kinds."""
    check(boxes_of(20_000, 3, 0.01), boxes_of(50_000, 4, 0.01))


@pytest.mark.parametrize(("n", "triangle_count"), [(1, 0), (1, 1), (7, 3), (16, 16), (5000, 5000), (5000, 3000)])
def test_cells_hold_enough_of_one_kind_and_neighbours_lie_together(n, triangle_count):
    boxes = boxes_of(n, 7, 0.001)
    low_and_minus_high = np.concatenate([boxes[:, 0].T, -boxes[:, 1].T])
    order, first = bvh.grid_cells(low_and_minus_high, triangle_count)
    assert np.array_equal(np.sort(order), np.arange(n))
    assert len(first) <= max(n / bvh.CELL_SIZE, len({triangle_count, n} - {0}))
    cells = np.split(order, first[1:])
    assert all(len(cell) and len(set(cell < triangle_count)) == 1 for cell in cells)
    if n == 5000:  # enough for cells of a quarter of the cube's side, which is 2
        assert max(np.ptp(boxes[cell, 0], axis=0).max() for cell in cells) <= 0.5


def test_it_is_better_than_halves():
    """Expected boxes a ray meets (the surface area heuristic) against a tree that is cut in the middle of its order."""
    generator = np.random.default_rng(5)
    low = np.concatenate([generator.normal(0, 0.05, (2000, 3)), generator.uniform(-10, 10, (2000, 3))])
    boxes = np.stack([low, low + 0.01], axis=1).astype(np.float32)

    def cost(nodes):
        nodes = decoded(nodes)[0]
        x, y, z = np.moveaxis((nodes[:, :, 1] - nodes[:, :, 0]).astype(np.float64), -1, 0)
        return float(np.sum(x * y + y * z + z * x))

    def cut_in_the_middle(rows):
        if len(rows) <= LEAF_SIZE:
            return 0.0
        axis = np.ptp(boxes[rows, 0], axis=0).argmax()
        rows = rows[np.argsort(boxes[rows, 0, axis])]
        halves = rows[: len(rows) // 2], rows[len(rows) // 2 :]
        total = 0.0
        for half in halves:
            x, y, z = (boxes[half, 1].max(axis=0) - boxes[half, 0].min(axis=0)).astype(np.float64)
            total += x * y + y * z + z * x + cut_in_the_middle(half)
        return total

    assert cost(build(boxes, NONE).nodes) < 0.9 * cut_in_the_middle(np.arange(len(boxes)))


def test_the_same_boxes_make_the_same_tree():
    boxes = boxes_of(70_000, 6, 0.01)
    assert np.array_equal(build(boxes, NONE).nodes, build(boxes, NONE).nodes)


def test_nothing_and_too_much_are_refused():
    with pytest.raises(ValueError, match="not 0"):
        build(NONE, NONE)
    too_many = np.broadcast_to(np.zeros((1, 2, 3), np.float32), (bvh.LARGEST_COUNT + 1, 2, 3))
    with pytest.raises(ValueError, match="Use fewer"):
        build(too_many, NONE)


def test_the_shader_has_the_same_stack():
    assert f"const int STACK_SIZE = {STACK_SIZE};" in read("intersection/tree")
