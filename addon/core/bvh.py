"""Triangles and spheres -> one flat tree of bounding boxes, for intersection/tree.glsl.

Built in two rounds of the same binned surface area heuristic (Wald 2007), level by level, so that numpy works on all
nodes of a level at once: primitives are first gathered in the cells of a grid (as in HLBVH, Garanzha 2011); the
upper tree parts the cells, the lower trees part the primitives of each cell. A cell holds one kind only, so that every
leaf does, too.

A node holds both children's boxes, so that a ray reads one node to choose among two: bvh_nodes.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bvh_nodes import encode, leaf_code
from .strips import on_all_processors

LEAF_SIZE, SPHERES_A_LEAF = 4, 1  # a sphere takes longer than the node that it would share
BINS = 8
CELL_SIZE = 16  # primitives a cell of the grid holds, on average at least
GRID_BITS = 7  # cells an axis of the finest grid: 2^7
BATCH = 1 << 16  # primitives of the lower trees that are built together: as many as a processor's cache holds
UPPER_LEVELS, LOWER_LEVELS = 18, 22  # below, boxes are halved by count: no tree is deeper than the shader's stack
STACK_SIZE = UPPER_LEVELS + LOWER_LEVELS + 1  # intersection/tree.glsl: a child of every level, and the end
LARGEST_COUNT = 1 << 24  # rows that a leaf's code has bits for


@dataclass(frozen=True, eq=False)
class Tree:
    """nodes : uint32, (n, 2, 4), of bvh_nodes.py; the root is node 0
    triangles, spheres : the order that leaves count in, as rows of the arrays the tree was built from
    leaf_size : the median diagonal of the leaves' boxes
    """

    nodes: np.ndarray
    triangles: np.ndarray
    spheres: np.ndarray
    leaf_size: float


@dataclass(eq=False)
class Forest:
    """Binary trees over rows first … end - 1 of a permuted array; roots come first, children after their parents.

    left, right : rows of the children, -1 in a leaf;  boxes : (6, nodes), low corners and negated high corners
    """

    first: np.ndarray
    end: np.ndarray
    left: np.ndarray
    right: np.ndarray
    boxes: np.ndarray


def build(triangle_boxes: np.ndarray, sphere_boxes: np.ndarray) -> Tree:
    """boxes : float32, (n, 2, 3), low and high corners, model space, finite. At least one of both kinds.
    Raises ValueError where there are more primitives than a leaf can name.
    """
    triangle_count = len(triangle_boxes)
    n = triangle_count + len(sphere_boxes)
    if not 0 < n <= LARGEST_COUNT:
        raise ValueError(f"A tree holds 1 to {LARGEST_COUNT} triangles and spheres, not {n}. Use fewer.")
    boxes = np.concatenate([triangle_boxes, sphere_boxes])
    # Low corners and negated high corners: the union of boxes is one minimum.
    boxes = np.concatenate([boxes[:, 0].T, -boxes[:, 1].T]).astype(np.float32, order="C")

    order, first = grid_cells(boxes, triangle_count)
    order, lower = build_lower(boxes[:, order], order, first, np.append(first[1:], n), triangle_count)
    cell_boxes = lower.boxes[:, : len(first)]
    cell_order, upper = grow(cell_boxes, np.array([0]), np.array([len(first)]), 1, UPPER_LEVELS)
    is_sphere = order >= triangle_count
    nodes = flatten(joined(upper, cell_order, lower), np.cumsum(is_sphere) - is_sphere, is_sphere)
    leaves = lower.boxes[:, lower.left < 0].astype(np.float64)
    leaf_size = float(np.median(np.linalg.norm(leaves[:3] + leaves[3:], axis=0)))
    return Tree(nodes, order[~is_sphere], order[is_sphere] - triangle_count, leaf_size)


def grid_cells(boxes: np.ndarray, triangle_count: int) -> tuple[np.ndarray, np.ndarray]:
    """The order of boxes along a Morton curve, spheres last; and where in it the cells of a grid begin, of the finest
    one whose cells hold enough.
    """
    n = boxes.shape[1]
    centres = 0.5 * (boxes[:3] - boxes[3:])
    low, high = centres.min(axis=1, keepdims=True), centres.max(axis=1, keepdims=True)
    scale = np.float32(2**GRID_BITS) / np.maximum(high - low, np.float32(1e-30))
    places = np.minimum((centres - low) * scale, np.float32(2**GRID_BITS - 1)).astype(np.uint32)
    spread = np.array([sum((i >> bit & 1) << 3 * bit for bit in range(GRID_BITS)) for i in range(2**GRID_BITS)])
    x, y, z = spread.astype(np.uint32)[places]
    code = x | y << np.uint32(1) | z << np.uint32(2)
    code[triangle_count:] |= np.uint32(1 << 3 * GRID_BITS)
    order = np.argsort(code.astype(np.uint16), kind="stable")  # numpy sorts 16 bits at a time in linear time
    order = order[np.argsort((code >> np.uint32(16)).astype(np.uint16)[order], kind="stable")]
    code = code[order]
    for coarser in range(GRID_BITS + 1):
        cells = code >> np.uint32(3 * coarser)
        first = np.flatnonzero(np.concatenate([[True], cells[1:] != cells[:-1]]))
        if len(first) <= min(n // CELL_SIZE, 1 << UPPER_LEVELS):
            break
    return order, first


def build_lower(
    boxes: np.ndarray, order: np.ndarray, first: np.ndarray, end: np.ndarray, triangle_count: int
) -> tuple[np.ndarray, Forest]:
    """A tree for every cell, in batches on all processors; `order` as the leaves count."""
    sphere_cells = int(np.searchsorted(first, triangle_count))  # where they begin
    parts, begin = [], 0
    while begin < len(first):  # cells of up to BATCH primitives together, or one larger cell; of one kind
        stop = max(begin + 1, int(np.searchsorted(end, first[begin] + BATCH, side="right")))
        stop = min(stop, sphere_cells) if begin < sphere_cells else stop
        parts.append((begin, stop))
        begin = stop

    def work(part: tuple[int, int]) -> tuple[np.ndarray, Forest]:
        low, high = first[part[0]], end[part[1] - 1]
        cells = slice(*part)
        leaf_size = LEAF_SIZE if part[0] < sphere_cells else SPHERES_A_LEAF
        return grow(boxes[:, low:high], first[cells] - low, end[cells] - low, leaf_size, LOWER_LEVELS)

    grown = on_all_processors(work, parts)
    order = np.concatenate([order[first[b] : end[s - 1]][o] for (b, s), (o, _) in zip(parts, grown, strict=True)])
    return order, gathered([forest for _, forest in grown], [first[b] for b, _ in parts], [s - b for b, s in parts])


def gathered(forests: list[Forest], rows: list[int], roots: list[int]) -> Forest:
    """Several forests as one, all their roots in front. rows : where each one's array begins in the whole."""
    sizes = [len(forest.first) for forest in forests]
    root_base = np.concatenate([[0], np.cumsum(roots)])
    inner_base = root_base[-1] + np.concatenate([[0], np.cumsum(np.array(sizes) - roots)])
    total = sum(sizes)
    whole = Forest(*(np.empty(total, np.int64) for _ in range(4)), np.empty((6, total), np.float32))
    for number, (forest, row, root_count) in enumerate(zip(forests, rows, roots, strict=True)):
        places = np.arange(sizes[number]) + inner_base[number] - root_count
        places[:root_count] = np.arange(root_count) + root_base[number]
        whole.first[places] = forest.first + row
        whole.end[places] = forest.end + row
        whole.left[places] = np.where(forest.left < 0, -1, places[forest.left])
        whole.right[places] = np.where(forest.left < 0, -1, places[forest.right])
        whole.boxes[:, places] = forest.boxes
    return whole


def joined(upper: Forest, cell_order: np.ndarray, lower: Forest) -> Forest:
    """The upper tree with the lower trees' roots in place of its leaves."""
    inner = np.flatnonzero(upper.left >= 0)
    place = np.empty(len(upper.first), np.int64)  # of an upper node: inner ones first, then all of the lower forest
    place[inner] = np.arange(len(inner))
    leaves = np.flatnonzero(upper.left < 0)
    place[leaves] = len(inner) + cell_order[upper.first[leaves]]
    below = np.where(lower.left < 0, -1, lower.left + len(inner))
    return Forest(
        np.concatenate([np.zeros(len(inner), np.int64), lower.first]),
        np.concatenate([np.zeros(len(inner), np.int64), lower.end]),
        np.concatenate([place[upper.left[inner]], below]),
        np.concatenate([place[upper.right[inner]], np.where(lower.left < 0, -1, lower.right + len(inner))]),
        np.concatenate([upper.boxes[:, inner], lower.boxes], axis=1),
    )


def grow(
    boxes: np.ndarray, first: np.ndarray, end: np.ndarray, leaf_size: int, levels: int
) -> tuple[np.ndarray, Forest]:
    """Part every root's rows first … end - 1 until leaves hold leaf_size. Returns the order of rows, and the trees.

    boxes : float32, (6, n);  the roots' ranges follow each other and cover all rows
    """
    order = np.arange(boxes.shape[1])
    rows, place = order.copy(), order.copy()  # of the ranges that are still wide: what stands where
    firsts, ends, lefts, rights = [first], [end], [], []
    node_boxes = [np.minimum.reduceat(boxes, first, axis=1)]
    made = len(first)
    for level in range(levels + 1):
        wide = end - first > leaf_size
        left = np.full(len(first), -1)
        left[wide] = made + 2 * np.arange(wide.sum())
        lefts.append(left)
        rights.append(np.where(wide, left + 1, -1))
        if not wide.any():
            break
        if not wide.all():
            kept = np.repeat(wide, end - first)
            boxes, rows, place = boxes[:, kept], rows[kept], place[kept]
            first, end = first[wide], end[wide]
        most = leaf_size << min(levels - level, 40)
        boxes, rows, taken, child_boxes = part(boxes, rows, end - first, most)
        order[place] = rows
        cut = first + taken
        first, end = np.stack([first, cut], axis=1).ravel(), np.stack([cut, end], axis=1).ravel()
        firsts.append(first)
        ends.append(end)
        node_boxes.append(child_boxes)
        made += len(first)
    parts = (firsts, ends, lefts, rights)
    return order, Forest(*(np.concatenate(part) for part in parts), np.concatenate(node_boxes, axis=1))


def part(
    boxes: np.ndarray, rows: np.ndarray, size: np.ndarray, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sort ranges of `size` boxes each by place, and cut each in two where that is cheapest.

    most : how many a range may hold for the levels that remain;  rows : go along with the boxes
    Returns boxes and rows, sorted; how many each first part takes; the boxes of the parts, (6, 2 * ranges).
    """
    start = np.cumsum(size) - size
    nodes = np.arange(len(size))
    node = np.repeat(nodes, size)

    # Bins along the longest side of the box around the centres.
    centres = boxes[:3] - boxes[3:]
    low = np.minimum.reduceat(centres, start, axis=1)
    extent = np.maximum.reduceat(centres, start, axis=1) - low
    axis = extent.argmax(axis=0)
    longest = extent[axis, nodes]
    scale = np.where(longest > 0, np.float32(BINS) / np.maximum(longest, np.float32(1e-30)), 0).astype(np.float32)
    along = centres.ravel()[np.repeat(axis * len(rows), size) + np.arange(len(rows))]
    bins = (along - np.repeat(low[axis, nodes], size)) * np.repeat(scale, size)
    key = np.minimum(bins, np.float32(BINS - 1)).astype(np.int32) + BINS * node
    bin_count = BINS * len(size)
    sort = np.argsort(key.astype(np.uint16) if bin_count <= 1 << 16 else key, kind="stable")
    boxes, rows = np.take(boxes, sort, axis=1), rows[sort]

    # Area times count on both sides of every cut, summed.
    count = np.bincount(key, minlength=bin_count)
    filled = np.flatnonzero(count)
    bin_boxes = np.full((6, bin_count), np.inf, np.float32)
    bin_boxes[:, filled] = np.minimum.reduceat(boxes, (np.cumsum(count) - count)[filled], axis=1)
    bin_boxes = bin_boxes.reshape(6, -1, BINS)
    before, behind = bin_boxes[..., :-1].copy(), bin_boxes[..., 1:].copy()
    for k in range(1, BINS - 1):
        np.minimum(before[..., k], before[..., k - 1], out=before[..., k])
        np.minimum(behind[..., -1 - k], behind[..., -k], out=behind[..., -1 - k])
    cuts = np.cumsum(count.reshape(-1, BINS), axis=1)[:, :-1]
    with np.errstate(invalid="ignore", over="ignore"):
        cost = area(before) * cuts + area(behind) * (size[:, None] - cuts)
    cost[~((cuts > 0) & (cuts < size[:, None]) & np.isfinite(cost))] = np.inf
    best = cost.argmin(axis=1)
    taken = cuts[nodes, best]
    parts = np.stack([before[:, nodes, best], behind[:, nodes, best]], axis=2)

    # All in one place, or too lopsided for the levels that remain: halve by count.
    halved = np.flatnonzero(~np.isfinite(cost[nodes, best]) | (2 * np.maximum(taken, size - taken) > most))
    if len(halved):
        taken[halved] = size[halved] // 2
        # Of three results in a row the last is of the gap behind a range; behind the last row there is none.
        edges = np.stack([start, start + taken, start + size], axis=1)[halved].ravel()
        inside = np.minimum.reduceat(boxes, edges[edges < len(rows)], axis=1)
        parts[:, halved, 0], parts[:, halved, 1] = inside[:, 0::3], inside[:, 1::3]
    return boxes, rows, taken, parts.reshape(6, -1)


def area(boxes: np.ndarray) -> np.ndarray:
    """Half the surface of boxes, (6, …) -> (…); not finite for an empty one."""
    x, y, z = -boxes[3] - boxes[0], -boxes[4] - boxes[1], -boxes[5] - boxes[2]
    return x * y + y * z + z * x


def flatten(forest: Forest, sphere_row: np.ndarray, is_sphere: np.ndarray) -> np.ndarray:
    """The nodes' texels, parents before children, a left child right behind its parent. A tree that is one leaf becomes
    a node that has it twice.

    sphere_row : (n,), how many spheres come before a row;  is_sphere : (n,)
    """
    inner = forest.left >= 0
    place = preorder(forest, inner)
    first, size = forest.first, forest.end - forest.first
    row = np.minimum(first, len(is_sphere) - 1)
    sphere = is_sphere[row]
    leaf = leaf_code(np.where(sphere, sphere_row[row], first - sphere_row[row]), size, sphere)
    child = np.where(inner, place, leaf)
    pairs = np.zeros((max(int(inner.sum()), 1), 2), np.int64)  # rows of the forest
    pairs[place[inner], 0], pairs[place[inner], 1] = forest.left[inner], forest.right[inner]
    return encode(forest.boxes[:3].T[pairs], -forest.boxes[3:].T[pairs], child[pairs])


def preorder(forest: Forest, inner: np.ndarray) -> np.ndarray:
    """(nodes,), each inner node's place: a tree's nodes lie together, whatever level they were made on."""
    levels = [np.array([0])] if inner[0] else []
    while levels and len(levels[-1]):
        parents = levels[-1]
        below = np.concatenate([forest.left[parents], forest.right[parents]])
        levels.append(below[inner[below]])
    weight = inner.astype(np.int64)
    for parents in reversed(levels):
        weight[parents] += weight[forest.left[parents]] + weight[forest.right[parents]]
    place = np.zeros(len(inner), np.int64)
    for parents in levels:
        place[forest.left[parents]] = place[parents] + 1
        place[forest.right[parents]] = place[parents] + 1 + weight[forest.left[parents]]
    return place
