"""Walking node trees: what feeds a socket, and whether that is a constant."""

from __future__ import annotations

import bpy

LARGEST = 1e30  # what a colour or a strength may be: times a light and an image it still fits single precision


def usable(*values: float) -> bool:
    """Whether these are numbers that can be rendered; a driver can make others."""
    return all(abs(value) <= LARGEST for value in values)


def node_tree(owner: bpy.types.ID) -> bpy.types.NodeTree | None:
    """The node tree that a material, world or light uses; None where it uses none."""
    # From 5.0 on nodes are always used, and asking warns that the property will go.
    return owner.node_tree if bpy.app.version >= (5, 0, 0) or owner.use_nodes else None


def source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output socket that feeds an input, through reroutes; None where the input's own value counts."""
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return None
        if link.from_node.bl_idname != "NodeReroute":
            return link.from_socket
        socket = link.from_node.inputs[0]


def label(node: bpy.types.Node) -> str:
    """What the user sees on the node."""
    return node.label or node.name


def number(socket: bpy.types.NodeSocket) -> tuple[float, bpy.types.Node | None]:
    """A number and the node that makes it vary (the number is the socket's own then); None where it is constant."""
    output = source(socket)
    if output is None:
        return float(socket.default_value), None
    if output.node.bl_idname == "ShaderNodeValue" and not output.node.mute:
        return float(output.default_value), None
    return float(socket.default_value), output.node


def color(socket: bpy.types.NodeSocket) -> tuple[tuple[float, float, float], bpy.types.NodeSocket | None]:
    """A colour and the output that makes it vary (the colour is the socket's own then); None where it is constant."""
    output = source(socket)
    if output is not None and output.node.bl_idname == "ShaderNodeRGB" and not output.node.mute:
        return tuple(output.default_value)[:3], None
    return tuple(socket.default_value)[:3], output
