"""Blender's materials -> core materials: Principled, Emission and Diffuse, each colour constant or one Image Texture.

Anything else is shown in the material's viewport colour, with a warning that names the material and the node. Of
Principled the base colour, emission, roughness and specular level count. Metallic is not a highlight's colour here: a
metal keeps its base colour and its specular level.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..core.scene import Material
from . import nodes
from .images import ImageTable

Color = tuple[float, float, float]

MISSING = (1.0, 0.0, 1.0)  # what Cycles shows for an image that it cannot read
BLACK = (0.0, 0.0, 0.0)
WHITE = (1.0, 1.0, 1.0)


class _CannotBeShown(Exception):
    """A node stands where only a constant or an image is understood."""


@dataclass(frozen=True)
class Reading:
    """A material, what is to be said about it, and the UV maps that its nodes ask for by name."""

    material: Material
    warnings: tuple[str, ...] = ()
    uv_maps: frozenset[str] = frozenset()


def read_material(material: bpy.types.Material, images: ImageTable) -> Reading:
    """Never raises for what a node tree may contain: it falls back to the viewport colour, with a warning."""
    tree = nodes.node_tree(material)
    if tree is None:
        return Reading(_viewport_material(material))
    reader = _Reader(material, images)
    try:
        result = reader.surface(tree)
    except _CannotBeShown as reason:
        return Reading(
            _viewport_material(material), (f"Material '{material.name}': {reason}; its viewport colour is used.",)
        )
    return Reading(result, tuple(dict.fromkeys(reader.warnings)), frozenset(reader.uv_maps))


class MaterialTable:
    """The materials of one export, each once. None stands for no material: the default grey."""

    def __init__(self, images: ImageTable):
        self.images = images
        self.readings: list[Reading] = []
        self._indices: dict[int | None, int] = {}

    def index(self, material: bpy.types.Material | None) -> int:
        key = None if material is None else material.original.session_uid
        if key not in self._indices:
            self._indices[key] = len(self.readings)
            self.readings.append(Reading(Material()) if material is None else read_material(material, self.images))
        return self._indices[key]

    @property
    def materials(self) -> tuple[Material, ...]:
        return tuple(reading.material for reading in self.readings) or (Material(),)

    @property
    def warnings(self) -> list[str]:
        return [warning for reading in self.readings for warning in reading.warnings] + self.images.warnings


class _Reader:
    """Reads one material; collects its warnings."""

    def __init__(self, material: bpy.types.Material, images: ImageTable):
        self.name = material.name
        self.images = images
        self.warnings: list[str] = []
        self.uv_maps: set[str] = set()

    def surface(self, tree: bpy.types.NodeTree) -> Material:
        output = tree.get_output_node("CYCLES") or tree.get_output_node("EEVEE")
        if output is None:
            raise _CannotBeShown("it has no Material Output")
        socket = nodes.source(output.inputs["Surface"])
        if socket is None:
            raise _CannotBeShown("nothing is connected to its Surface")
        readers = {
            "ShaderNodeBsdfPrincipled": self.principled,
            "ShaderNodeEmission": self.emission,
            "ShaderNodeBsdfDiffuse": self.diffuse,
        }
        node = socket.node
        if node.bl_idname not in readers or node.mute:
            raise _CannotBeShown(f"node '{nodes.label(node)}' cannot be shown")
        return readers[node.bl_idname](node)

    def principled(self, node: bpy.types.Node) -> Material:
        base_color, base_image = self.color(node.inputs["Base Color"])
        strength = self.number(node.inputs["Emission Strength"])
        emission, emission_image = BLACK, None
        if strength > 0.0:
            emission, emission_image = self.color(node.inputs["Emission Color"], strength)
        for name, plain in (("Alpha", 1.0), ("Transmission Weight", 0.0)):
            if nodes.number(node.inputs[name]) != (plain, None):
                self.warn(f"the {name} of node '{nodes.label(node)}' is left out; the surface is opaque")
        return Material(
            self.name,
            base_color,
            emission,
            min(max(self.number(node.inputs["Roughness"]), 0.0), 1.0),
            min(max(self.number(node.inputs["Specular IOR Level"]), 0.0), 1.0),
            base_image,
            emission_image,
        )

    def emission(self, node: bpy.types.Node) -> Material:
        color, image = self.color(node.inputs["Color"], self.number(node.inputs["Strength"]))
        return Material(self.name, BLACK, color, emission_image=image)

    def diffuse(self, node: bpy.types.Node) -> Material:
        color, image = self.color(node.inputs["Color"])
        return Material(self.name, color, base_image=image)

    def number(self, socket: bpy.types.NodeSocket) -> float:
        value, varying = nodes.number(socket)
        if varying is not None:
            self.warn(f"node '{nodes.label(varying)}' at {socket.name} is left out; its value {value:g} is used")
        if not nodes.usable(value):
            self.warn(f"the {socket.name} of node '{nodes.label(socket.node)}' is {value:g}; 0 is used. Change it")
            return 0.0
        return value

    def color(
        self, socket: bpy.types.NodeSocket, strength: float = 1.0
    ) -> tuple[tuple[float, float, float], int | None]:
        """A colour times strength, and the index of the image that it multiplies."""
        color, varying = nodes.color(socket)
        image = None
        if varying is not None:
            if varying.node.bl_idname != "ShaderNodeTexImage" or varying.name != "Color" or varying.node.mute:
                raise _CannotBeShown(f"node '{nodes.label(varying.node)}' at {socket.name} cannot be shown")
            color, image = self.texture(varying.node)
        color = tuple(strength * channel for channel in color)
        if not nodes.usable(*color):
            values = ", ".join(f"{channel:g}" for channel in color)
            self.warn(f"the {socket.name} of node '{nodes.label(socket.node)}' is ({values}); black is used. Change it")
            return BLACK, None
        return color, image

    def texture(self, node: bpy.types.Node) -> tuple[Color, int | None]:
        """White and the image, or magenta where there is none."""
        if node.image is None:
            self.warn(f"node '{nodes.label(node)}' has no image and is shown in magenta. Choose one")
            return MISSING, None
        index = self.images.add(node)
        if index is None:
            self.warn(
                f"image '{node.image.name}' cannot be read ('{node.image.filepath}') and is shown in magenta. "
                "Use File > External Data > Find Missing Files"
            )
            return MISSING, None
        self.mapping(node)
        return WHITE, index

    def mapping(self, node: bpy.types.Node) -> None:
        """Anything but the UV map earns a warning: images lie on it."""
        if node.projection != "FLAT":
            self.warn(
                f"node '{nodes.label(node)}': the projection {node.projection.title()} is left out; the UV map is used"
            )
        vector = nodes.source(node.inputs["Vector"])
        if vector is None:
            return
        if vector.node.bl_idname == "ShaderNodeUVMap":
            if vector.node.uv_map:
                self.uv_maps.add(vector.node.uv_map)
        elif vector.node.bl_idname != "ShaderNodeTexCoord" or vector.name != "UV":
            self.warn(f"node '{nodes.label(vector.node)}' is left out; the image lies on the UV map")

    def warn(self, text: str) -> None:
        self.warnings.append(f"Material '{self.name}': {text}.")


def _viewport_material(material: bpy.types.Material) -> Material:
    """The colours that the viewport's Solid mode shows."""
    return Material(
        material.name,
        tuple(material.diffuse_color)[:3],
        roughness=material.roughness,
        specular=material.specular_intensity,
    )
