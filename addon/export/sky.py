"""An equirectangular image -> a cube of faces. The last ones are kept: they take seconds, and the next frame of an
animation or of the viewport mostly has the same sky.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.environment_cube import equirect_to_cube, face_size, mean_radiance
from .images import fingerprint, scene_linear

KEPT = 2  # a near and a far side; 72 MiB each at the most


@dataclass(frozen=True, eq=False)
class Sky:
    """faces : float32, (6, size, size, 3), radiance, not to be written to;  mean : over the sphere"""

    faces: np.ndarray
    mean: tuple[float, float, float]
    warnings: tuple[str, ...]


_kept: dict[tuple, Sky] = {}  # the last one that was asked for at the end
_lock = threading.Lock()  # F12 exports in a thread of its own, beside the viewport


def image_sky(image: bpy.types.Image, environment_from_world: np.ndarray | None) -> Sky | None:
    """None where the image cannot be read. environment_from_world : (3, 4), see equirect_to_cube."""
    found = fingerprint(image)
    if found is None:
        return None
    key = (*found, None if environment_from_world is None else environment_from_world.tobytes())
    with _lock:
        sky = _kept.pop(key, None) or _made(image, environment_from_world)
        _kept[key] = sky
        while len(_kept) > KEPT:
            _kept.pop(next(iter(_kept)))
    return sky


def _made(image: bpy.types.Image, environment_from_world: np.ndarray | None) -> Sky:
    # An environment has no cover: Cycles shows the light of a half transparent pixel times its alpha.
    pixels, warnings = scene_linear(image, times_alpha=True)
    faces = equirect_to_cube(pixels, face_size(pixels.shape[1]), environment_from_world)
    faces.flags.writeable = False
    return Sky(faces, mean_radiance(faces), tuple(warnings))
