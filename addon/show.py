"""Bring an image before the user's eyes, as Blender does with its Render Result."""

from __future__ import annotations

import bpy


def show_image(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """In an Image Editor that is open; otherwise in a new window, unless the preferences say that renders open none."""
    spaces = [
        area.spaces.active
        for window in context.window_manager.windows
        for area in window.screen.areas
        if area.type == "IMAGE_EDITOR" and area.spaces.active.mode == "VIEW"
    ]
    if spaces:
        min(spaces, key=lambda space: _rank(space.image, image)).image = image
        return
    if context.preferences.view.render_display_type == "NONE":
        return
    known = set(context.window_manager.windows)
    bpy.ops.wm.window_new()
    for window in set(context.window_manager.windows) - known:
        area = window.screen.areas[0]
        area.type = "IMAGE_EDITOR"
        area.spaces.active.image = image


def _rank(shown: bpy.types.Image | None, image: bpy.types.Image) -> int:
    """Best is the editor that shows the image already, then one that shows a render or nothing, then any."""
    if shown == image:
        return 0
    return 1 if shown is None or shown.type == "RENDER_RESULT" else 2
