"""What the panel says before the press: the export's own words, without evaluating or reading a pixel."""

import time

import bpy
import pytest


@pytest.fixture
def find_problems(extension, empty_file):
    return extension("addon.export").find_problems


@pytest.fixture
def camera(empty_file):
    empty_file.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_file.collection.objects.link(empty_file.camera)
    return empty_file.camera


def add_material(name):
    bpy.ops.mesh.primitive_plane_add()
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    return material


def test_nothing_to_say(find_problems, camera):
    add_material("Plain")
    assert find_problems(bpy.context) == find_problems(bpy.context.scene) == []


def test_no_camera_and_panoramic_camera(find_problems, camera):
    camera.data.type = "PANO"
    assert find_problems(bpy.context.scene) == [
        "'Camera' is a panoramic camera, but only perspective and orthographic work. Change its type."
    ]
    bpy.context.scene.camera = None
    assert find_problems(bpy.context.scene)[0].startswith("The scene has no camera. ")


def test_material_and_missing_texture(find_problems, camera):
    add_material("Odd").node_tree.links.clear()
    material = add_material("Textured")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Lost", 1, 1)
    node.image.source, node.image.filepath = "FILE", "//nowhere.png"
    material.node_tree.links.new(
        node.outputs["Color"], material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    )
    assert find_problems(bpy.context.scene) == [
        "Material 'Odd': nothing is connected to its Surface; its viewport colour is used.",
        "Material 'Textured': image 'Lost' cannot be read ('//nowhere.png') and is shown in magenta. "
        "Use File > External Data > Find Missing Files.",
    ]
    bpy.context.object.hide_render = True
    assert len(find_problems(bpy.context.scene)) == 1


def test_uneven_sphere(find_problems, camera):
    obj = bpy.data.objects.new("Star", None)
    obj.nonlinear_rays.analytic_sphere = True
    obj.scale = (1, 1, 2)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    assert find_problems(bpy.context.scene) == [
        "'Star': an analytic sphere needs one scale for all axes, but has (1, 1, 2). "
        "Apply or even out the scale, or clear Analytic Sphere."
    ]


def test_world_that_needs_a_bake_and_one_that_has_it(find_problems, camera):
    world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:
        world.use_nodes = True
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    world.node_tree.links.new(sky.outputs[0], world.node_tree.nodes["Background"].inputs["Color"])
    (problem,) = find_problems(bpy.context.scene)
    assert problem.endswith("Press Bake World to show it.")
    world.nonlinear_rays.baked = bpy.data.images.new("Baked", 8, 4)
    assert find_problems(bpy.context.scene) == []


def test_fast_enough_for_a_panel(extension, find_problems, camera, monkeypatch):
    """A thousand objects, two hundred materials, no pixel read."""
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(None)
    materials = []
    for number in range(200):
        material = bpy.data.materials.new(f"M{number}")
        if material.node_tree is None:
            material.use_nodes = True
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.new(f"I{number}", 4, 4)
        shader = material.node_tree.nodes["Principled BSDF"]
        material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        materials.append(material)
    for number in range(1000):
        obj = bpy.data.objects.new("Object", mesh)
        bpy.context.scene.collection.objects.link(obj)
        obj.material_slots[0].link = "OBJECT"
        obj.material_slots[0].material = materials[number % 200]
    monkeypatch.delattr(extension("addon.export.images"), "scene_linear")
    start = time.perf_counter()
    assert find_problems(bpy.context.scene) == []
    assert time.perf_counter() - start < 0.2
