"""Presets: the paper's figures, the samples, and how accurate a ray is. They change settings, never objects."""

from dataclasses import dataclass, field

import bpy
from bpy.props import EnumProperty
from bpy.types import Menu, Operator

from .core.models import MODELS
from .menus import number
from .model_properties import entries, parameters_of

RAYS = (  # properties of the scene that say how a ray is integrated: a preset sets them or puts them back
    "pipeline",
    "integrator",
    "step_control",
    "use_custom_step",
    "step",
    "tolerance",
    "segments",
    "steps_per_segment",
    "max_steps",
    "use_custom_escape_radius",
)
OF_A_LAW = ("observer", *RAYS)


@dataclass(frozen=True)
class Preset:
    """What it sets; the rest of OF_A_LAW (with a model) or RAYS, and of the model's values, takes its default.

    model      : key of MODELS, or "" for a preset of the accuracy only
    values     : the model's parameters, options and texts by name
    settings   : properties of Scene.nonlinear_rays by name
    """

    label: str
    description: str
    model: str = ""
    values: dict[str, object] = field(default_factory=dict)
    settings: dict[str, object] = field(default_factory=dict)


EXPLOSION = {
    "medium": "explosion",
    "radius": 8.0,
    "strength": 0.12,
    "thickness": 0.15,
    "roughness": 0.12,
    "frequency": 2.5,
    "rarefaction": 0.5,
}
PAPERS_METHOD = {"pipeline": "paper", "integrator": "euler", "steps_per_segment": 10}

FIGURES = {
    "figure_4a": Preset("Figure 4 (a): Straight", "Straight light, to compare the others with", "straight"),
    "figure_4b": Preset(
        "Figure 4 (b): Lorenz",
        "The paper's β, σ and ρ as a weak force, for a scene some 30 model lengths wide",
        "lorenz",
        {"strength": 2e-5, "reach": 60.0},
    ),
    "figure_4c": Preset(
        "Figure 4 (c): Potential",
        "The cubic ξ(r) of the paper, weakly attractive, out to 16 model lengths",
        "radial_potential",
        {"xi": "cubic", "R": 16.0, "strength": 0.03},
    ),
    "figure_4d": Preset(
        "Figure 4 (d): Explosion",
        "A blast with a rough front, 8 model lengths in radius; animate Time",
        "refraction",
        EXPLOSION,
    ),
    "figure_4e": Preset("Figure 4 (e): Black Hole", "Schwarzschild's black hole of mass 1", "schwarzschild"),
    "figure_4f": Preset(
        "Figure 4 (f): Neutron Star",
        "Schwarzschild's spacetime of mass 1: put an Analytic Sphere of a radius above 2 model lengths at the centre",
        "schwarzschild",
    ),
    "roessler": Preset(
        "Section 5.1: Rössler",
        "The paper's α = 3/8, β = 2 and γ = 4 as a weak force, for a scene some 30 model lengths wide",
        "roessler",
        {"strength": 1e-4, "reach": 60.0},
    ),
}
SAMPLES = {
    "suzanne": Preset("Suzanne", "A black hole of mass 1, as in suzanne.blend", "schwarzschild"),
    "kerr": Preset(
        "Kerr",
        "A black hole of the spin 0.998, seen by an observer at rest, as in kerr.blend",
        "kerr",
        {"spin": 0.998},
        {"observer": "static"},
    ),
    "wormhole": Preset(
        "Wormhole",
        "A throat of 8 model lengths, as in wormhole.blend; choose a Far World",
        "wormhole",
        {"throat_radius": 8.0},
    ),
    "mirage": Preset(
        "Mirage",
        "Hot air over the ground at z = 0, hotter than in nature: grazing rays turn up, as in mirage.blend",
        "refraction",
        {"medium": "mirage", "mirage_b": -1e-3, "mirage_c": 10.0},
    ),
    "luneburg": Preset(
        "Luneburg Lens",
        "A ball of 2 model lengths that focuses on its rim, as in luneburg.blend",
        "refraction",
        {"medium": "luneburg", "radius": 2.0},
    ),
    "volume": Preset(
        "Volume",
        "A volume object's density as the index of refraction, as in volume_refraction.blend; choose the Volume",
        "refraction",
        {"medium": "grid", "strength": 0.15},
    ),
}
ACCURACY = {
    "preview": Preset("Preview", "Within a pixel: for looking around", settings={"tolerance": 1.0}),
    "default": Preset("Default", "Directions right to about 1e-4 radians, away from rays at the edge of chaos"),
    "high": Preset(
        "High",
        "Directions right to about 1e-5 radians, as far as single precision goes",
        settings={"tolerance": 0.004, "segments": 5000},
    ),
    "paper": Preset(
        "Paper, Step Doubling",
        "The paper's passes with Euler's method, adaptive steps (Section 4.2), and a segment every 10 steps",
        settings=PAPERS_METHOD | {"step_control": "doubling"},
    ),
    "paper_constant": Preset(
        "Paper, Constant Steps",
        "The paper's passes with Euler's method, all steps the same, and a segment every 10 steps",
        settings=PAPERS_METHOD | {"step_control": "constant", "segments": 3000},
    ),
}
PRESETS = FIGURES | SAMPLES | ACCURACY


def apply(scene: bpy.types.Scene, name: str) -> None:
    """Centre, Scale, chosen objects and worlds, passes and samples stay as they are."""
    preset = PRESETS[name]
    chosen = scene.nonlinear_rays
    for setting in OF_A_LAW if preset.model else RAYS:
        chosen.property_unset(setting)
    for setting, value in preset.settings.items():
        setattr(chosen, setting, value)
    if preset.model:
        chosen.model = preset.model
        group = parameters_of(scene)
        for entry in entries(MODELS[preset.model]):
            group.property_unset(entry.name)
        for entry, value in preset.values.items():
            setattr(group, entry, value)


class NONLINEAR_RAYS_OT_apply_preset(Operator):
    """Set the model, its parameters and how rays are integrated. Objects, Centre and Scale stay as they are"""

    bl_idname = "nonlinear_rays.apply_preset"
    bl_label = "Apply Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Preset",
        description="Which settings to take",
        items=[(name, preset.label, preset.description, number(name)) for name, preset in PRESETS.items()],
    )

    @classmethod
    def description(cls, _context, properties):
        preset = PRESETS.get(properties.preset)
        return preset.description if preset else cls.__doc__

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def execute(self, context):
        apply(context.scene, self.preset)
        return {"FINISHED"}


def draw_presets(layout, presets: dict[str, Preset], title: str) -> None:
    layout.label(text=title)
    for name, preset in presets.items():
        layout.operator(NONLINEAR_RAYS_OT_apply_preset.bl_idname, text=preset.label).preset = name


class NONLINEAR_RAYS_MT_presets(Menu):
    """Laws of light: the paper's figures and the samples"""

    bl_idname = "NONLINEAR_RAYS_MT_presets"
    bl_label = "Presets"

    def draw(self, _context):
        draw_presets(self.layout, FIGURES, "Figures of the Paper")
        self.layout.separator()
        draw_presets(self.layout, SAMPLES, "Samples")


class NONLINEAR_RAYS_MT_accuracy(Menu):
    """How accurately rays are integrated"""

    bl_idname = "NONLINEAR_RAYS_MT_accuracy"
    bl_label = "Accuracy"

    def draw(self, _context):
        draw_presets(self.layout, ACCURACY, "Accuracy")


CLASSES = (NONLINEAR_RAYS_OT_apply_preset, NONLINEAR_RAYS_MT_presets, NONLINEAR_RAYS_MT_accuracy)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
