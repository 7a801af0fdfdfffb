"""The world: constants, the environment texture against Cycles itself, and Bake World."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Euler

WIDTH, HEIGHT = 64, 32


@pytest.fixture
def world(empty_file):
    """A world of one Background node, in 4.5 as in 5.x, seen by a camera."""
    made = bpy.data.worlds.new("Sky")
    if made.node_tree is None:
        made.use_nodes = True
    made.color = (0.1, 0.2, 0.3)
    # Cycles' map of where the light comes from takes seconds, and lights nothing here.
    made.cycles.sampling_method = "NONE"
    empty_file.world = made
    empty_file.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_file.collection.objects.link(empty_file.camera)
    return made


@pytest.fixture
def export(extension, world):
    """export() -> (core Environment, ambient, warnings)."""

    def export_now():
        scene = extension("addon.export").export_scene(
            bpy.context.evaluated_depsgraph_get(),
            model=extension("addon.core.models").MODELS["straight"](),
            placement=extension("addon.core.scene").Placement(),
        )
        return scene.environment, scene.ambient, list(scene.warnings)

    return export_now


@pytest.fixture
def cube(extension):
    return extension("addon.core.environment_cube")


def background(world):
    return world.node_tree.nodes["Background"]


def smooth_sky():
    """Float pixels without a symmetry, smooth enough that two ways of interpolating agree."""
    u, v = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH, (np.arange(HEIGHT) + 0.5) / HEIGHT)
    phi, theta = np.pi * (1.0 - 2.0 * u), np.pi * (1.0 - v)
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    pixels = np.stack(
        [1.0 + 0.8 * x + 0.1 * y * z, 1.0 + 0.8 * y, 1.0 + 0.8 * z + 0.1 * x * y, np.ones_like(x)], axis=-1
    )
    image = bpy.data.images.new("Stars", WIDTH, HEIGHT, float_buffer=True, alpha=False)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image


def environment_texture(world, image):
    tree = world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs["Color"], background(world).inputs["Color"])
    return node


def mapping(world, node, kind="POINT", location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1)):
    tree = world.node_tree
    coordinates, mapped = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
    mapped.vector_type = kind
    for name, value in (("Location", location), ("Rotation", rotation), ("Scale", scale)):
        if mapped.inputs.get(name) is not None:  # Location is there for two of the types
            mapped.inputs[name].default_value = value
    tree.links.new(coordinates.outputs["Generated"], mapped.inputs["Vector"])
    tree.links.new(mapped.outputs["Vector"], node.inputs["Vector"])
    return mapped


def mapped_directions(directions, kind="POINT", location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1)):
    """Cycles' svm_mapping, for (…, 3) directions; unit."""
    turn = np.array(Euler(rotation).to_matrix())
    made = {
        "POINT": lambda d: (d * scale) @ turn.T + location,
        "TEXTURE": lambda d: ((d - location) @ turn) / scale,
        "VECTOR": lambda d: (d * scale) @ turn.T,
        "NORMAL": lambda d: (d / scale) @ turn.T,
    }[kind](directions)
    return made / np.linalg.norm(made, axis=-1, keepdims=True)


def pixels_of(image):
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[..., :3]


def test_colour_and_strength(export, world):
    background(world).inputs["Color"].default_value = (0.5, 0.25, 0.0, 1.0)
    background(world).inputs["Strength"].default_value = 2.0
    environment, ambient, warnings = export()
    assert environment.faces is None
    assert environment.color == pytest.approx((1.0, 0.5, 0.0))
    assert ambient == environment.color
    assert warnings == []


def test_no_world_and_no_surface_are_black(export, world):
    world.node_tree.links.clear()
    assert export()[0].color == (0.0, 0.0, 0.0)
    bpy.context.scene.world = None
    environment, ambient, warnings = export()
    assert (environment.color, environment.faces, ambient, warnings) == ((0.0,) * 3, None, (0.0,) * 3, [])


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="every world has nodes from 5.0 on")
def test_world_without_nodes(export, world):
    world.use_nodes = False
    assert export()[0].color == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    "mapped",
    [
        None,
        {"rotation": (0.0, 0.0, 1.0)},
        {"rotation": (0.4, -0.7, 1.1)},
        {"rotation": (0.4, -0.7, 1.1), "scale": (1.0, 2.0, 0.5), "location": (0.2, -0.1, 0.3)},
        {"kind": "TEXTURE", "rotation": (0.4, -0.7, 1.1), "scale": (1.0, 2.0, 0.5), "location": (0.2, -0.1, 0.3)},
        {"kind": "VECTOR", "rotation": (0.4, -0.7, 1.1), "scale": (-1.0, 1.0, 1.0)},
        {"kind": "NORMAL", "rotation": (0.4, -0.7, 1.1), "scale": (1.0, 2.0, 0.5)},
    ],
)
def test_the_cube_shows_what_cycles_shows(extension, export, world, cube, mapped):
    """The baked picture is rendered by Cycles through the same nodes; its own orientation is tested below."""
    node = environment_texture(world, smooth_sky())
    background(world).inputs["Strength"].default_value = 1.5
    if mapped is not None:
        mapping(world, node, **mapped)
    environment, ambient, warnings = export()
    assert warnings == []
    assert environment.faces.shape == (6, 16, 16, 3)
    baked = extension("addon.export").bake_world(bpy.context, world, 128)
    directions = cube.face_directions(16)
    expected = cube.sample_equirect(pixels_of(baked), directions)
    error = np.abs(environment.faces - expected).max(axis=-1)
    # Half a row from the poles Cycles wraps from the picture's top to its bottom; that is not copied.
    latitude = np.arcsin(mapped_directions(directions, **(mapped or {}))[..., 2])
    inside = np.abs(latitude) < np.pi / 2 - 0.6 * np.pi / HEIGHT
    assert inside.mean() > 0.9
    assert error[inside].max() < 0.02
    assert ambient == pytest.approx(cube.mean_radiance(environment.faces))


def test_baked_picture_has_the_orientation_of_an_unrotated_node(extension, world, cube):
    """The sky's colour is the ray's own direction, by a node that knows nothing of pictures."""
    tree = world.node_tree
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], background(world).inputs["Color"])
    background(world).inputs["Strength"].default_value = 1.0
    image = extension("addon.export").bake_world(bpy.context, world, 64)
    assert tuple(image.size) == (128, 64)
    assert image.is_float
    assert image.packed_file is not None
    directions = cube.face_directions(8)
    assert np.abs(cube.sample_equirect(pixels_of(image), directions) - directions).max() < 0.01


def test_bake_leaves_the_file_as_it_was(extension, world):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.filepath = 333, "//mine"
    kinds = ("scenes", "cameras", "objects", "worlds", "images", "node_groups", "materials")
    before = {kind: {item.name for item in getattr(bpy.data, kind)} for kind in kinds}
    image = extension("addon.export").bake_world(scene, world, 8)
    before["images"] |= {image.name, "Render Result"}
    after = {kind: {item.name for item in getattr(bpy.data, kind)} for kind in kinds}
    assert {kind: after[kind] - before[kind] for kind in kinds} == {kind: set() for kind in kinds}
    assert (scene.render.resolution_x, scene.render.filepath, scene.render.engine) == (
        333,
        "//mine",
        scene.render.engine,
    )
    assert bpy.context.scene == scene


def test_a_baked_world_is_used_with_no_mapping_and_survives_the_file(extension, export, world, cube, tmp_path):
    environment = environment_texture(world, smooth_sky())
    mapping(world, environment, rotation=(0, 0, 2.0))
    world.nonlinear_rays.baked = extension("addon.export").bake_world(bpy.context, world, 64)
    expected = export()[0].faces
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    faces = export()[0].faces
    assert np.allclose(faces, expected, rtol=1e-5)
    assert faces.shape == (6, 32, 32, 3)
    bpy.context.scene.world.nonlinear_rays.baked = None
    assert export()[0].faces.shape == (6, 16, 16, 3)


def test_mean_of_a_constant_picture(export, world):
    image = bpy.data.images.new("Grey", WIDTH, HEIGHT, float_buffer=True, alpha=False)
    image.pixels.foreach_set(np.tile(np.array([0.5, 1.0, 2.0, 1.0], np.float32), WIDTH * HEIGHT))
    image.pack()
    environment_texture(world, image)
    background(world).inputs["Strength"].default_value = 2.0
    assert export()[1] == pytest.approx((1.0, 2.0, 4.0))


@pytest.fixture
def built(extension, monkeypatch):
    """A list that grows with every cube that is built, from an empty memory."""
    sky = extension("addon.export.sky")
    cubes = []
    original = sky.equirect_to_cube
    monkeypatch.setattr(sky, "_kept", {})
    monkeypatch.setattr(sky, "equirect_to_cube", lambda *given: cubes.append(given) or original(*given))
    return cubes


def test_an_unchanged_sky_is_not_built_again(export, world, built):
    environment_texture(world, smooth_sky())
    first, ambient, _ = export()
    bpy.context.scene.frame_set(7)
    background(world).inputs["Strength"].default_value *= 2.0
    second, twice, _ = export()
    assert len(built) == 1
    assert np.array_equal(second.faces, 2.0 * first.faces)  # a power of two: no rounding
    assert twice == pytest.approx(2.0 * np.array(ambient))


def change_a_pixel(image, node):
    image.pixels[0] += 0.25


def change_the_colour_space(image, node):
    image.colorspace_settings.name = "ACES2065-1"


def change_the_alpha(image, node):
    image.alpha_mode = "NONE"


def change_the_image(image, node):
    other = image.copy()
    other.scale(WIDTH // 2, HEIGHT // 2)
    node.image = other


def change_the_mapping(image, node):
    mapping(bpy.context.scene.world, node, rotation=(0.0, 0.0, 1.0))


def change_the_working_space(image, node):
    if not hasattr(bpy.data, "colorspace"):
        pytest.skip("This Blender has one scene-linear space.")
    bpy.ops.wm.set_working_color_space(convert_colors=False, working_space="ACEScg")


@pytest.mark.parametrize(
    "change",
    [
        change_a_pixel,
        change_the_colour_space,
        change_the_working_space,
        change_the_alpha,
        change_the_image,
        change_the_mapping,
    ],
)
@pytest.mark.parametrize("float_buffer", [True, False])
def test_a_changed_sky_is_built_again(export, world, built, change, float_buffer):
    image = bpy.data.images.new("Half", WIDTH, HEIGHT, float_buffer=float_buffer, alpha=True)
    image.pixels.foreach_set(np.tile(np.float32([0.5, 0.25, 0.125, 0.5]), WIDTH * HEIGHT))
    image.pack()
    node = environment_texture(world, image)
    export()
    change(image, node)
    export()
    assert len(built) == 2


def test_only_the_last_two_skies_are_kept(extension, export, world, built):
    """A near and a far sky alternate in every frame; a third one drives the oldest out."""
    node = environment_texture(world, smooth_sky())
    near, far, third = (smooth_sky() for _ in range(3))
    for image, value in ((far, 0.5), (third, 0.75)):
        image.pixels.foreach_set(np.full(4 * WIDTH * HEIGHT, value, np.float32))

    def show(image):
        node.image = image
        export()
        return len(built)

    assert [show(image) for image in (near, far, near, far)] == [1, 2, 2, 2]
    assert [show(image) for image in (third, far, near)] == [3, 3, 4]
    assert len(extension("addon.export.sky")._kept) == 2


def fault_shader(world):
    node = world.node_tree.nodes.new("ShaderNodeEmission")
    world.node_tree.links.new(node.outputs[0], world.node_tree.nodes["World Output"].inputs["Surface"])


def fault_sky(world):
    node = world.node_tree.nodes.new("ShaderNodeTexSky")
    world.node_tree.links.new(node.outputs[0], background(world).inputs["Color"])


def fault_mirror_ball(world):
    environment_texture(world, smooth_sky()).projection = "MIRROR_BALL"


def fault_no_image(world):
    environment_texture(world, None)


def fault_mapping_without_input(world):
    mapped = mapping(world, environment_texture(world, smooth_sky()))
    world.node_tree.links.remove(mapped.inputs["Vector"].links[0])


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (fault_shader, "node 'Emission' cannot be shown"),
        (fault_sky, "node 'Sky Texture' at Color cannot be shown"),
        (fault_mirror_ball, "node 'Environment Texture' has the projection Mirror Ball, which cannot be shown"),
        (fault_no_image, "node 'Environment Texture' has no image"),
        (fault_mapping_without_input, "nothing is connected to the Vector of node 'Mapping'"),
    ],
)
def test_what_cannot_be_shown_asks_for_a_bake(export, world, fault, said):
    fault(world)
    environment, _, warnings = export()
    assert environment.color == pytest.approx((0.1, 0.2, 0.3))
    assert warnings == [f"World 'Sky': {said}; its viewport colour is used. Press Bake World to show it."]


def test_missing_picture_is_magenta_and_named(export, world):
    image = bpy.data.images.new("Lost", 1, 1)
    image.source, image.filepath = "FILE", "//nowhere.exr"
    environment_texture(world, image)
    environment, _, warnings = export()
    assert environment.color == (1.0, 0.0, 1.0)
    assert warnings == [
        "World 'Sky': image 'Lost' cannot be read ('//nowhere.exr') and is shown in magenta. "
        "Use File > External Data > Find Missing Files."
    ]


def test_keyframed_strength_is_evaluated(export, world):
    socket = background(world).inputs["Strength"]
    background(world).inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    for frame, value in ((1, 0.0), (11, 1.0)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    bpy.context.scene.frame_set(6)
    assert export()[0].color[0] == pytest.approx(0.5, abs=1e-6)
    assert not math.isclose(export()[0].color[0], 1.0)
