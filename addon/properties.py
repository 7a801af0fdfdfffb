"""What is stored in the .blend: the settings of a scene, an object and a world, and their way to core.settings."""

import math

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.types import PropertyGroup

from .core.scene import Camera
from .core.settings import LARGEST_SPEED, PASSES, Settings
from .menus import (
    EARLY_TERMINATION_ITEMS,
    FAILED_RAYS_ITEMS,
    INTEGRATOR_ITEMS,
    MODEL_ITEMS,
    OBSERVER_ITEMS,
    PASS_TIPS,
    PIPELINE_ITEMS,
    RAY_BITS_ITEMS,
    STEP_CONTROL_ITEMS,
)
from .model_properties import CLASSES as MODEL_CLASSES
from .model_properties import PARAMETER_CLASSES

DEFAULT_MODEL = "straight"  # what F12 shows of a scene that knows nothing of this extension stays what it was
OPTIONAL_PASSES = tuple(name for name in PASSES if name != "Combined")
DEFAULTS = Settings()
DEFAULT_PIXEL_ANGLE = 1e-3  # radians, where there is no camera to ask and for an orthographic one


def pass_property(name: str) -> str:
    """Name of the switch of an output pass: "Object Index" -> "pass_object_index"."""
    return "pass_" + name.lower().replace(" ", "_")


class NONLINEAR_RAYS_PG_scene(PropertyGroup):
    """Scene.nonlinear_rays. A model's parameters are in a group of its name: nonlinear_rays.schwarzschild.mass."""

    model: EnumProperty(
        name="Model", description="The law by which light bends", items=MODEL_ITEMS, default=DEFAULT_MODEL
    )
    center: PointerProperty(
        type=bpy.types.Object,
        name="Centre",
        description="Object whose position and rotation place the model. Empty: the world's origin",
    )
    scale: FloatProperty(
        name="Scale",
        description="Size of one model length in the scene. Unit: metres per model length",
        default=1.0,
        min=0.0,
        soft_min=1e-4,
        soft_max=1000.0,
        precision=4,
    )
    observer: EnumProperty(
        name="Observer", description="Whose directions the camera has", items=OBSERVER_ITEMS, default=DEFAULTS.observer
    )
    observer_velocity: FloatVectorProperty(
        name="Velocity",
        description="How the observer moves past one at rest, along the world's axes. Unit: speeds of light",
        size=3,
        default=DEFAULTS.observer_velocity,
        min=-LARGEST_SPEED,
        max=LARGEST_SPEED,
        precision=3,
    )
    velocity_from_camera: BoolProperty(
        name="From Camera Animation",
        description="Take the velocity of the render's camera from the frame before to the one after. "
        "The viewport takes the one typed above",
        default=False,
    )
    speed_of_light: FloatProperty(
        name="Speed of Light",
        description="How far light comes in a second of the animation: the camera's speed is measured by it. "
        "Unit: model lengths per second",
        default=1.0,
        min=1e-9,
        max=1e12,
        soft_min=0.01,
        soft_max=1000.0,
    )
    far_world: PointerProperty(
        type=bpy.types.World,
        name="Far World",
        description="The sky on the wormhole's far side. Empty: the scene's own world",
    )
    pipeline: EnumProperty(
        name="Pipeline", description="How the work is laid out on the GPU", items=PIPELINE_ITEMS, default="fused"
    )
    integrator: EnumProperty(
        name="Integrator",
        description="The method that takes a step",
        items=INTEGRATOR_ITEMS,
        default="automatic",
    )
    step_control: EnumProperty(
        name="Step Control",
        description="How the size of a step is chosen",
        items=STEP_CONTROL_ITEMS,
        default="embedded",
    )
    use_custom_step: BoolProperty(
        name="Custom Step Size",
        description="Use the step size below. Off: the model chooses one",
        default=False,
    )
    step: FloatProperty(
        name="Step Size",
        description="Step of the ray's parameter τ; the first step where steps adapt. Unit: model lengths",
        default=0.05,
        min=1e-9,
        max=1e9,
        soft_min=1e-4,
        soft_max=10.0,
        precision=4,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="How wrong a ray (Embedded) or one segment of it (Step Doubling) may be. Unit: pixels",
        default=0.05,
        min=1e-4,
        max=1e4,
        soft_min=0.01,
        soft_max=10.0,
        precision=3,
    )
    segments: IntProperty(
        name="Segments",
        description="Straight pieces that a ray may be drawn with; more where few rays take long. Unit: pieces a ray",
        default=DEFAULTS.segments,
        min=1,
        max=1_000_000,
        soft_max=5000,
    )
    steps_per_segment: IntProperty(
        name="Steps per Segment",
        description="Integration steps that make one straight piece. Unit: steps",
        default=DEFAULTS.steps_per_segment,
        min=1,
        max=1000,
        soft_max=100,
    )
    max_steps: IntProperty(
        name="Max Steps",
        description="Integration steps a ray may take before it counts as failed. Unit: steps a ray",
        default=DEFAULTS.max_steps,
        min=1,
        max=10_000_000,
        soft_min=100,
    )
    early_termination: EnumProperty(
        name="Early Termination",
        description="Which ended rays the GPU skips (early z test)",
        items=EARLY_TERMINATION_ITEMS,
        default=DEFAULTS.early_termination,
    )
    use_custom_escape_radius: BoolProperty(
        name="Custom Escape Radius",
        description="Use the radius below. Off: model and scene choose one",
        default=False,
    )
    escape_radius: FloatProperty(
        name="Escape Radius",
        description="Radius around the centre beyond which a ray sees the sky. Unit: model lengths",
        default=100.0,
        min=1e-9,
        max=1e12,
        soft_min=1.0,
        soft_max=1e4,
    )
    samples: IntProperty(
        name="Samples",
        description="Rays a pixel, spread by Blender's Filter Size; a single one goes through its centre. Unit: rays",
        default=DEFAULTS.samples,
        min=1,
        max=4096,
        soft_max=64,
    )
    edge_samples: IntProperty(
        name="Edge Samples",
        description="Rays a pixel where neighbouring rays end differently, at silhouettes and photon rings; no more "
        "than Samples leaves them as the others. Fused pipeline only. Unit: rays",
        default=DEFAULTS.edge_samples,
        min=1,
        max=4096,
        soft_max=64,
    )
    filter_textures: BoolProperty(
        name="Filter Textures",
        description="Average sky and images over what a pixel covers of them after all the bending, so that stars do "
        "not flicker and checkerboards show no false patterns. Fused pipeline only",
        default=DEFAULTS.filter_textures,
    )
    batch_size: IntProperty(
        name="Batch Size",
        description="Objects that one draw call reads; 1 is the paper's crossbar, 0 is automatic. Unit: objects",
        default=0,
        min=0,
        max=65536,
        soft_max=1024,
    )
    cull_batches: BoolProperty(
        name="Cull Batches",
        description="Skip a batch whose bounding sphere a segment misses",
        default=DEFAULTS.cull_batches,
    )
    ray_bits: EnumProperty(
        name="Ray Precision", description="Precision of the ray textures", items=RAY_BITS_ITEMS, default="32"
    )
    failed_rays: EnumProperty(
        name="Failed Rays",
        description="What pixels show whose ray reached a limit or became infinite",
        items=FAILED_RAYS_ITEMS,
        default=DEFAULTS.failed_rays,
    )
    report_folder: StringProperty(
        name="Folder",
        description="Where the report is written; // is beside the .blend file",
        default="//nonlinear_rays_report",
        subtype="DIR_PATH",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},  # or the field is red: the folder is not there yet
    )
    report_quick: BoolProperty(
        name="Quick",
        description="Measure fewer rays, methods and repetitions: less exact, and much faster",
        default=True,
    )


class NONLINEAR_RAYS_PG_object(PropertyGroup):
    analytic_sphere: BoolProperty(
        name="Analytic Sphere",
        description="Render an exact sphere of radius 1 times the object's scale; its mesh is for the viewport only",
        default=False,
    )


class NONLINEAR_RAYS_PG_world(PropertyGroup):
    baked: PointerProperty(
        type=bpy.types.Image,
        name="Baked World",
        description="Equirectangular picture of this world, used instead of its nodes. Empty: the nodes are read",
    )


NONLINEAR_RAYS_PG_scene.__annotations__ |= {
    pass_property(name): BoolProperty(name=name, description=PASS_TIPS[name], default=False) for name in OPTIONAL_PASSES
}
for _name, _class in PARAMETER_CLASSES.items():
    if _name in NONLINEAR_RAYS_PG_scene.__annotations__:
        raise ValueError(f"A model is named '{_name}', as a setting is. Rename the model in core/models/{_name}.py.")
    NONLINEAR_RAYS_PG_scene.__annotations__[_name] = PointerProperty(type=_class)


def pixel_angle(camera: Camera | None) -> float:
    """Angle, radians, between two pixels next to each other in the middle of the picture."""
    if camera is None or camera.kind != "PERSPECTIVE":
        return DEFAULT_PIXEL_ANGLE
    left, right, bottom, top = camera.window
    return min((right - left) / camera.width, (top - bottom) / camera.height)


def settings_from(
    scene: bpy.types.Scene, camera: Camera | None, velocity: tuple[float, float, float] | None = None
) -> Settings:
    """What the user chose.

    camera : the exported one, core.scene.Camera, which turns pixels into radians
    velocity : the observer's, where it is not the typed one; world space, in units of that of light

    Raises core.settings.SettingsError.
    """
    chosen = scene.nonlinear_rays
    return Settings(
        pipeline=chosen.pipeline,
        integrator=chosen.integrator,
        step_control=chosen.step_control,
        observer=chosen.observer,
        observer_velocity=tuple(chosen.observer_velocity if velocity is None else velocity),
        step=chosen.step if chosen.use_custom_step else None,
        tolerance=min(max(chosen.tolerance * pixel_angle(camera), 1e-9), math.pi),
        max_steps=chosen.max_steps,
        segments=chosen.segments,
        steps_per_segment=chosen.steps_per_segment,
        early_termination=chosen.early_termination,
        escape_radius=chosen.escape_radius if chosen.use_custom_escape_radius else None,
        passes=("Combined", *(name for name in OPTIONAL_PASSES if getattr(chosen, pass_property(name)))),
        samples=chosen.samples,
        filter_width=scene.render.filter_size,
        edge_samples=chosen.edge_samples,
        filter_textures=chosen.filter_textures,
        batch_size=chosen.batch_size or None,
        cull_batches=chosen.cull_batches,
        ray_bits=int(chosen.ray_bits),
        failed_rays=chosen.failed_rays,
    )


CLASSES = (
    *MODEL_CLASSES,
    NONLINEAR_RAYS_PG_scene,
    NONLINEAR_RAYS_PG_object,
    NONLINEAR_RAYS_PG_world,
)
POINTERS = (
    (bpy.types.Scene, NONLINEAR_RAYS_PG_scene),
    (bpy.types.Object, NONLINEAR_RAYS_PG_object),
    (bpy.types.World, NONLINEAR_RAYS_PG_world),
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for owner, cls in POINTERS:
        owner.nonlinear_rays = PointerProperty(type=cls)


def unregister():
    for owner, _cls in reversed(POINTERS):
        del owner.nonlinear_rays
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
