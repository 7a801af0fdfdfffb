"""The N-panel, and the same settings in the Properties editor."""

from __future__ import annotations

import bpy
from bpy.types import Panel, UIList

from . import status_colors
from .capture import ENGINE
from .checks import problems
from .core.models import MODELS
from .core.status import MEANINGS, advice, patience
from .job import Button
from .model_properties import entries, parameters_of
from .operators import (
    NONLINEAR_RAYS_OT_add_named_value,
    NONLINEAR_RAYS_OT_bake_world,
    NONLINEAR_RAYS_OT_cancel,
    NONLINEAR_RAYS_OT_clear_baked_world,
    NONLINEAR_RAYS_OT_remove_named_value,
    NONLINEAR_RAYS_OT_render,
    NONLINEAR_RAYS_OT_status_legend,
)
from .presets import NONLINEAR_RAYS_MT_accuracy, NONLINEAR_RAYS_MT_presets
from .properties import OPTIONAL_PASSES, pass_property
from .report_operators import NONLINEAR_RAYS_OT_report, NONLINEAR_RAYS_OT_use_recommended

CHARACTER_PIXELS = 7.0  # of a panel's font at a scale of 1
ICON_PIXELS = 60.0


def wrapped(text: str, width: float) -> list[str]:
    """The text in lines of at most `width` characters, broken between words: a label shows one line only."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append(word)
        else:
            lines[-1] = f"{lines[-1]} {word}".lstrip()
    return lines


def sentence(layout, context, text: str, icon: str = "BLANK1") -> None:
    """A label of as many lines as the panel's width asks for."""
    scale = context.preferences.system.ui_scale
    width = (context.region.width / scale - ICON_PIXELS) / CHARACTER_PIXELS if context.region else 40
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(wrapped(text, max(width, 16))):
        column.label(text=line, icon=icon if number == 0 else "BLANK1")


def draw_render_button(layout, context) -> None:
    row = layout.row(align=True)
    row.scale_y = 1.4
    if Button.job is None:
        row.operator(NONLINEAR_RAYS_OT_render.bl_idname, icon="RENDER_STILL")
    else:
        row.progress(factor=Button.job.fraction, text=Button.job.text)
        row.operator(NONLINEAR_RAYS_OT_cancel.bl_idname, text="", icon="CANCEL")
    found = problems(context.scene)
    if found:
        box = layout.box()
        for problem in found:
            sentence(box, context, problem, "ERROR")


def draw_model(layout, context) -> None:
    chosen = context.scene.nonlinear_rays
    layout.menu(NONLINEAR_RAYS_MT_presets.bl_idname, icon="PRESET")
    layout.prop(chosen, "model")
    group = parameters_of(context.scene)
    model = MODELS[chosen.model]
    hidden = model.unused({option.name: getattr(group, option.name) for option in model.options})
    for entry in entries(model):
        if entry.name not in hidden:
            layout.prop(group, entry.name)
    if "centers" in group.bl_rna.properties:
        layout.prop(group, "centers")
    if "named_values" in group.bl_rna.properties:
        draw_named_values(layout, group)
    if "volume" in group.bl_rna.properties and group.medium == "grid":
        for name in ("volume", "grid_name", "grid_resolution"):
            layout.prop(group, name)
    layout.prop(chosen, "center")
    layout.prop(chosen, "scale")
    layout.prop(chosen, "observer")
    if chosen.observer == "moving":
        row = layout.row()
        row.active = not chosen.velocity_from_camera
        row.prop(chosen, "observer_velocity")
        layout.prop(chosen, "velocity_from_camera")
        if chosen.velocity_from_camera:
            layout.prop(chosen, "speed_of_light")
    if model.has_far_side:
        layout.prop(chosen, "far_world")
    world = context.scene.world
    if world is not None:
        row = layout.row(align=True)
        if world.nonlinear_rays.baked is not None:
            row.prop(world.nonlinear_rays, "baked")
            row.operator(NONLINEAR_RAYS_OT_clear_baked_world.bl_idname, text="", icon="X")
        else:
            row.operator(NONLINEAR_RAYS_OT_bake_world.bl_idname, icon="WORLD")


def draw_named_values(layout, group) -> None:
    """The named parameters of typed formulas, with buttons to add and remove one."""
    row = layout.row()
    row.template_list("NONLINEAR_RAYS_UL_named_values", "", group, "named_values", group, "active_named_value", rows=2)
    column = row.column(align=True)
    column.operator(NONLINEAR_RAYS_OT_add_named_value.bl_idname, text="", icon="ADD")
    column.operator(NONLINEAR_RAYS_OT_remove_named_value.bl_idname, text="", icon="REMOVE")


def optional_value(layout, group, switch: str, value: str, text: str) -> None:
    """A switch with its value beside it, greyed while it is off."""
    row = layout.row(heading=text, align=True)
    row.prop(group, switch, text="")
    sub = row.row(align=True)
    sub.active = getattr(group, switch)
    sub.prop(group, value, text="")


def draw_integration(layout, context) -> None:
    chosen = context.scene.nonlinear_rays
    layout.menu(NONLINEAR_RAYS_MT_accuracy.bl_idname, icon="PRESET")
    layout.prop(chosen, "pipeline")
    layout.prop(chosen, "integrator")
    layout.prop(chosen, "step_control")
    optional_value(layout, chosen, "use_custom_step", "step", "Step Size")
    row = layout.row()
    row.active = chosen.step_control != "constant"
    row.prop(chosen, "tolerance")
    column = layout.column(align=True)
    column.prop(chosen, "segments")
    column.prop(chosen, "steps_per_segment")
    column.prop(chosen, "max_steps")
    optional_value(layout, chosen, "use_custom_escape_radius", "escape_radius", "Escape Radius")
    layout.prop(chosen, "samples")
    column = layout.column()
    column.active = chosen.pipeline == "fused"
    column.prop(chosen, "edge_samples")
    column.prop(chosen, "filter_textures")
    row = layout.row()
    row.active = max(chosen.samples, chosen.edge_samples) > 1
    row.prop(context.scene.render, "filter_size")
    layout.prop(chosen, "failed_rays")


def draw_passes(layout, context) -> None:
    column = layout.column(heading="Include", align=True)
    for name in OPTIONAL_PASSES:
        column.prop(context.scene.nonlinear_rays, pass_property(name))


def draw_performance(layout, context) -> None:
    chosen = context.scene.nonlinear_rays
    column = layout.column()
    column.active = chosen.pipeline == "paper"
    for name in ("early_termination", "cull_batches", "batch_size", "ray_bits"):
        column.prop(chosen, name)
    layout.prop(context.scene.render, "preview_pixel_size")


def draw_last_render(layout, context) -> None:
    layout.use_property_split = False
    if Button.last is None:
        layout.label(text="Nothing rendered yet")
        return
    statistics = Button.last.statistics
    for text in [*Button.last.warnings, *advice(statistics.rays)]:
        sentence(layout, context, text, "ERROR")
    rays = [(f"{status} {MEANINGS[status].capitalize()}", f"{count:,}") for status, count in statistics.rays.items()]
    table(layout, rays, "Rays by Status", [status_colors.icon(status) for status in statistics.rays])
    layout.operator(NONLINEAR_RAYS_OT_status_legend.bl_idname, icon="COLOR")
    stages = [
        (stage.capitalize(), f"{milliseconds:,.1f} ms") for stage, milliseconds in statistics.milliseconds.items()
    ]
    table(layout, stages, "Time")
    if statistics.steps:
        most, mean = statistics.steps
        table(layout, [("Most", f"{most:,}"), ("Mean", f"{mean:,.1f}")], "Steps a ray")
    if statistics.prolonged:
        sentence(layout, context, patience(*statistics.prolonged), "INFO")
    if statistics.worst_drift is not None:
        table(layout, [("Worst drift", f"{statistics.worst_drift:.2g}")], "Invariants")
    table(layout, [("Textures", f"{statistics.texture_bytes / (1 << 20):,.2f} MiB")], statistics.device or "Memory")
    if statistics.left_out:
        column = layout.column(align=True)
        column.label(text="Not needed, left out")
        for text in statistics.left_out:
            sentence(column, context, text, "DOT")


def draw_report(layout, context) -> None:
    chosen = context.scene.nonlinear_rays
    layout.prop(chosen, "report_folder")
    layout.prop(chosen, "report_quick")
    layout.operator(NONLINEAR_RAYS_OT_report.bl_idname, icon="TEXT")
    for index, found in enumerate(Button.recommended):
        if found.model != chosen.model:
            continue
        box = layout.box()
        sentence(box, context, f"Below {found.goal:g} pixel: {found.label}")
        sentence(box, context, f"{found.error:.2g} pixel, {found.nanoseconds:,.0f} ns a ray")
        box.operator(NONLINEAR_RAYS_OT_use_recommended.bl_idname).index = index


def table(layout, rows: list[tuple[str, str]], title: str, icons: list[int] | None = None) -> None:
    """A title over rows of a name at the left and a number at the right. icons : icon_value of each row"""
    column = layout.column(align=True)
    column.scale_y = 0.8
    column.label(text=title)
    for index, (name, value) in enumerate(rows):
        split = column.split(factor=0.62)
        if icons:
            split.label(text=name, icon_value=icons[index])
        else:
            split.label(text=name, icon="BLANK1")
        number = split.row()
        number.alignment = "RIGHT"
        number.label(text=value)


class _Drawn:
    """Draws with one function; the label and the place come with the class."""

    draw_function = None

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = self.bl_space_type == "PROPERTIES"
        type(self).draw_function(self.layout, context)


class _Sidebar(_Drawn):
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Nonlinear Rays"


class _RenderTab(_Drawn):
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES


def draw_main(layout, context) -> None:
    draw_render_button(layout, context)
    draw_model(layout, context)


SECTIONS = (  # name, label, function, open at first
    ("main", "Nonlinear Rays", draw_main, True),
    ("integration", "Integration", draw_integration, False),
    ("passes", "Output Passes", draw_passes, False),
    ("performance", "Performance", draw_performance, False),
    ("report", "Report", draw_report, False),
    ("last_render", "Last Render", draw_last_render, True),
)


def section_panels(place: type, prefix: str) -> list[type[Panel]]:
    """A panel for each section; those after the first are inside the first."""
    panels = []
    for order, (name, label, function, is_open) in enumerate(SECTIONS):
        members = {
            "bl_idname": f"{prefix}_{name}",
            "bl_label": label,
            "bl_order": order - 1,  # the first comes before Blender's own
            "bl_options": set() if is_open else {"DEFAULT_CLOSED"},
            "draw_function": staticmethod(function),
        }
        if order > 0:
            members["bl_parent_id"] = f"{prefix}_main"
        panels.append(type(f"{prefix}_{name}", (place, Panel), members))
    return panels


class NONLINEAR_RAYS_UL_named_values(UIList):
    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index):
        layout.use_property_split = False
        row = layout.split(factor=0.5)
        row.prop(item, "name", text="", emboss=False)
        row.prop(item, "value", text="")


class NONLINEAR_RAYS_PT_object(Panel):
    bl_label = "Nonlinear Rays"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type in {"MESH", "EMPTY"}

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop(context.object.nonlinear_rays, "analytic_sphere")


CLASSES = (
    *section_panels(_Sidebar, "NONLINEAR_RAYS_PT_view3d"),
    *section_panels(_RenderTab, "NONLINEAR_RAYS_PT_render"),
    NONLINEAR_RAYS_UL_named_values,
    NONLINEAR_RAYS_PT_object,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
