"""Frame -> Blender's images and Render Result passes. Row 0 is the bottom on both sides: nothing is flipped."""

from __future__ import annotations

import bpy
import numpy as np

from .core.frame import Frame
from .status_colors import colored, legend

IMAGE_NAME = "Nonlinear Rays"
COLORED_NAME = f"{IMAGE_NAME} Status Colours"
LEGEND_NAME = f"{IMAGE_NAME} Status Legend"


def scene_linear() -> str:
    """Name of the colour space that the renderer works in: the file's working space where Blender has one (5.0)."""
    colorspace = getattr(bpy.data, "colorspace", None)
    return getattr(colorspace, "working_space", "Linear Rec.709")


def image_name(pass_name: str) -> str:
    """The image that shows a pass: "Nonlinear Rays" is Combined."""
    return IMAGE_NAME if pass_name == "Combined" else f"{IMAGE_NAME} {pass_name}"


def to_rgba(pixels: np.ndarray) -> np.ndarray:
    """float32, (height, width, 1, 3 or 4) -> float32, (height, width, 4): grey or colour, alpha 1 if there is none."""
    height, width, channels = pixels.shape
    if channels == 4:
        return np.ascontiguousarray(pixels, np.float32)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels
    return rgba


def write_image(name: str, pixels: np.ndarray, *, is_data: bool = False) -> bpy.types.Image:
    """Put pixels into the float image of that name: the same datablock each time, whatever became of it.

    pixels : float32, (height, width, channels), scene-linear; is_data : numbers, not colours
    """
    height, width, _channels = pixels.shape
    image = bpy.data.images.get((name, None))  # None: of this file, not linked from another
    if image is None:
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
    if image.source != "GENERATED" or not image.is_float:  # saved to disk, or replaced by another picture
        if image.packed_file:
            image.unpack(method="REMOVE")
        image.source = "GENERATED"
        image.use_generated_float = True
    if tuple(image.size) != (width, height):
        image.generated_width, image.generated_height = width, height
        if tuple(image.size) != (width, height):
            image.scale(width, height)
    if is_data:
        image.colorspace_settings.is_data = True
    else:
        image.colorspace_settings.name = scene_linear()
        image.use_view_as_render = True
    image.pixels.foreach_set(to_rgba(pixels).ravel())
    image.update()
    return image


def show_frame(frame: Frame) -> bpy.types.Image:
    """Every pass as an image, and Status in colours too; returns that of Combined."""
    images = [
        write_image(image_name(name), pixels, is_data=name != "Combined") for name, pixels in frame.passes.items()
    ]
    if "Status" in frame.passes:
        write_image(COLORED_NAME, colored(frame.passes["Status"]), is_data=True)
    return images[list(frame.passes).index("Combined")]


def show_legend() -> bpy.types.Image:
    """What the colours of the image "Nonlinear Rays Status Colours" mean."""
    return write_image(LEGEND_NAME, legend(), is_data=True)


def write_result(result: bpy.types.RenderResult, frame: Frame) -> None:
    """Fill the passes of a RenderEngine's result that the frame has."""
    passes = result.layers[0].passes
    for name, pixels in frame.passes.items():
        target = passes.get(name)
        if target is not None:
            target.rect.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())


def save_png(frame: Frame, path: str, scene: bpy.types.Scene) -> None:
    """Combined as a PNG with the scene's view transform. Raises OSError where it cannot be written."""
    width, height = frame.size
    image = bpy.data.images.new("Nonlinear Rays (saving)", width, height, alpha=True, float_buffer=True)
    settings = scene.render.image_settings
    names = [name for name in ("media_type", "file_format", "color_mode", "color_depth") if hasattr(settings, name)]
    before = [(name, getattr(settings, name)) for name in names]
    try:
        image.pixels.foreach_set(np.ascontiguousarray(frame.passes["Combined"], np.float32).ravel())
        image.update()
        if "media_type" in names:
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_mode = "PNG", "RGBA" if scene.render.film_transparent else "RGB"
        settings.color_depth = "8"
        image.save_render(path, scene=scene)
    except RuntimeError as error:
        raise OSError(f"Cannot write '{path}': {str(error).strip()}. Choose another folder.") from error
    finally:
        for name, value in before:
            setattr(settings, name, value)
        bpy.data.images.remove(image)
