"""The panel's report: make it, and use what it recommends."""

import bpy
from bpy.types import Operator

from . import capture, recommended, report
from .background import Background
from .job import Button, Job
from .properties import pixel_angle


class NONLINEAR_RAYS_OT_report(Background, Operator):
    """Measure error against time for this scene and camera, and open the report as a page. Esc cancels"""

    bl_idname = "nonlinear_rays.report"
    bl_label = "Report"
    # Nothing of the scene changes.
    bl_options = {"REGISTER"}

    when_cancelled = "Cancelled; no report was written."
    _pixel = 0.0

    def start(self, context) -> Job:
        chosen = context.scene.nonlinear_rays
        if chosen.report_folder.startswith("//") and not bpy.data.filepath:
            raise OSError(
                "The report is to lie beside the file, which is not saved. Save it, or choose another folder."
            )
        folder = report.output_folder(bpy.path.abspath(chosen.report_folder))
        exported, settings = capture.capture(context.scene, context.view_layer)
        self._pixel = pixel_angle(exported.camera)
        quick, command = chosen.report_quick, report.command_line(bpy.data.filepath, folder, chosen.report_quick)
        return Job(
            lambda progress, cancelled: report.write(exported, settings, folder, quick, command, progress, cancelled)
        )

    def finish(self, context, result) -> None:
        Button.recommended = recommended.of_report(result, self._pixel)
        self.report({"INFO"}, f"The report is {result}")
        if not bpy.app.background:
            bpy.ops.wm.url_open(url=result.as_uri())


class NONLINEAR_RAYS_OT_use_recommended(Operator):
    """Set how rays are integrated as the report measured it"""

    bl_idname = "nonlinear_rays.use_recommended"
    bl_label = "Use This Setting"
    bl_options = {"REGISTER", "UNDO"}

    index: bpy.props.IntProperty(name="Index", description="Which recommendation. Unit: none", min=0)

    @classmethod
    def poll(cls, context):
        return context.scene is not None and bool(Button.recommended)

    def execute(self, context):
        if self.index >= len(Button.recommended):
            self.report({"ERROR"}, f"The report has {len(Button.recommended)} recommendations. Choose one of them.")
            return {"CANCELLED"}
        recommended.apply(context.scene, Button.recommended[self.index])
        return {"FINISHED"}


CLASSES = (NONLINEAR_RAYS_OT_report, NONLINEAR_RAYS_OT_use_recommended)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
