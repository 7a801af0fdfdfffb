"""Nodes of the tree of boxes -> texels, two a node, as intersection/tree.glsl reads them: a read of a texel is what a
step down the tree takes most of its time for.

    corner x, y, z of the node, and the size of its cells along each axis | child 0
    for each axis: low 0, high 0, low 1, high 1 of both children's boxes  | child 1

A child's box is given in cells of its node, eight bits a side, and never smaller than it is. The corner is a float32
whose last eight bits give way to the cells' size, an exponent of 2. A child is a node's number where it is not
negative, and a leaf otherwise: leaf_code().
"""

from __future__ import annotations

import numpy as np

CELLS = 254  # that a node is divided into, at least half of them used; one more is for rounding
LAST_BITS = np.uint32(0xFF)


def leaf_code(row: np.ndarray, count: np.ndarray, is_sphere: np.ndarray) -> np.ndarray:
    """A leaf of 1 to 4 triangles, or of spheres, from `row` on, below 2^24. int64"""
    return -2 - (((row << 2) + count - 1) * 2 + is_sphere)


def encode(low: np.ndarray, high: np.ndarray, children: np.ndarray) -> np.ndarray:
    """low, high : float32, (n, 2, 3), corners of both children's boxes;  children : int, (n, 2)
    -> uint32, (n, 2, 4)
    """
    corner = rounded_down(low.min(axis=1))
    extent = high.max(axis=1).astype(np.float64) - corner
    exponent = np.clip(np.ceil(np.log2(np.maximum(extent, 1e-300) / CELLS)), -126, 127).astype(np.int32)
    cell = np.ldexp(np.float32(1.0), exponent)[:, None]
    origin = corner[:, None]
    first = np.floor((low.astype(np.float64) - origin) / cell)
    last = np.ceil((high.astype(np.float64) - origin) / cell)
    # The shader's sum may round into the box.
    first -= origin + cell * first.astype(np.float32) > low
    last += origin + cell * last.astype(np.float32) < high
    sides = np.stack([first[:, 0], last[:, 0], first[:, 1], last[:, 1]], axis=-1)
    nodes = np.empty((len(low), 2, 4), np.uint32)
    nodes[:, 0, :3] = corner.view(np.uint32) | (exponent + 127).astype(np.uint32)
    nodes[:, 1, :3] = np.clip(sides, 0, 255).astype(np.uint8).view(np.uint32)[..., 0]
    nodes[:, :, 3] = children.astype(np.int32).view(np.uint32)
    return nodes


def rounded_down(values: np.ndarray) -> np.ndarray:
    """float32 -> the nearest float32 that is not above it and whose last eight bits are zero."""
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    cut = bits & ~LAST_BITS
    return np.where((values < 0) & (cut != bits), cut + np.uint32(0x100), cut).astype(np.uint32).view(np.float32)
