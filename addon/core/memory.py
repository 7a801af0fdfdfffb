"""What a frame takes in memory: the picture, the tile that is being traced, and the scene's textures."""

from __future__ import annotations

from .pipelines.fused import LARGEST_TILE
from .scene import Scene
from .settings import PASS_CHANNELS, Settings
from .textures import Packed

TILE = 256  # of the paper's pipeline, pixels a side: small enough for short draws, large enough to keep a GPU busy
TILE_BYTES = 16 * 28  # a pixel of a tile: at most 28 times 4 floats, on the device, read back, or on their way
EDGE_BYTES = 10  # a pixel of a picture whose edges are refined: masks, and the list of quads where all are edges


def picture_bytes(size: tuple[int, int], settings: Settings) -> int:
    """The passes, and what finds their edges. size : columns, rows"""
    pixel = 4 * sum(len(PASS_CHANNELS[name]) for name in settings.passes)
    return size[0] * size[1] * (pixel + (EDGE_BYTES if settings.refines_edges else 0))


def tile_bytes(size: tuple[int, int], settings: Settings) -> int:
    """The largest tile, however large the picture is."""
    side = LARGEST_TILE if settings.pipeline == "fused" else TILE
    return TILE_BYTES * min(side, size[0]) * min(side, size[1])


def texture_bytes(scene: Scene, settings: Settings, packed: Packed) -> int:
    """Objects, images, skies and the model's own, each twice: as an array and on the device."""
    model = sum(data.nbytes for data in scene.model.textures().values())
    return 2 * (packed.bytes + model) + sky_bytes(scene, settings)


def sky_bytes(scene: Scene, settings: Settings) -> int:
    """The faces that the picture shows, as arrays and on the device; there with coarser levels where it filters."""
    if "Combined" not in settings.passes:
        return 0
    skies = [scene.environment, scene.far_environment if scene.model.has_far_side else None]
    faces = sum(sky.faces.nbytes for sky in skies if sky is not None and sky.faces is not None)
    return faces + (faces * 4 // 3 if settings.filters_textures else faces)


def frame_bytes(scene: Scene, settings: Settings, packed: Packed) -> int:
    """All that render() takes at once, beside the scene that it is given."""
    size = scene.camera.size
    return picture_bytes(size, settings) + tile_bytes(size, settings) + texture_bytes(scene, settings, packed)
