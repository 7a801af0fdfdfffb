"""Blender's world -> the environment: a colour, or an equirectangular picture as a cube texture (Section 4.3)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import mathutils
import numpy as np

from ..core.scene import Environment
from . import nodes
from .images import missing
from .sky import image_sky

ADVICE = "Press Bake World to show it"


@dataclass(frozen=True)
class WorldReading:
    """What a world shows, before any pixel is read.

    color    : radiance where there is no image, (r, g, b);  strength : factor of the image's radiance
    matrix   : float64, (3, 4), affine: a unit direction in world space -> one in the image's
    """

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    image: bpy.types.Image | None = None
    strength: float = 1.0
    matrix: np.ndarray | None = None
    warnings: tuple[str, ...] = ()


class _CannotBeShown(Exception):
    """A node stands where it is not understood."""


def read_world(world: bpy.types.World | None) -> WorldReading:
    """Never raises for what a node tree may contain: it falls back to the world's colour, with a warning."""
    if world is None:
        return WorldReading()
    image = baked_image(world)
    if image is not None:
        return WorldReading(image=image)
    tree = nodes.node_tree(world)
    if tree is None:
        return WorldReading(_plain(world.color))
    try:
        reading = _read_tree(tree)
    except _CannotBeShown as reason:
        text = f"World '{world.name}': {reason}; its viewport colour is used. {ADVICE}."
        return WorldReading(_plain(world.color), warnings=(text,))
    if not nodes.usable(reading.strength, *reading.color):
        text = (
            f"World '{world.name}': its colour or its strength is not a number, or too large; it is black. Change it."
        )
        return WorldReading(warnings=(text,))
    return reading


def export_world(world: bpy.types.World | None) -> tuple[Environment, list[str]]:
    reading = read_world(world)
    warnings = list(reading.warnings)
    if reading.image is None:
        return Environment(reading.color), warnings
    sky = image_sky(reading.image, reading.matrix)
    if sky is None:
        warnings.append(missing_warning(world, reading.image))
        return Environment((1.0, 0.0, 1.0)), warnings
    color = tuple(reading.strength * channel for channel in sky.mean)
    return Environment(color, sky.faces * np.float32(reading.strength)), [*warnings, *sky.warnings]


def world_problem(world: bpy.types.World | None) -> list[str]:
    """What is to be said before a render, without reading a pixel."""
    reading = read_world(world)
    problems = list(reading.warnings)
    if reading.image is not None and missing(reading.image):
        problems.append(missing_warning(world, reading.image))
    return problems


def missing_warning(world: bpy.types.World, image: bpy.types.Image) -> str:
    return (
        f"World '{world.name}': image '{image.name}' cannot be read ('{image.filepath}') and is shown in magenta. "
        "Use File > External Data > Find Missing Files."
    )


def baked_image(world: bpy.types.World) -> bpy.types.Image | None:
    """The picture that Bake World made, where there is one: equirectangular, as for a node without Mapping."""
    # From the original: choosing an image does not make Blender evaluate the world anew.
    return getattr(getattr(world.original, "nonlinear_rays", None), "baked", None)


def mapping_matrix(kind: str, location, rotation, scale) -> np.ndarray:
    """float64, (3, 4): the Mapping node, affine. kind : its vector_type;  rotation : Euler angles, XYZ, radians.

    The result's length does not matter to a direction, so NORMAL's normalisation is left out.
    """
    turn = np.array(mathutils.Euler(tuple(rotation), "XYZ").to_matrix(), np.float64)
    location, scale = np.array(location, np.float64), np.array(scale, np.float64)
    inverse = np.divide(1.0, scale, out=np.zeros(3), where=scale != 0.0)
    if kind == "TEXTURE":
        linear = inverse[:, None] * turn.T
        return np.column_stack([linear, -linear @ location])
    if kind == "NORMAL":
        return np.column_stack([turn * inverse, np.zeros(3)])
    return np.column_stack([turn * scale, location if kind == "POINT" else np.zeros(3)])


def _read_tree(tree: bpy.types.NodeTree) -> WorldReading:
    output = tree.get_output_node("CYCLES") or tree.get_output_node("EEVEE")
    surface = nodes.source(output.inputs["Surface"]) if output is not None else None
    if surface is None:
        return WorldReading()
    background = surface.node
    if background.bl_idname != "ShaderNodeBackground" or background.mute:
        raise _CannotBeShown(f"node '{nodes.label(background)}' cannot be shown")
    strength, varying = nodes.number(background.inputs["Strength"])
    if varying is not None:
        raise _CannotBeShown(f"node '{nodes.label(varying)}' at Strength cannot be shown")
    color, texture = nodes.color(background.inputs["Color"])
    if texture is None:
        return WorldReading(tuple(strength * channel for channel in color))
    reading = _read_texture(texture)
    return replace(reading, strength=strength, color=tuple(strength * channel for channel in reading.color))


def _read_texture(output: bpy.types.NodeSocket) -> WorldReading:
    node = output.node
    if node.bl_idname != "ShaderNodeTexEnvironment" or node.mute:
        raise _CannotBeShown(f"node '{nodes.label(node)}' at Color cannot be shown")
    if node.projection != "EQUIRECTANGULAR":
        raise _CannotBeShown(f"node '{nodes.label(node)}' has the projection Mirror Ball, which cannot be shown")
    if node.image is None:
        raise _CannotBeShown(f"node '{nodes.label(node)}' has no image")
    return WorldReading(image=node.image, matrix=_read_mapping(nodes.source(node.inputs["Vector"])))


def _read_mapping(output: bpy.types.NodeSocket | None) -> np.ndarray | None:
    """(3, 4), what lies between the ray's direction and the texture; None for nothing."""
    if output is None or (output.node.bl_idname == "ShaderNodeTexCoord" and output.name == "Generated"):
        return None
    node = output.node
    if node.bl_idname != "ShaderNodeMapping" or node.mute:
        raise _CannotBeShown(f"node '{nodes.label(node)}' at Vector cannot be shown")
    before = nodes.source(node.inputs["Vector"])
    if before is None:  # Cycles maps the socket's one value then, not the direction
        raise _CannotBeShown(f"nothing is connected to the Vector of node '{nodes.label(node)}'")
    values = []
    for name, default in (("Location", (0.0, 0.0, 0.0)), ("Rotation", (0.0, 0.0, 0.0)), ("Scale", (1.0, 1.0, 1.0))):
        socket = node.inputs.get(name)  # None where the node's type has no use for it
        if socket is not None and nodes.source(socket) is not None:
            raise _CannotBeShown(f"the {name} of node '{nodes.label(node)}' varies, which cannot be shown")
        values.append(default if socket is None else tuple(socket.default_value))
    matrix = mapping_matrix(node.vector_type, *values)
    inner = _read_mapping(before)
    if inner is None:
        return matrix
    return np.column_stack([matrix[:, :3] @ inner[:, :3], matrix[:, :3] @ inner[:, 3] + matrix[:, 3]])


def _plain(values) -> tuple[float, float, float]:
    return tuple(float(value) for value in values)[:3]
