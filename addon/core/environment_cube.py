"""The sky as a cube texture (Section 4.3), pure numpy: texel directions, equirectangular picture to cube, its mean.

The picture's convention is Cycles' own, with Z up:

    u = ½ − atan2(y, x) / 2π,    v = ½ + atan2(z, √(x² + y²)) / π

so that the picture's middle is +X, its left half is +Y, and its row 0 (the bottom) is −Z.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .strips import on_all_processors

FACES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")
SMALLEST, LARGEST = 16, 1024

# Table 3.11 of the OpenGL 3.3 specification, solved for the direction (x, y, z) at (sc, tc), both in [-1, 1].
_DIRECTION_AT: tuple[Callable, ...] = (
    lambda s, t: (np.ones_like(s), -t, -s),
    lambda s, t: (-np.ones_like(s), -t, s),
    lambda s, t: (s, np.ones_like(s), t),
    lambda s, t: (s, -np.ones_like(s), -t),
    lambda s, t: (s, -t, np.ones_like(s)),
    lambda s, t: (-s, -t, -np.ones_like(s)),
)


def face_directions(size: int) -> np.ndarray:
    """float64, (6, size, size, 3), unit, world space: where each texel's centre looks; axis 1 is t, axis 2 is s.

    Faces uploaded in this order and with these rows answer `texture(cube, d)` with the sky in the direction d.
    """
    return np.stack([_unit(_face(face, size, 0.5, 0.5)) for face in range(6)])


def face_size(image_width: int) -> int:
    """Texels of a side that keep an equirectangular picture's detail: the power of two ≥ width / 4, in [16, 1024]."""
    return min(max(1 << max(math.ceil(image_width / 4) - 1, 0).bit_length(), SMALLEST), LARGEST)


def equirect_to_cube(pixels: np.ndarray, size: int, environment_from_world: np.ndarray | None = None) -> np.ndarray:
    """An equirectangular picture as the six faces of a cube.

    pixels : float32, (height, width, 3 or more), radiance, row 0 at the bottom
    environment_from_world : (3, 3), or (3, 4) with a shift in the last column; takes a unit direction in world space to
                             one (of any length) in the picture's space. None: they are the same.
    returns : float32, (6, size, size, 3), radiance, in the order and orientation of face_directions

    Samples bilinearly, around the seam too; where a texel covers several pixels it is the mean of several samples.
    """
    matrix = np.eye(3, 4)
    if environment_from_world is not None:
        given = np.asarray(environment_from_world, np.float64)
        matrix[:, : given.shape[1]] = given
    rgb = _shrunk(np.ascontiguousarray(pixels[..., :3], np.float32), 4 * size)
    samples = max(1, math.ceil(rgb.shape[1] / (4 * size)))  # along each side of a texel
    offsets = (np.arange(samples) + 0.5) / samples
    faces = np.zeros((6, size, size, 3), np.float32)

    def fill(face: int) -> None:
        for s in offsets:
            for t in offsets:
                directions = _unit(_face(face, size, s, t)) @ matrix[:, :3].T + matrix[:, 3]
                faces[face] += sample_equirect(rgb, directions)

    on_all_processors(fill, range(6))
    return faces / np.float32(samples * samples)


def sample_equirect(pixels: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Bilinear look-up: (…, 3) directions of any length in the picture's space -> float32, (…, 3).

    Wraps in u; in v it stops at the poles' rows.
    """
    height, width, channels = pixels.shape
    x, y, z = np.moveaxis(np.asarray(directions, np.float32), -1, 0)
    u = 0.5 - np.arctan2(y, x) / np.float32(2.0 * np.pi)
    v = 0.5 + np.arctan2(z, np.hypot(x, y)) / np.float32(np.pi)
    column, row = u * width - 0.5, v * height - 0.5
    left, below = np.floor(column), np.floor(row)
    right_share, above_share = (column - left)[..., None], (row - below)[..., None]
    left = left.astype(np.int32) % width
    right = (left + 1) % width
    above = np.clip(below.astype(np.int64) + 1, 0, height - 1) * width
    below = np.clip(below.astype(np.int64), 0, height - 1) * width
    flat = pixels.reshape(-1, channels)

    def between(row):
        start = flat.take(row + left, axis=0)
        return start + (flat.take(row + right, axis=0) - start) * right_share

    lower = between(below)
    return lower + (between(above) - lower) * above_share


def mean_radiance(faces: np.ndarray) -> tuple[float, float, float]:
    """The mean over the sphere of faces, (6, size, size, 3): each texel weighted by the solid angle that it covers."""
    weights = solid_angles(faces.shape[1])
    return tuple(float(value) for value in np.einsum("fijc,ij->c", faces.astype(np.float64), weights) / (4.0 * np.pi))


def solid_angles(size: int) -> np.ndarray:
    """float64, (size, size), steradians: the exact solid angle of each texel of a face; a face has 4π/6.

    The corner integral Ω(x, y) = atan(x y / √(x² + y² + 1)), differenced at the texel's corners.
    """
    edge = np.linspace(-1.0, 1.0, size + 1)
    x, y = edge[None, :], edge[:, None]
    corner = np.arctan(x * y / np.sqrt(x * x + y * y + 1.0))
    return corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1]


def _shrunk(pixels: np.ndarray, width: int) -> np.ndarray:
    """The picture averaged over k × k pixels, k the least that divides it and brings it to the width; or itself."""
    least = math.ceil(pixels.shape[1] / width)
    for k in range(max(least, 2), 2 * least):
        if pixels.shape[0] % k == 0 and pixels.shape[1] % k == 0:
            return pixels.reshape(pixels.shape[0] // k, k, pixels.shape[1] // k, k, -1).mean(axis=(1, 3))
    return pixels


def _face(face: int, size: int, s_offset: float, t_offset: float) -> np.ndarray:
    """(size, size, 3): points on the unit cube's face, `offset` of a texel from the texel's lower corner."""
    s = (np.arange(size) + s_offset) * 2.0 / size - 1.0
    t = (np.arange(size) + t_offset) * 2.0 / size - 1.0
    return np.stack(_DIRECTION_AT[face](*np.meshgrid(s, t)), axis=-1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
