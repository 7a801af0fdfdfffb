"""What the buttons do; the work is done by capture, job, image and export."""

import bpy
from bpy.types import Operator

from . import capture, image
from .background import Background
from .core.status import advice
from .export import bake_world
from .job import Button, Job, LastRender, render_job
from .model_properties import parameters_of
from .show import show_image


class NONLINEAR_RAYS_OT_render(Background, Operator):
    """Render the current frame along curved light rays into the image "Nonlinear Rays". Esc cancels"""

    bl_idname = "nonlinear_rays.render"
    bl_label = "Render"
    # A step of its own, so that undoing what comes later does not remove the image.
    bl_options = {"UNDO"}

    when_cancelled = "Cancelled; the last picture is kept."

    def start(self, context) -> Job:
        return render_job(*capture.capture(context.scene, context.view_layer))

    def finish(self, context, result) -> None:
        Button.last = LastRender(result.statistics, result.warnings)
        shown = image.show_frame(result)
        if not bpy.app.background:
            show_image(context, shown)
        for sentence in [*result.warnings, *advice(result.statistics.rays)]:
            self.report({"WARNING"}, sentence)


class NONLINEAR_RAYS_OT_cancel(Operator):
    """Stop the picture or the report that is being made; the last one is kept"""

    bl_idname = "nonlinear_rays.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context):
        return Button.job is not None

    def execute(self, _context):
        Button.job.cancel()
        return {"FINISHED"}


class NONLINEAR_RAYS_OT_status_legend(Operator):
    """Show what the colours and numbers of the Status pass mean, as an image"""

    bl_idname = "nonlinear_rays.status_legend"
    bl_label = "Status Legend"
    # A step of its own, so that undoing what comes later does not remove the image.
    bl_options = {"UNDO"}

    def execute(self, context):
        shown = image.show_legend()
        if not bpy.app.background:
            show_image(context, shown)
        return {"FINISHED"}


class NONLINEAR_RAYS_OT_bake_world(Operator):
    """Render the world once with Cycles into a picture that is used instead of its nodes"""

    bl_idname = "nonlinear_rays.bake_world"
    bl_label = "Bake World"
    bl_options = {"REGISTER", "UNDO"}

    resolution: bpy.props.IntProperty(
        name="Resolution",
        description="Height of the picture; it is twice as wide. Unit: pixels",
        default=1024,
        min=16,
        max=8192,
    )

    @classmethod
    def poll(cls, context):
        if bpy.app.is_job_running("RENDER"):
            cls.poll_message_set("Blender is rendering already. Wait for it, or press Esc in its window.")
            return False
        return context.scene is not None and context.scene.world is not None

    def execute(self, context):
        world = context.scene.world
        try:
            baked = bake_world(context, world, self.resolution)
        except Exception as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        before, world.nonlinear_rays.baked = world.nonlinear_rays.baked, baked
        if before is not None and before.users == 0:
            bpy.data.images.remove(before)
        return {"FINISHED"}


class NONLINEAR_RAYS_OT_clear_baked_world(Operator):
    """Forget the baked picture and read the world's nodes again"""

    bl_idname = "nonlinear_rays.clear_baked_world"
    bl_label = "Clear Baked World"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        world = context.scene.world if context.scene else None
        return world is not None and world.nonlinear_rays.baked is not None

    def execute(self, context):
        context.scene.world.nonlinear_rays.baked = None
        return {"FINISHED"}


class NONLINEAR_RAYS_OT_add_named_value(Operator):
    """Add a named parameter that the formulas may use"""

    bl_idname = "nonlinear_rays.add_named_value"
    bl_label = "Add Parameter"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        group = parameters_of(context.scene)
        taken = {item.name for item in group.named_values}
        group.named_values.add().name = next(name for i in range(len(taken) + 1) if (name := f"p{i + 1}") not in taken)
        group.active_named_value = len(group.named_values) - 1
        return {"FINISHED"}


class NONLINEAR_RAYS_OT_remove_named_value(Operator):
    """Remove the selected parameter"""

    bl_idname = "nonlinear_rays.remove_named_value"
    bl_label = "Remove Parameter"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(getattr(parameters_of(context.scene), "named_values", ()))

    def execute(self, context):
        group = parameters_of(context.scene)
        group.named_values.remove(group.active_named_value)
        group.active_named_value = max(0, min(group.active_named_value, len(group.named_values) - 1))
        return {"FINISHED"}


class NONLINEAR_RAYS_OT_add_analytic_sphere(Operator):
    """Add a sphere that is rendered exactly, without triangles; its mesh is only shown in the viewport"""

    bl_idname = "nonlinear_rays.add_analytic_sphere"
    bl_label = "Analytic Sphere"
    bl_options = {"REGISTER", "UNDO"}

    radius: bpy.props.FloatProperty(
        name="Radius", description="The object's scale", default=1.0, min=1e-6, unit="LENGTH"
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1.0)
        sphere = context.object
        sphere.name = sphere.data.name = "Analytic Sphere"
        sphere.data.shade_smooth()
        sphere.scale = (self.radius,) * 3
        sphere.nonlinear_rays.analytic_sphere = True
        return {"FINISHED"}


def draw_add_menu(self, _context):
    self.layout.operator(NONLINEAR_RAYS_OT_add_analytic_sphere.bl_idname, icon="MESH_UVSPHERE")


CLASSES = (
    NONLINEAR_RAYS_OT_render,
    NONLINEAR_RAYS_OT_cancel,
    NONLINEAR_RAYS_OT_status_legend,
    NONLINEAR_RAYS_OT_bake_world,
    NONLINEAR_RAYS_OT_clear_baked_world,
    NONLINEAR_RAYS_OT_add_named_value,
    NONLINEAR_RAYS_OT_remove_named_value,
    NONLINEAR_RAYS_OT_add_analytic_sphere,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_MT_mesh_add.append(draw_add_menu)


def unregister():
    bpy.types.VIEW3D_MT_mesh_add.remove(draw_add_menu)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
