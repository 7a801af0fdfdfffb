"""Where the rays of a pixel lie, and which pixels need more of them than the others."""

from __future__ import annotations

from functools import cache

import numpy as np

from .status import Status

PLASTIC = 1.32471795724474602596
BLACKMAN_HARRIS = (0.35875, 0.48829, 0.14128, 0.01168)
TABLE_SIZE = 4097
LARGEST_TURN = 0.1  # radians between final directions: more, and the picture between them is anything but straight
LARGEST_BEND = 0.9  # cosine between normals
STEEPEST = 0.5  # sine of the way from hit to hit against the surface: more, and one object is before the other


def sample_offset(sample: int, filter_width: float) -> tuple[float, float]:
    """Where a sample lies, pixels from its pixel's centre: the R2 sequence (Roberts 2018), drawn towards the centre by
    the filter, so that the mean of all samples is filtered. The first one is the centre itself.
    """
    u, v = (0.5 + sample / PLASTIC) % 1.0, (0.5 + sample / PLASTIC**2) % 1.0
    places, shares = _inverted_filter()
    return tuple(2.0 * filter_width * float(np.interp(share, shares, places)) for share in (u, v))


@cache
def _inverted_filter() -> tuple[np.ndarray, np.ndarray]:
    """Places in [-1/2, 1/2], and the share of Blackman and Harris' window that lies below each. As in Cycles, the
    window is twice as wide as the filter's width says.
    """
    places = np.linspace(-0.5, 0.5, TABLE_SIZE)
    terms = [a / (2 * np.pi * k) * np.sin(2 * np.pi * k * places) for k, a in enumerate(BLACKMAN_HARRIS) if k]
    return places, 0.5 + places + sum(terms) / BLACKMAN_HARRIS[0]


class EdgeFinder:
    """Finds the pixels at edges: silhouettes, and photon rings, where light goes anywhere. Told of one tile after the
    other as they are traced, row by row; of what it was told it keeps one row of pixels and one column.

    mask : bool, (rows, columns), pixels whose ray ended otherwise than a neighbour's
    """

    def __init__(self, columns: int, rows: int):
        self.mask = np.zeros((rows, columns), bool)
        self._top = np.zeros((columns, 11), np.float32)
        self._right = np.zeros((0, 11), np.float32)

    def add(self, x: int, y: int, position: np.ndarray, velocity: np.ndarray, surface: np.ndarray | None) -> None:
        """A tile, its corner at column x and row y; arrays as TileEnds has them."""
        rows, columns = velocity.shape[:2]
        ends = np.zeros((rows, columns, 11), np.float32)  # position, direction, status, normal, object index
        ends[..., :3], ends[..., 3:7] = position[..., :3], velocity
        if surface is not None:
            ends[..., 7:] = surface
        mask = self.mask[y : y + rows, x : x + columns]
        across = _differ(ends[:, :-1], ends[:, 1:])
        mask[:, :-1] |= across
        mask[:, 1:] |= across
        along = _differ(ends[:-1], ends[1:])
        mask[:-1] |= along
        mask[1:] |= along
        if x > 0:
            across = _differ(self._right, ends[:, 0])
            mask[:, 0] |= across
            self.mask[y : y + rows, x - 1] |= across
        if y > 0:
            along = _differ(self._top[x : x + columns], ends[0])
            mask[0] |= along
            self.mask[y - 1, x : x + columns] |= along
        self._right, self._top[x : x + columns] = ends[:, -1], ends[-1]

    def quads(self) -> np.ndarray:
        """float32, (n, 2): column and row of the lower left pixel of every 2 x 2 quad that needs more samples, since
        the filter of one of its pixels reaches an edge.
        """
        rows, columns = self.mask.shape
        reached = np.zeros((rows + 2 + rows % 2, columns + 2 + columns % 2), bool)
        for row in range(3):
            for column in range(3):
                reached[row : row + rows, column : column + columns] |= self.mask
        reached = reached[1:-1, 1:-1]
        needed = reached[0::2, 0::2] | reached[0::2, 1::2] | reached[1::2, 0::2] | reached[1::2, 1::2]
        return 2.0 * np.argwhere(needed)[:, ::-1].astype(np.float32)


def _differ(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(…, 11), neighbours -> (…), bool: whether there is an edge between them."""
    status = a[..., 6]
    differ = (status != b[..., 6]) | (a[..., 10] != b[..., 10])
    turned = ((a[..., 3:6] - b[..., 3:6]) ** 2).sum(axis=-1) > LARGEST_TURN**2
    differ |= turned & (status != Status.ABSORBED)
    way = b[..., :3] - a[..., :3]
    off = np.maximum(abs((way * a[..., 7:10]).sum(axis=-1)), abs((way * b[..., 7:10]).sum(axis=-1)))
    jump = off**2 > STEEPEST**2 * (way**2).sum(axis=-1)
    bent = (a[..., 7:10] * b[..., 7:10]).sum(axis=-1) < LARGEST_BEND
    return differ | ((jump | bent) & (status == Status.HIT))
