"""What belongs to the machine and not to the .blend."""

import bpy
from bpy.props import IntProperty

from .. import __package__ as base_package
from .core import trace
from .job import Button

MEBIBYTE = 1 << 20


def apply_memory_limit(preferences, _context=None) -> None:
    """Hand the limit to the renderer."""
    trace.memory_limit_bytes = preferences.memory_limit * MEBIBYTE


class NONLINEAR_RAYS_preferences(bpy.types.AddonPreferences):
    bl_idname = base_package

    memory_limit: IntProperty(
        name="Memory Limit",
        description="What a frame may take in arrays and textures; a larger one is refused before it starts. Unit: MiB",
        default=trace.memory_limit_bytes // MEBIBYTE,
        min=64,
        soft_max=65536,
        step=256,
        update=apply_memory_limit,
    )

    def draw(self, _context):
        column = self.layout.column()
        column.use_property_split = True
        column.prop(self, "memory_limit")
        device = Button.last.statistics.device if Button.last else ""
        column.label(text=f"Device: {device or 'shown after the first press of Render'}")


def stored() -> NONLINEAR_RAYS_preferences | None:
    """The preferences; None where the extension is registered without being enabled, as some tests do."""
    addon = bpy.context.preferences.addons.get(base_package)
    return addon.preferences if addon else None


def register():
    bpy.utils.register_class(NONLINEAR_RAYS_preferences)
    if preferences := stored():
        apply_memory_limit(preferences)


def unregister():
    bpy.utils.unregister_class(NONLINEAR_RAYS_preferences)
