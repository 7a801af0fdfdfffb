"""The render engine: F12, animations and the viewport."""

from __future__ import annotations

import bpy

from . import capture, image
from .core import trace
from .core.settings import PASS_CHANNELS
from .core.status import advice
from .job import Button, Clock, LastRender
from .properties import OPTIONAL_PASSES, pass_property
from .viewport import Viewport

ENGINE = capture.ENGINE

# Blender's panels that suit the engine beside those which every engine has: node materials, lights and worlds.
MORE_PANELS = {
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "DATA_PT_EEVEE_light",
    "NODE_DATA_PT_EEVEE_light",
}
# Those which every engine has, but that mean nothing here or come a second time.
LEFT_OUT_PANELS = {
    "DATA_PT_light",
    "NODE_DATA_PT_light",
    "DATA_PT_preview",
    "RENDER_PT_gpencil",
    "RENDER_PT_freestyle",
    "MATERIAL_PT_freestyle_line",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
}


class NonlinearRaysEngine(bpy.types.RenderEngine):
    bl_idname = ENGINE
    bl_label = "Nonlinear Rays"
    bl_use_preview = False
    bl_use_gpu_context = False
    bl_use_shading_nodes_custom = False  # Blender's own shader nodes are read
    bl_use_eevee_viewport = True  # Material Preview

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self._viewport = None

    def render(self, depsgraph):
        """One view layer of one frame. Errors are reported: an exception would write an empty picture."""
        try:
            if not capture.take(depsgraph, self.frame_set):
                self._render(depsgraph)
        except trace.Cancelled:
            return  # _render has ended its result as a cancelled one
        except Exception as error:
            self.report({"ERROR"}, f"Nonlinear Rays: {error}")

    def _render(self, depsgraph) -> None:
        render = depsgraph.scene_eval.render
        self.update_stats("", "Nonlinear Rays: reading the scene")
        scene, settings = capture.export(depsgraph, region=capture.border_region(render), frame_set=self.frame_set)
        width, height = scene.camera.size
        result = self.begin_result(0, 0, width, height, layer=depsgraph.view_layer_eval.name)
        clock = Clock()

        def progress(fraction: float, _sentence: str) -> None:
            self.update_progress(fraction)
            self.update_stats("", f"Nonlinear Rays: {clock.text(fraction)}")

        try:
            frame = trace.render(scene, settings, progress=progress, cancelled=self.test_break)
            image.write_result(result, frame)
        except BaseException:
            self.end_result(result, cancel=True)
            raise
        self.end_result(result)
        Button.last = LastRender(frame.statistics, frame.warnings)
        warnings = [*frame.warnings, *advice(frame.statistics.rays, settings.step_limit)]
        if warnings:
            self.report({"WARNING"}, f"Nonlinear Rays: {' '.join(warnings)}")

    def update_render_passes(self, scene=None, renderlayer=None):
        """Combined and the passes that are switched on."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        kinds = {"V": "VALUE", "X": "VALUE", "XYZ": "VECTOR"}
        for name in OPTIONAL_PASSES:
            if getattr(scene.nonlinear_rays, pass_property(name)):
                letters = PASS_CHANNELS[name]
                self.register_pass(scene, renderlayer, name, len(letters), letters, kinds[letters])

    def view_update(self, context, depsgraph):
        """The scene has changed."""
        if self._viewport is None:
            self._viewport = Viewport(self)
        self._viewport.changed(context, depsgraph)

    def view_draw(self, context, depsgraph):
        """Draw the last picture; begin another where the view has changed."""
        if self._viewport is None:
            self._viewport = Viewport(self)
        self._viewport.draw(context, depsgraph)

    def __del__(self):
        try:
            viewport = self._viewport
        except (AttributeError, ReferenceError):  # Blender has freed the engine before: it is quitting
            return
        if viewport is not None:
            viewport.stop()
        parent = getattr(super(), "__del__", None)
        if parent is not None:
            parent()


def suitable_panels() -> list[type[bpy.types.Panel]]:
    """Blender's own panels that are shown for this engine too."""
    panels = []
    for panel in _subclasses(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", ())
        name = panel.__name__
        everywhere = "BLENDER_RENDER" in engines and name not in LEFT_OUT_PANELS and "freestyle" not in name
        if isinstance(engines, set) and (everywhere or name in MORE_PANELS):
            panels.append(panel)
    return panels


def _subclasses(cls: type):
    for sub in cls.__subclasses__():
        yield sub
        yield from _subclasses(sub)


def register():
    bpy.utils.register_class(NonlinearRaysEngine)
    for panel in suitable_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister():
    for panel in suitable_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    bpy.utils.unregister_class(NonlinearRaysEngine)
