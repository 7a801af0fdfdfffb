"""Bake World: one Cycles render of any world into an equirectangular picture that the exporter understands."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
from collections.abc import Iterator

import bpy
import numpy as np

from ..core.scene import SceneError

SAMPLES = 4  # spread over the pixel; a world has no noise of its own


def bake_world(
    context_or_scene: bpy.types.Context | bpy.types.Scene, world: bpy.types.World, resolution: int = 1024
) -> bpy.types.Image:
    """A new float image, 2 resolution × resolution pixels, scene-linear, packed, showing `world` as Cycles does.

    Its orientation is that of an Environment Texture without Mapping: the middle is +X, the left half +Y.
    Renders on the CPU in a scene of its own, which is gone afterwards; the caller decides where the image is used.
    Raises SceneError where Cycles is not enabled or does not deliver.
    """
    scene = getattr(context_or_scene, "scene", context_or_scene)
    with tempfile.TemporaryDirectory(prefix="nonlinear_rays_") as folder:
        path = os.path.join(folder, "world.exr")
        with _baking_scene(scene, world, resolution) as baking:
            baking.render.filepath = path
            bpy.ops.render.render(write_still=True, scene=baking.name)
        if not os.path.isfile(path):
            raise SceneError(
                f"World '{world.name}' could not be baked: Cycles wrote no picture. See the console for its reason."
            )
        pixels = _read(path)
    return _packed_image(f"{world.name} baked", pixels)


@contextlib.contextmanager
def _baking_scene(scene: bpy.types.Scene, world: bpy.types.World, resolution: int) -> Iterator[bpy.types.Scene]:
    """A scene with nothing but the world and a panoramic camera at the origin; removed on the way out."""
    baking = bpy.data.scenes.new("Nonlinear Rays Bake")
    data = bpy.data.cameras.new("Nonlinear Rays Bake")
    camera = bpy.data.objects.new("Nonlinear Rays Bake", data)
    try:
        if not hasattr(baking, "cycles"):
            raise SceneError("Bake World needs Cycles. Enable Cycles Render Engine in Preferences > Add-ons.")
        baking.collection.objects.link(camera)
        baking.camera, baking.world = camera, world
        baking.frame_current = scene.frame_current
        # Looking along +X with Z up puts +X in the middle and +Y on the left.
        camera.rotation_euler = (math.pi / 2.0, 0.0, -math.pi / 2.0)
        data.type = "PANO"
        settings = data if hasattr(data, "panorama_type") else data.cycles
        settings.panorama_type = "EQUIRECTANGULAR"
        _set_up_render(baking, resolution)
        yield baking
    finally:
        bpy.data.scenes.remove(baking)
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(data)


def _set_up_render(baking: bpy.types.Scene, resolution: int) -> None:
    render, cycles = baking.render, baking.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 2 * resolution, resolution, 100
    render.use_border = render.use_compositing = render.use_sequencer = render.film_transparent = False
    output = render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "IMAGE"
    output.file_format, output.color_mode, output.color_depth = "OPEN_EXR", "RGB", "32"
    cycles.device = "CPU"
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = SAMPLES, False, False
    cycles.film_exposure, cycles.pixel_filter_type = 1.0, "BOX"
    cycles.sample_clamp_direct = 0.0


def _read(path: str) -> np.ndarray:
    """float32, flat RGBA, the values that are in the file: scene-linear."""
    loaded = bpy.data.images.load(path, check_existing=False)
    try:
        # What is written is scene-linear already, whatever the configuration's default for EXR is.
        loaded.colorspace_settings.is_data = True
        pixels = np.empty(loaded.size[0] * loaded.size[1] * loaded.channels, np.float32)
        loaded.pixels.foreach_get(pixels)
        channels = loaded.channels
        size = tuple(loaded.size)
    finally:
        bpy.data.images.remove(loaded)
    result = np.ones((size[1], size[0], 4), np.float32)
    result[..., :3] = pixels.reshape(size[1], size[0], channels)[..., :3]
    return result


def _packed_image(name: str, pixels: np.ndarray) -> bpy.types.Image:
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image
