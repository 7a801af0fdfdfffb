"""Blender's lights -> core lights: point, sun, spot, and area as a point that knows its direction."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..core.scene import Light
from . import nodes


def export_light(obj: bpy.types.Object, world_from_local: np.ndarray) -> tuple[Light | None, list[str]]:
    """A light object of the evaluated scene and its instance's matrix, (4, 4). None where it gives no light."""
    data = obj.data
    matrix = np.asarray(world_from_local, np.float64)
    color = np.array(data.color, np.float64)
    if data.use_temperature:
        color *= data.temperature_color
    node_color, warnings = _node_color(data)
    power = color * node_color * (data.energy * 2.0**data.exposure * _area_factor(data, matrix))
    axis = -matrix[:3, 2]
    length = np.linalg.norm(axis)
    if not (np.isfinite(matrix).all() and np.isfinite(power).all()):
        return None, [*warnings, f"Light '{obj.name}': its transform or its power is not finite; it is left out."]
    if not power.any():
        return None, warnings
    light = Light(
        data.type,
        _plain(power),
        _plain(matrix[:3, 3]),
        _plain(axis / length) if length > 0.0 else (0.0, 0.0, -1.0),
        spot_cosines(data.spot_size, data.spot_blend) if data.type == "SPOT" else (0.0, 0.0),
    )
    return light, warnings


def spot_cosines(size: float, blend: float) -> tuple[float, float]:
    """Cosines of the half-angle at the cone's edge and where the full intensity begins.

    size : the cone's full angle, radians;  blend : 0 … 1
    Cycles' intensity is smoothstep(0, 1, (cos θ − edge) / ((1 − edge) blend)).
    """
    edge = math.cos(0.5 * size)
    return edge, edge + (1.0 - edge) * blend


def _area_factor(data: bpy.types.Light, matrix: np.ndarray) -> float:
    """What the power is multiplied by where a light's strength is per area ("Normalize" off), as in Cycles."""
    if data.normalize:
        return 1.0
    if data.type == "AREA":
        across, up = np.linalg.norm(matrix[:3, :2], axis=0)
        height = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
        area = data.size * across * height * up
        area *= math.pi / 4.0 if data.shape in {"DISK", "ELLIPSE"} else 1.0
    else:
        radius = math.tan(0.5 * data.angle) if data.type == "SUN" else data.shadow_soft_size
        area = math.pi * radius**2
    return area if area > 0.0 else 1.0


def _node_color(data: bpy.types.Light) -> tuple[np.ndarray, list[str]]:
    """What the light's node tree multiplies it by: an Emission of constant colour and strength, or 1 and a warning."""
    tree = nodes.node_tree(data)
    output = tree.get_output_node("CYCLES") if tree is not None else None
    surface = nodes.source(output.inputs["Surface"]) if output is not None else None
    if surface is None:
        return np.ones(3), []
    if surface.node.bl_idname == "ShaderNodeEmission" and not surface.node.mute:
        color, color_source = nodes.color(surface.node.inputs["Color"])
        strength, strength_source = nodes.number(surface.node.inputs["Strength"])
        if color_source is None and strength_source is None:
            return np.array(color) * strength, []
    return np.ones(3), [f"Light '{data.name}': its nodes cannot be shown; its colour and power are used."]


def _plain(values: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(value) for value in values)
