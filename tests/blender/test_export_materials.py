"""Materials by node, and what is said about those that cannot be shown."""

import bpy
import numpy as np
import pytest


@pytest.fixture
def read(extension, empty_file):
    """read(material) -> (core material, warnings, images)."""
    images = extension("addon.export.images").ImageTable
    read_material = extension("addon.export.materials").read_material

    def read_now(material):
        table = images()
        reading = read_material(material, table)
        return reading.material, list(reading.warnings), table.images

    return read_now


@pytest.fixture
def material(empty_file):
    """A material of one Principled BSDF, in 4.5 as in 5.x."""
    made = bpy.data.materials.new("Gold")
    if made.node_tree is None:
        made.use_nodes = True
    made.diffuse_color = (0.1, 0.2, 0.3, 1.0)
    return made


def principled(material):
    return material.node_tree.nodes["Principled BSDF"]


def surface(material, kind):
    """A new node of that kind at the material's Surface."""
    node = material.node_tree.nodes.new(kind)
    output = material.node_tree.nodes["Material Output"]
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


def texture(material, socket, image=None):
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image or bpy.data.images.new("Checks", 4, 2)
    material.node_tree.links.new(node.outputs["Color"], socket)
    return node


def test_principled_constants(read, material):
    inputs = principled(material).inputs
    inputs["Base Color"].default_value = (0.5, 0.25, 0.125, 1.0)
    inputs["Roughness"].default_value, inputs["Specular IOR Level"].default_value = 0.3, 0.7
    inputs["Emission Color"].default_value, inputs["Emission Strength"].default_value = (1.0, 0.5, 0.0, 1.0), 4.0
    inputs["Metallic"].default_value = 1.0
    found, warnings, images = read(material)
    assert found.name == "Gold"
    assert found.base_color == pytest.approx((0.5, 0.25, 0.125))
    assert found.emission == pytest.approx((4.0, 2.0, 0.0))
    assert (found.roughness, found.specular) == pytest.approx((0.3, 0.7))
    assert (found.base_image, found.emission_image, warnings, images) == (None, None, [], [])


def test_principled_images(read, material):
    inputs = principled(material).inputs
    node = texture(material, inputs["Base Color"])
    node.extension, node.interpolation = "MIRROR", "Closest"
    glow = texture(material, inputs["Emission Color"], node.image)
    glow.interpolation = "Cubic"
    inputs["Emission Strength"].default_value = 3.0
    found, warnings, images = read(material)
    assert (found.base_image, found.emission_image) == (0, 1)
    assert (found.base_color, found.emission) == ((1.0, 1.0, 1.0), (3.0, 3.0, 3.0))
    assert [(image.extension, image.interpolation) for image in images] == [("MIRROR", "CLOSEST"), ("REPEAT", "LINEAR")]
    assert images[0].pixels.shape == (2, 4, 4)
    assert images[0].pixels is images[1].pixels
    assert warnings == []


def test_the_same_image_and_sampling_is_exported_once(extension, read, material):
    inputs = principled(material).inputs
    image = texture(material, inputs["Base Color"]).image
    texture(material, inputs["Emission Color"], image)
    inputs["Emission Strength"].default_value = 1.0
    found, _, images = read(material)
    assert (found.base_image, found.emission_image, len(images)) == (0, 0, 1)


def test_emission_without_strength_reads_no_image(read, material):
    texture(material, principled(material).inputs["Emission Color"])
    assert principled(material).inputs["Emission Strength"].default_value == 0.0
    found, _, images = read(material)
    assert (found.emission, found.emission_image, images) == ((0.0, 0.0, 0.0), None, [])


def test_emission_and_diffuse(read, material):
    node = surface(material, "ShaderNodeEmission")
    node.inputs["Color"].default_value, node.inputs["Strength"].default_value = (0.5, 1.0, 0.0, 1.0), 2.0
    found, warnings, _ = read(material)
    assert (found.base_color, found.emission, found.specular) == ((0.0, 0.0, 0.0), pytest.approx((1.0, 2.0, 0.0)), 0.0)
    node = surface(material, "ShaderNodeBsdfDiffuse")
    texture(material, node.inputs["Color"])
    found, more, _ = read(material)
    assert (found.base_color, found.base_image, found.specular) == ((1.0, 1.0, 1.0), 0, 0.0)
    assert warnings == more == []


def test_rgb_value_and_reroute_are_constants(read, material):
    nodes, links = material.node_tree.nodes, material.node_tree.links
    rgb, value, reroute = (nodes.new(name) for name in ("ShaderNodeRGB", "ShaderNodeValue", "NodeReroute"))
    rgb.outputs[0].default_value, value.outputs[0].default_value = (0.9, 0.8, 0.7, 1.0), 0.25
    links.new(rgb.outputs[0], reroute.inputs[0])
    links.new(reroute.outputs[0], principled(material).inputs["Base Color"])
    links.new(value.outputs[0], principled(material).inputs["Roughness"])
    found, warnings, _ = read(material)
    assert found.base_color == pytest.approx((0.9, 0.8, 0.7))
    assert found.roughness == pytest.approx(0.25)
    assert warnings == []


@pytest.mark.parametrize("kind", ["ShaderNodeMixShader", "ShaderNodeBsdfGlass", "ShaderNodeBsdfTransparent"])
def test_other_shaders_show_the_viewport_colour(read, material, kind):
    node = surface(material, kind)
    found, warnings, _ = read(material)
    assert found.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert warnings == [f"Material 'Gold': node '{node.name}' cannot be shown; its viewport colour is used."]


def test_other_colours_show_the_viewport_colour(read, material):
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    noise.label = "Dirt"
    material.node_tree.links.new(noise.outputs["Color"], principled(material).inputs["Base Color"])
    found, warnings, _ = read(material)
    assert found.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert warnings == ["Material 'Gold': node 'Dirt' at Base Color cannot be shown; its viewport colour is used."]


def test_nothing_at_the_surface(read, material):
    material.node_tree.links.clear()
    assert read(material)[1] == ["Material 'Gold': nothing is connected to its Surface; its viewport colour is used."]
    material.node_tree.nodes.clear()
    assert read(material)[1] == ["Material 'Gold': it has no Material Output; its viewport colour is used."]


def test_varying_numbers_use_the_sockets_value(read, material):
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs[0], principled(material).inputs["Roughness"])
    found, warnings, _ = read(material)
    assert found.roughness == pytest.approx(0.5)
    assert warnings == ["Material 'Gold': node 'Noise Texture' at Roughness is left out; its value 0.5 is used."]


def test_transparency_is_said_to_be_left_out(read, material):
    principled(material).inputs["Alpha"].default_value = 0.5
    assert read(material)[1] == [
        "Material 'Gold': the Alpha of node 'Principled BSDF' is left out; the surface is opaque."
    ]


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="every material has nodes from 5.0 on")
def test_material_without_nodes(read, material):
    material.use_nodes, material.roughness = False, 0.9
    found, warnings, _ = read(material)
    assert found.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert found.roughness == pytest.approx(0.9)
    assert warnings == []


@pytest.mark.parametrize(
    ("kind", "output", "said"),
    [
        ("ShaderNodeTexCoord", "UV", []),
        ("ShaderNodeUVMap", "UV", []),
        (
            "ShaderNodeTexCoord",
            "Generated",
            ["Material 'Gold': node 'Texture Coordinate' is left out; the image lies on the UV map."],
        ),
        ("ShaderNodeMapping", "Vector", ["Material 'Gold': node 'Mapping' is left out; the image lies on the UV map."]),
    ],
)
def test_mappings(read, material, kind, output, said):
    node = texture(material, principled(material).inputs["Base Color"])
    vector = material.node_tree.nodes.new(kind)
    material.node_tree.links.new(vector.outputs[output], node.inputs["Vector"])
    found, warnings, _ = read(material)
    assert found.base_image == 0
    assert warnings == said


def test_missing_file_is_magenta_and_named(read, material):
    image = bpy.data.images.new("Lost", 1, 1)
    image.source, image.filepath = "FILE", "//nowhere.png"
    texture(material, principled(material).inputs["Base Color"], image)
    found, warnings, images = read(material)
    assert (found.base_color, found.base_image, images) == ((1.0, 0.0, 1.0), None, [])
    assert warnings == [
        "Material 'Gold': image 'Lost' cannot be read ('//nowhere.png') and is shown in magenta. "
        "Use File > External Data > Find Missing Files."
    ]


def test_unreadable_file_is_magenta(read, material, tmp_path):
    path = tmp_path / "broken.png"
    path.write_bytes(b"this is no PNG")
    image = bpy.data.images.new("Broken", 1, 1)
    image.source, image.filepath = "FILE", str(path)
    texture(material, principled(material).inputs["Base Color"], image)
    found, warnings, _ = read(material)
    assert found.base_color == (1.0, 0.0, 1.0)
    assert "'Broken' cannot be read" in warnings[0]


def test_node_without_image(read, material):
    node = texture(material, principled(material).inputs["Base Color"])
    node.image = None
    found, warnings, _ = read(material)
    assert found.base_color == (1.0, 0.0, 1.0)
    assert warnings == ["Material 'Gold': node 'Image Texture' has no image and is shown in magenta. Choose one."]


def test_scene_export_has_materials_once_with_animation(extension, material):
    """Two objects, one material, its colour driven by keyframes: the evaluated value counts."""
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    socket = principled(material).inputs["Base Color"]
    for frame, value in ((1, 0.0), (11, 1.0)):
        socket.default_value = (value, value, value, 1.0)
        socket.keyframe_insert("default_value", frame=frame)
    for _ in range(2):
        bpy.ops.mesh.primitive_plane_add()
        bpy.context.object.data.materials.append(material)
    scene.frame_set(6)
    found = extension("addon.export").export_scene(
        bpy.context.evaluated_depsgraph_get(),
        model=extension("addon.core.models").MODELS["straight"](),
        placement=extension("addon.core.scene").Placement(),
    )
    assert len(found.materials) == 1
    assert found.materials[0].base_color == pytest.approx((0.5, 0.5, 0.5), abs=1e-6)
    assert np.array_equal(found.triangles.material_index, np.zeros(4))


def test_a_uv_map_that_is_not_the_render_active_one_is_named(extension, material):
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    node = texture(material, principled(material).inputs["Base Color"])
    uv = material.node_tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "Other"
    material.node_tree.links.new(uv.outputs[0], node.inputs["Vector"])
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.uv_layers.new(name="Other")
    bpy.context.object.data.materials.append(material)
    found = extension("addon.export").export_scene(
        bpy.context.evaluated_depsgraph_get(),
        model=extension("addon.core.models").MODELS["straight"](),
        placement=extension("addon.core.scene").Placement(),
    )
    assert found.warnings == (
        "'Plane': material 'Gold' asks for the UV map 'Other', but the one for rendering, 'UVMap', is used.",
    )
