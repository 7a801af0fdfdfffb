"""Blender's camera -> core.scene.Camera: sensor fit, shift and pixel aspect become the edges of the picture."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.scene import Camera, SceneError

LARGEST_SIDE = 65536
KINDS = {"PERSP": "PERSPECTIVE", "ORTHO": "ORTHOGRAPHIC"}


def camera_problem(camera: bpy.types.Object | None) -> str | None:
    """Why this camera cannot be used; None where it can."""
    if camera is None:
        return "The scene has no camera. Add one with Add > Camera, or set Scene > Camera."
    if camera.type != "CAMERA":
        return f"'{camera.name}' is set as the scene's camera but is no camera. Set Scene > Camera to one."
    if camera.data.type not in KINDS:
        kind = {"PANO": "panoramic", "CUSTOM": "custom"}.get(camera.data.type, camera.data.type)
        return f"'{camera.name}' is a {kind} camera, but only perspective and orthographic work. Change its type."
    return None


def export_camera(
    camera: bpy.types.Object | None,
    render: bpy.types.RenderSettings,
    width: int,
    height: int,
    region: tuple[int, int, int, int] | None,
) -> tuple[Camera, list[str]]:
    """An evaluated camera object, and warnings. Raises SceneError where camera, size or region cannot be used.

    Scale and shear leave world_from_camera column by column, as in Blender: a mirrored camera keeps its mirror.
    """
    problem = camera_problem(camera) or size_problem(width, height, region)
    if problem:
        raise SceneError(problem)
    matrix = np.array(camera.matrix_world, np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.isfinite(matrix).all():
        raise SceneError(f"'{camera.name}': the camera's transform is not a number. Clear it, or mend its drivers.")
    if lengths.min() == 0.0:
        raise SceneError(f"'{camera.name}': the camera's transform has no direction (scale zero). Clear its scale.")
    matrix[:3, :3] /= lengths
    window = camera_window(camera.data, width, height, render.pixel_aspect_x, render.pixel_aspect_y)
    left, right, bottom, top = window
    if not (np.isfinite(window).all() and left < right and bottom < top):
        raise SceneError(
            f"'{camera.name}': the picture's edges are {left:g} … {right:g} and {bottom:g} … {top:g}, "
            "which shows nothing. Change the camera's lens, size or shift."
        )
    warnings = []
    if camera.data.dof.use_dof:
        warnings.append(f"'{camera.name}': depth of field is not shown.")
    return Camera(matrix, window, width, height, KINDS[camera.data.type], region), warnings


def size_problem(width: int, height: int, region: tuple[int, int, int, int] | None = None) -> str | None:
    """Why a picture of this size, or this part of it, cannot be rendered; None where it can."""
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        return (
            f"The picture is {width} × {height} pixels, but each side must lie in 1..{LARGEST_SIDE}. "
            "Change Output > Resolution."
        )
    if region is not None:
        x0, y0, x1, y1 = region
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            return f"The region {region} is empty or leaves the picture of {width} × {height} pixels. Change it."
    return None


def camera_window(
    data: bpy.types.Camera, width: int, height: int, aspect_x: float, aspect_y: float
) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) of the whole picture at distance 1 (perspective) or in metres (orthographic).

    The sensor (or the orthographic scale) spans the fitted side; AUTO fits the longer one, with the sensor's width.
    Shift is in units of the fitted side.
    """
    # In pixel widths, so that a tall pixel counts more than one.
    across, up = float(width), height * aspect_y / aspect_x
    vertical = data.sensor_fit == "VERTICAL" or (data.sensor_fit == "AUTO" and across < up)
    fitted = up if vertical else across
    if data.type == "ORTHO":
        size = data.ortho_scale
    else:
        size = (data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width) / data.lens
    pixel = size / fitted
    left = (-0.5 * across + data.shift_x * fitted) * pixel
    bottom = (-0.5 * up + data.shift_y * fitted) * pixel
    return left, left + across * pixel, bottom, bottom + up * pixel
