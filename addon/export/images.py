"""Blender images -> scene-linear float32 pixels.

What `Image.pixels` holds, tried on 4.5 and 5.2: a byte image's values are as stored in the file, in the image's own
colour space and with straight alpha; a float image's values (EXR, HDR, and 16-bit PNG too) are scene-linear already,
and premultiplied unless the alpha is "Channel Packed" or "None".
"""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING

import bpy
import mathutils
import numpy as np

from ..core.scene import EXTENSIONS, Image

if TYPE_CHECKING:
    from bpy.types import ShaderNodeTexImage

_AS_STORED = ("Non-Color", "Raw", "scene_linear")
# Colour space -> the conversion to scene-linear that mathutils.Color has for it (some in newer versions only).
_LINEAR = {
    "Linear Rec.709": "from_rec709_linear_to_scene_linear",
    "Linear Rec.2020": "from_rec2020_linear_to_scene_linear",
    "Linear CIE-XYZ D65": "from_xyz_d65_to_scene_linear",
    "ACES2065-1": "from_aces_to_scene_linear",
    "ACEScg": "from_acescg_to_scene_linear",
}


def missing(image: bpy.types.Image) -> str | None:
    """Why an image has no pixels, without loading it (for the panel); None where it seems to have some."""
    if image.source in {"FILE", "MOVIE"} and not image.packed_file:
        path = bpy.path.abspath(image.filepath, library=image.library)
        if not os.path.isfile(path):
            return f"'{image.name}' has no file at '{image.filepath}'"
    return None


def scene_linear(image: bpy.types.Image, *, times_alpha: bool = False) -> tuple[np.ndarray | None, list[str]]:
    """float32, (height, width, 4), scene-linear, straight alpha, row 0 at the bottom; and warnings.

    times_alpha : the colours are multiplied by alpha, unless the image's alpha is no cover of its colours
    None instead of pixels where the image has none: its file is missing, or cannot be read.
    """
    image = image.original
    stored = _stored(image)
    if stored is None:
        return None, []
    pixels = _four_channels(stored)
    warnings = []
    if image.source in {"TILED", "SEQUENCE", "MOVIE"}:
        part = "first tile" if image.source == "TILED" else "current frame"
        warnings.append(f"Image '{image.name}' is of the kind {image.source.lower()}: only its {part} is used.")
    covers = image.alpha_mode in {"STRAIGHT", "PREMUL"}
    if image.is_float:
        if covers and not times_alpha:
            _unpremultiply(pixels)
    else:
        warnings += _linearise(pixels[..., :3], image)
        if covers and times_alpha and not image.colorspace_settings.is_data:
            pixels[..., :3] *= pixels[..., 3:]
    if image.alpha_mode == "NONE":
        pixels[..., 3] = 1.0
    unusable = ~np.isfinite(pixels).all(axis=2)
    if unusable.any():
        pixels[unusable] = 0.0
        warnings.append(
            f"Image '{image.name}': {unusable.sum()} of {unusable.size} pixels are not finite and were made black."
        )
    return pixels, warnings


def fingerprint(image: bpy.types.Image) -> tuple | None:
    """All that scene_linear() depends on, the pixels as a digest. None where there are none."""
    image = image.original
    stored = _stored(image)
    if stored is None:
        return None
    space = image.colorspace_settings
    ways = (image.name, image.source, image.alpha_mode, image.is_float, space.name, space.is_data)
    linear = _matrix(mathutils.Color.from_rec709_linear_to_scene_linear)  # a .blend may choose it
    return (*ways, linear.tobytes(), stored.shape, hashlib.blake2b(stored).digest())


def _stored(image: bpy.types.Image) -> np.ndarray | None:
    """float32, (height, width, channels), what `Image.pixels` holds; None where there is nothing to be read."""
    width, height = image.size
    if width == 0 or height == 0 or image.channels == 0:
        return None
    flat = np.empty(width * height * image.channels, np.float32)
    try:
        image.pixels.foreach_get(flat)
    except (RuntimeError, TypeError):  # the buffer vanished, or is not of the size that was promised
        return None
    return flat.reshape(height, width, image.channels)


def srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """The transfer function of IEC 61966-2-1, float32 in [0, 1] -> float32."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


class ImageTable:
    """The images of one export: each pair of image and way of sampling once, in the order of first use.

    Where nothing uses a node's Alpha, its Color is multiplied by it, as in Cycles and EEVEE: transparent parts of a
    picture are black, whatever colour is stored there.
    """

    def __init__(self, *, read_pixels: bool = True):
        """read_pixels=False: only look whether the files are there (the panel's check)."""
        self.read_pixels = read_pixels
        self.images: list[Image] = []
        self.warnings: list[str] = []
        self._indices: dict[tuple, int | None] = {}
        self._pixels: dict[tuple, np.ndarray | None] = {}

    def add(self, node: ShaderNodeTexImage) -> int | None:
        """The index of the node's image; None where it is missing (node.image is not None)."""
        extension = node.extension if node.extension in EXTENSIONS else "REPEAT"
        interpolation = "CLOSEST" if node.interpolation == "Closest" else "LINEAR"
        image = node.image.original
        times_alpha = not node.outputs["Alpha"].is_linked
        key = (image.session_uid, extension, interpolation, times_alpha)
        if key not in self._indices:
            self._indices[key] = self._add(image, extension, interpolation, times_alpha)
        return self._indices[key]

    def _add(self, image: bpy.types.Image, extension: str, interpolation: str, times_alpha: bool) -> int | None:
        pixels = self._read(image, times_alpha)
        if pixels is None:
            return None
        self.images.append(Image(image.name, pixels, extension, interpolation))
        return len(self.images) - 1

    def _read(self, image: bpy.types.Image, times_alpha: bool) -> np.ndarray | None:
        if not self.read_pixels:
            return None if missing(image) else np.zeros((1, 1, 4), np.float32)
        key = (image.session_uid, times_alpha)
        if key not in self._pixels:
            pixels, warnings = scene_linear(image, times_alpha=times_alpha)
            self._pixels[key] = pixels
            self.warnings += warnings
        return self._pixels[key]


def _four_channels(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 1 … 4) -> (h, w, 4): grey is repeated, a missing alpha is 1."""
    channels = pixels.shape[2]
    if channels == 4:
        return pixels
    result = np.ones((*pixels.shape[:2], 4), np.float32)
    result[..., :3] = pixels[..., :3] if channels == 3 else pixels[..., :1]
    if channels == 2:
        result[..., 3] = pixels[..., 1]
    return result


def _unpremultiply(pixels: np.ndarray) -> None:
    """In place. A pixel of alpha 0 keeps its colour: it is light without cover."""
    alpha = pixels[..., 3:]
    np.divide(pixels[..., :3], alpha, out=pixels[..., :3], where=(alpha != 0) & (alpha != 1))


def _linearise(colors: np.ndarray, image: bpy.types.Image) -> list[str]:
    """Byte values in the image's colour space -> scene-linear, in place; a warning where the space is not known."""
    space = image.colorspace_settings.name
    if image.colorspace_settings.is_data or space in _AS_STORED:
        return []
    conversion = getattr(mathutils.Color, _LINEAR.get(space, ""), None)
    if conversion is not None:
        colors[:] = colors @ _matrix(conversion).T
        return []
    table = srgb_to_linear(np.arange(256, dtype=np.float32) / 255.0)
    linear = table[np.clip(np.rint(colors * 255.0), 0, 255).astype(np.uint8)]
    colors[:] = linear @ _matrix(mathutils.Color.from_rec709_linear_to_scene_linear).T
    if space == "sRGB":
        return []
    return [
        f"Image '{image.name}': its colour space '{space}' is not known and is read as sRGB. Choose sRGB or linear."
    ]


def _matrix(conversion) -> np.ndarray:
    """(3, 3) float32: a linear conversion of mathutils.Color, read off its three primaries."""
    primaries = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    matrix = np.array([tuple(conversion(mathutils.Color(primary))) for primary in primaries], np.float32).T
    # Rec. 709 is scene-linear in Blender's own configuration: leave no rounding in it.
    return np.eye(3, dtype=np.float32) if np.allclose(matrix, np.eye(3), atol=1e-5) else matrix
