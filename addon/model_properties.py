"""The models in the .blend: a property group for each, made from what the model says of itself, and the way back.

Numbers, options and texts come from Model.parameters, .options and .texts. What is more than one value (Model.extras)
has its properties and its reading in EXTRAS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from bpy.types import PropertyGroup

from .core.models import MODELS, Model, Parameter, ParameterError
from .core.scene import Placement
from .export.volume import hidden, sample_volume, volume_problem
from .menus import number

LARGEST_FLOAT = 3.4e38


class NONLINEAR_RAYS_PG_named_value(PropertyGroup):
    """A named parameter of a typed formula; PropertyGroup.name is its name."""

    value: FloatProperty(name="Value", description="Value of this parameter in the formulas. Unit: none", default=1.0)


def may_hold_volume(_group, item: bpy.types.Object) -> bool:
    """Volumes, and what Geometry Nodes may turn into one."""
    return item.type == "VOLUME" or any(modifier.type == "NODES" for modifier in item.modifiers)


@dataclass(frozen=True)
class Extra:
    """annotations : Blender properties by name;  read(group, placement, depsgraph) : the model's keyword arguments."""

    annotations: dict[str, object]
    read: Callable[[PropertyGroup, Placement, bpy.types.Depsgraph | None], dict[str, object]]


def read_centres(group: PropertyGroup, placement: Placement, depsgraph: bpy.types.Depsgraph | None) -> dict:
    """The places of the collection's objects; one centre, the model's own, without a collection."""
    if group.centers is None:
        return {}
    places = [evaluated(item, depsgraph).matrix_world.translation for item in group.centers.all_objects]
    return {"centres": placement.points_to_model(np.array(places, np.float64).reshape(-1, 3))}


def read_parameters(group: PropertyGroup, _placement: Placement, _depsgraph: bpy.types.Depsgraph | None) -> dict:
    return {"parameters": {item.name: item.value for item in group.named_values}}


def read_grid(group: PropertyGroup, placement: Placement, depsgraph: bpy.types.Depsgraph | None) -> dict:
    """The voxels of the chosen volume; without a depsgraph, as in a panel, one empty voxel in their place."""
    if group.medium != "grid":
        return {}
    if group.volume is None:
        raise ParameterError("No volume is chosen. Choose one in the Nonlinear Rays panel, or another medium.")
    if problem := volume_problem():
        raise ParameterError(problem)
    if depsgraph is None:
        if group.volume.hide_render:
            raise ParameterError(hidden(group.volume))
        return {"grid": np.zeros((1, 1, 1), np.float32)}
    volume = evaluated(group.volume, depsgraph)
    voxels = sample_volume(volume, depsgraph, placement, group.grid_name, group.grid_resolution)
    return {"grid": voxels.density, "grid_min": voxels.low, "grid_max": voxels.high}


EXTRAS = {
    "centres": Extra(
        {
            "centers": PointerProperty(
                type=bpy.types.Collection,
                name="Centres",
                description="Objects that attract or repel, whose forces add up. Empty: the model's own centre",
            )
        },
        read_centres,
    ),
    "parameters": Extra(
        {
            "named_values": CollectionProperty(
                type=NONLINEAR_RAYS_PG_named_value,
                name="Parameters",
                description="Named values that the formulas may use, beside x y z vx vy vz r t",
            ),
            "active_named_value": IntProperty(
                name="Active Parameter", description="Row of the list that is selected. Unit: rows", default=0, min=0
            ),
        },
        read_parameters,
    ),
    "grid": Extra(  # and grid_min, grid_max
        {
            "volume": PointerProperty(
                type=bpy.types.Object,
                name="Volume",
                description="Object whose density bends light: a volume, or one whose Geometry Nodes make a volume",
                poll=may_hold_volume,
            ),
            "grid_name": StringProperty(
                name="Grid", description="Name of the volume's grid that is taken as the density", default="density"
            ),
            "grid_resolution": IntProperty(
                name="Resolution",
                description="Voxels along the longest side of the volume's box. Unit: voxels",
                default=64,
                min=2,
                max=1024,
                soft_max=256,
            ),
        },
        read_grid,
    ),
}


def evaluated(item: bpy.types.Object, depsgraph: bpy.types.Depsgraph | None) -> bpy.types.Object:
    return item.original.evaluated_get(depsgraph) if depsgraph else item


def parameter_property(parameter: Parameter):
    """The Blender property of a model's parameter: its default, ranges and, in the tooltip, its unit."""
    low, high = max(parameter.minimum, -LARGEST_FLOAT), min(parameter.maximum, LARGEST_FLOAT)
    return FloatProperty(
        name=parameter.name.replace("_", " ").title(),
        description=f"{parameter.description}. Unit: {parameter.unit}",
        default=parameter.default,
        min=low,
        max=high,
        soft_min=max(low, parameter.soft_minimum),
        soft_max=min(high, parameter.soft_maximum),
        precision=3,
        step=10,
    )


def option_property(option):
    """The menu of a model's option."""
    menu = [(key, label, description, number(key)) for key, label, description in option.choices]
    return EnumProperty(name=option.label, description=option.description, items=menu, default=option.default)


def text_property(text):
    """The field of a formula that the user types."""
    return StringProperty(name=text.label, description=text.description, default=text.default, maxlen=text.longest)


def entries(model: type[Model]) -> tuple:
    """Everything of a model that is one value, in the panel's order."""
    return (*model.options, *model.texts, *model.parameters)


def parameters_class(model: type[Model]) -> type[PropertyGroup]:
    """A property group with one property for each parameter, option and text of the model, and those of its extras."""
    annotations = {option.name: option_property(option) for option in model.options}
    annotations |= {text.name: text_property(text) for text in model.texts}
    annotations |= {parameter.name: parameter_property(parameter) for parameter in model.parameters}
    for name in model.extras:
        annotations |= EXTRAS[name].annotations if name in EXTRAS else {}
    return type(f"NONLINEAR_RAYS_PG_model_{model.name}", (PropertyGroup,), {"__annotations__": annotations})


PARAMETER_CLASSES = {name: parameters_class(model) for name, model in MODELS.items()}
CLASSES = (NONLINEAR_RAYS_PG_named_value, *PARAMETER_CLASSES.values())


def parameters_of(scene: bpy.types.Scene) -> PropertyGroup:
    """The parameters of the chosen model."""
    return getattr(scene.nonlinear_rays, scene.nonlinear_rays.model)


def model_and_placement(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None, camera_position: np.ndarray | None = None
) -> tuple[Model, Placement]:
    """The model with its parameters, and where it is.

    depsgraph : where given, objects are read as they are evaluated in it
    camera_position : (3,), metres, world space; where not given, that of the scene's camera. A straight model
        without a centre is placed there, so that single precision stays exact far from the world's origin.
    Raises core.models.ParameterError.
    """
    chosen = scene.nonlinear_rays
    kind = MODELS[chosen.model]
    group = parameters_of(scene)
    placement = _placement(scene, kind, depsgraph, camera_position)
    values = {entry.name: getattr(group, entry.name) for entry in entries(kind)}
    if placement.scale > 0.0:
        for name in kind.extras:
            values |= EXTRAS[name].read(group, placement, depsgraph) if name in EXTRAS else {}
    return kind(**values), placement


def _placement(scene, kind: type[Model], depsgraph, camera_position) -> Placement:
    chosen = scene.nonlinear_rays
    if chosen.center is not None:
        matrix = evaluated(chosen.center, depsgraph).matrix_world
        rotation = np.array(matrix.to_quaternion().to_matrix(), np.float64)
        return Placement(np.array(matrix.translation, np.float64), rotation, chosen.scale)
    if kind.curved:
        return Placement(scale=chosen.scale)
    if camera_position is None and scene.camera is not None:
        camera_position = np.array(evaluated(scene.camera, depsgraph).matrix_world.translation, np.float64)
    return Placement(np.zeros(3) if camera_position is None else camera_position, scale=chosen.scale)
