"""Lights: power, direction, the spot's cone, and what hides them."""

import math

import bpy
import numpy as np
import pytest


@pytest.fixture
def export(extension, empty_file):
    """export() -> Scene of the open file, through a camera that is added."""
    empty_file.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_file.collection.objects.link(empty_file.camera)
    straight = extension("addon.core.models").MODELS["straight"]()
    placement = extension("addon.core.scene").Placement()

    def export_now():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        return extension("addon.export").export_scene(depsgraph, model=straight, placement=placement)

    return export_now


def add(kind, **values):
    data = bpy.data.lights.new("Lamp", kind)
    for name, value in values.items():
        setattr(data, name, value)
    obj = bpy.data.objects.new("Lamp", data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


@pytest.mark.parametrize("kind", ["POINT", "SUN", "SPOT", "AREA"])
def test_kind_power_position_direction(export, kind):
    obj = add(kind, energy=50.0, color=(1.0, 0.5, 0.25))
    obj.location, obj.rotation_euler = (1, 2, 3), (math.pi / 2, 0, 0)
    obj.scale = (2, 2, 2)
    (light,) = export().lights
    assert light.kind == kind
    assert light.power == pytest.approx((50.0, 25.0, 12.5))
    assert light.position == pytest.approx((1, 2, 3))
    # -Z turned by 90 degrees about X is +Y.
    assert light.direction == pytest.approx((0, 1, 0), abs=1e-6)


def test_exposure_and_temperature(export):
    obj = add("POINT", energy=10.0, exposure=2.0)
    assert export().lights[0].power == pytest.approx((40.0, 40.0, 40.0))
    obj.data.use_temperature, obj.data.temperature = True, 3000.0
    red, _, blue = export().lights[0].power
    assert red > 2.0 * blue
    obj.data.temperature = 6500.0
    assert export().lights[0].power == pytest.approx((40.0, 40.0, 40.0), rel=0.05)


@pytest.mark.parametrize("blend", [0.0, 0.3, 1.0])
def test_spot_cone(export, blend):
    add("SPOT", energy=1.0, spot_size=math.radians(60), spot_blend=blend)
    edge, full = export().lights[0].spot_cosines
    assert edge == pytest.approx(math.cos(math.radians(30)), abs=1e-6)
    assert full == pytest.approx(edge + (1 - edge) * blend, abs=1e-6)


def test_strength_per_area(export):
    """Normalize off: twice the side is four times the light."""
    obj = add("AREA", energy=1.0, shape="SQUARE", size=1.0, normalize=False)
    assert export().lights[0].power == pytest.approx((1, 1, 1))
    obj.data.size = 2.0
    assert export().lights[0].power == pytest.approx((4, 4, 4))
    obj.scale = (3, 1, 1)
    assert export().lights[0].power == pytest.approx((12, 12, 12))


def test_nodes_of_a_light(export):
    obj = add("POINT", energy=2.0)
    if obj.data.node_tree is None:  # 5.x has it from the start
        obj.data.use_nodes = True
    emission = obj.data.node_tree.nodes["Emission"]
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1, 0, 0, 1), 3.0
    assert export().lights[0].power == pytest.approx((6, 0, 0))
    texture = obj.data.node_tree.nodes.new("ShaderNodeTexNoise")
    obj.data.node_tree.links.new(texture.outputs[0], emission.inputs["Color"])
    scene = export()
    assert scene.lights[0].power == pytest.approx((2, 2, 2))
    assert scene.warnings == ("Light 'Lamp': its nodes cannot be shown; its colour and power are used.",)


def test_hidden_dark_and_instanced_lights(export):
    add("POINT", energy=1.0).hide_render = True
    add("POINT", energy=0.0)
    assert export().lights == ()
    obj = add("POINT", energy=1.0)
    collection = bpy.data.collections.new("Inner")
    collection.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)
    for x in (0, 5):
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        instance.location.x = x
        bpy.context.scene.collection.objects.link(instance)
    assert np.sort([light.position[0] for light in export().lights]) == pytest.approx([0, 5])
