"""A volume's density against its formula, in the model's space; and what is said where there is no density."""

import math
import threading

import bpy
import numpy as np
import pytest
from mathutils import Matrix

GRADIENT, CONSTANT = np.array([0.3, -0.2, 0.5]), 2.0
LOW, HIGH, RESOLUTION = np.array([-1.0, -0.5, -0.75]), np.array([1.0, 1.0, 0.5]), (17, 13, 11)
VOXEL = (HIGH - LOW) / (np.array(RESOLUTION) - 1)
# Before 5.0 the node Volume Cube stores its voxels half a voxel from where it evaluates the density.
OFFSET = 0.5 * VOXEL if bpy.app.version < (5, 0) else np.zeros(3)


@pytest.fixture
def volumes(extension):
    return extension("addon.export.volume")


@pytest.fixture
def scene(empty_file):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 6.0)
    empty_file.collection.objects.link(camera)
    empty_file.camera = camera
    empty_file.render.engine = "NONLINEAR_RAYS"
    empty_file.render.resolution_x = empty_file.render.resolution_y = 24
    empty_file.nonlinear_rays.model = "refraction"
    empty_file.nonlinear_rays.refraction.medium = "grid"
    return empty_file


def linear_density(name="Fog", *, kind="VOLUME", grid="density"):
    """An object whose Geometry Nodes fill a box with the density GRADIENT · x + CONSTANT, in its own space."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube = tree.nodes.new("GeometryNodeVolumeCube")
    cube.inputs["Min"].default_value, cube.inputs["Max"].default_value = LOW, HIGH
    for axis, count in zip("XYZ", RESOLUTION, strict=True):
        cube.inputs[f"Resolution {axis}"].default_value = count
    dot = tree.nodes.new("ShaderNodeVectorMath")
    dot.operation = "DOT_PRODUCT"
    dot.inputs[1].default_value = GRADIENT
    add = tree.nodes.new("ShaderNodeMath")
    add.inputs[1].default_value = CONSTANT
    tree.links.new(tree.nodes.new("GeometryNodeInputPosition").outputs[0], dot.inputs[0])
    tree.links.new(dot.outputs["Value"], add.inputs[0])
    tree.links.new(add.outputs[0], cube.inputs["Density"])
    end = cube.outputs["Volume"]
    if grid != "density":
        get, store = tree.nodes.new("GeometryNodeGetNamedGrid"), tree.nodes.new("GeometryNodeStoreNamedGrid")
        get.inputs["Name"].default_value, store.inputs["Name"].default_value = "density", grid
        tree.links.new(end, get.inputs["Volume"])
        tree.links.new(get.outputs["Grid"], store.inputs["Grid"])
        end = store.outputs["Volume"]
    tree.links.new(end, tree.nodes.new("NodeGroupOutput").inputs["Geometry"])
    data = bpy.data.volumes.new(name) if kind == "VOLUME" else bpy.data.meshes.new(name)
    item = bpy.data.objects.new(name, data)
    item.modifiers.new("Fill", "NODES").node_group = tree
    bpy.context.scene.collection.objects.link(item)
    return item


def turned(extension):
    """A placement that moves, turns and scales."""
    rotation = np.array(Matrix.Rotation(0.7, 3, (1.0, 2.0, -0.5)), np.float64)
    return extension("addon.core.scene").Placement(np.array([0.4, -1.0, 2.0]), rotation, 1.7)


def sample(volumes, item, placement, *, grid="density", resolution=40):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return volumes.sample_volume(item.evaluated_get(depsgraph), depsgraph, placement, grid, resolution)


def compare(voxels, item, placement, *, resolution):
    """Each voxel within the filled box is the formula at its centre; none of that box is outside the lattice."""
    nz, ny, nx = voxels.density.shape
    assert voxels.density.dtype == np.float32 and max(nx, ny, nz) == resolution
    cell = (voxels.high - voxels.low) / (nx, ny, nz)
    assert np.allclose(cell, cell[0])
    k, j, i = np.indices(voxels.density.shape)
    centres = voxels.low + (np.stack([i, j, k], axis=-1) + 0.5) * cell
    world = centres @ (placement.scale * placement.rotation).T + placement.position
    inverse = np.linalg.inv(np.array(item.matrix_world, np.float64))
    own = world @ inverse[:3, :3].T + inverse[:3, 3] + OFFSET
    inside = ((own >= LOW) & (own <= HIGH)).all(axis=-1)
    assert inside.sum() > 500
    assert np.abs(voxels.density - (own @ GRADIENT + CONSTANT))[inside].max() < 1e-5
    outside = ((own < LOW - VOXEL) | (own > HIGH + VOXEL)).any(axis=-1)
    assert not voxels.density[outside].any()
    corners = np.array(np.meshgrid(*np.stack([LOW - OFFSET, HIGH - OFFSET], axis=1))).reshape(3, -1).T
    matrix = np.array(item.matrix_world, np.float64)
    in_model = placement.points_to_model(corners @ matrix[:3, :3].T + matrix[:3, 3])
    assert (in_model >= voxels.low - 1e-5).all() and (in_model <= voxels.high + 1e-5).all()


@pytest.mark.parametrize("kind", ["VOLUME", "MESH"])
def test_density_is_its_formula_in_model_space(extension, volumes, scene, kind):
    item = linear_density(kind=kind)
    item.location, item.rotation_euler, item.scale = (3.0, 1.0, -2.0), (0.3, -0.8, 1.9), (2.0, 0.5, 1.2)
    bpy.context.view_layer.update()
    placement = turned(extension)
    compare(sample(volumes, item, placement), item, placement, resolution=40)


def test_a_volume_in_a_file(extension, volumes, scene, tmp_path):
    made = linear_density("Made")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    geometry = made.evaluated_get(depsgraph).evaluated_geometry()
    assert geometry.volume.grids.save(str(tmp_path / "fog.vdb"))
    data = bpy.data.volumes.new("File")
    data.filepath = str(tmp_path / "fog.vdb")
    item = bpy.data.objects.new("File", data)
    scene.collection.objects.link(item)
    item.location = (0.0, 5.0, 0.0)
    bpy.context.view_layer.update()
    placement = turned(extension)
    compare(sample(volumes, item, placement), item, placement, resolution=40)


def test_many_points_go_in_batches(extension, volumes, scene, monkeypatch):
    item, placement = linear_density(), turned(extension)
    monkeypatch.setattr(volumes, "LARGEST_BATCH", 1000)
    compare(sample(volumes, item, placement, resolution=31), item, placement, resolution=31)


def test_the_object_may_move_and_the_grid_be_named(extension, volumes, scene):
    item, placement = linear_density(grid="smoke"), turned(extension)
    item.location = (0.0, 0.0, 0.0)
    item.keyframe_insert("location", frame=1)
    item.location = (9.0, 0.0, 0.0)
    item.keyframe_insert("location", frame=11)
    boxes = []
    for frame in (1, 11):
        scene.frame_set(frame)
        voxels = sample(volumes, item, placement, grid="smoke", resolution=24)
        compare(voxels, item, placement, resolution=24)
        boxes.append(voxels.low)
    assert np.linalg.norm(boxes[1] - boxes[0]) == pytest.approx(9.0 / 1.7, rel=1e-5)


def collections():
    return {
        name: sorted(item.name for item in getattr(bpy.data, name))
        for name in ("objects", "meshes", "volumes", "node_groups", "scenes", "collections", "worlds")
    }


def test_nothing_is_left_behind(extension, volumes, scene):
    item = linear_density()
    before = collections()
    sample(volumes, item, turned(extension))
    assert collections() == before
    assert bpy.context.scene == scene


def test_the_same_volume_is_sampled_once(extension, volumes, scene, monkeypatch):
    item, placement = linear_density(), turned(extension)
    calls = []
    real = volumes.sample
    monkeypatch.setattr(volumes, "sample", lambda request: calls.append(request) or real(request))
    first = sample(volumes, item, placement, resolution=13)
    assert sample(volumes, item, placement, resolution=13) is first and len(calls) == 1
    item.modifiers[0].node_group.nodes["Vector Math"].inputs[1].default_value = (1.0, 0.0, 0.0)
    assert sample(volumes, item, placement, resolution=13) is not first and len(calls) == 2


def test_faults_are_named(extension, volumes, scene, tmp_path):
    error, placement = extension("addon.core.scene").SceneError, turned(extension)
    item = linear_density()
    with pytest.raises(error, match=r"'Fog' has no grid 'smoke'. It has: density. Set Grid"):
        sample(volumes, item, placement, grid="smoke")
    item.scale = (1.0, 0.0, 1.0)
    with pytest.raises(error, match="'Fog' has a scale of zero"):
        sample(volumes, item, placement)
    item.scale = (1.0, 1.0, 1.0)
    item.hide_viewport = True
    with pytest.raises(error, match="'Fog' is hidden"):
        sample(volumes, item, placement)
    empty = bpy.data.objects.new("Mesh", bpy.data.meshes.new("Mesh"))
    scene.collection.objects.link(empty)
    with pytest.raises(error, match="'Mesh' has no volume"):
        sample(volumes, empty, placement)
    missing = bpy.data.objects.new("Lost", bpy.data.volumes.new("Lost"))
    missing.data.filepath = str(tmp_path / "none.vdb")
    scene.collection.objects.link(missing)
    with pytest.raises(error, match=r"'Lost': the volume cannot be read: .*none.vdb"):
        sample(volumes, missing, placement)


def test_another_thread_waits_no_longer_than_it_must(extension, volumes, monkeypatch):
    """Blender's main thread does not come while this test holds it."""
    monkeypatch.setattr(volumes, "MAIN_THREAD_SECONDS", 0.05)
    raised, called = [], []

    def ask():
        try:
            volumes.on_main_thread(lambda: called.append(True))
        except extension("addon.core.scene").SceneError as error:
            raised.append(error)

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join(10.0)
    assert not thread.is_alive() and not called and "did not answer" in str(raised[0])


def test_the_panel_says_what_is_missing(extension, volumes, scene, monkeypatch):
    checks, group = extension("addon.checks"), scene.nonlinear_rays.refraction
    assert any("No volume is chosen" in problem for problem in checks.problems(scene))
    group.volume = linear_density()
    assert not any("olume" in problem for problem in checks.problems(scene))
    group.volume.hide_render = True
    assert any("'Fog' is hidden" in problem for problem in checks.problems(scene))
    group.volume.hide_render = False
    monkeypatch.setattr(
        extension("addon.model_properties"), "volume_problem", lambda: "This Blender is built without OpenVDB"
    )
    assert any("without OpenVDB" in problem for problem in checks.problems(scene))


def test_a_volume_bends_the_picture(extension, scene, tmp_path):
    """Both ways of rendering hand the voxels on; the picture is finite, and not that of straight rays."""
    scene.nonlinear_rays.refraction.volume = item = linear_density()
    item.scale = (2.0, 2.0, 2.0)
    group = scene.nonlinear_rays.refraction
    group.strength, group.grid_resolution = 0.2, 24
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = 3.0
    scene.collection.objects.link(sun)
    bpy.ops.mesh.primitive_cylinder_add(vertices=7, radius=3.0, depth=0.1, location=(0.0, 0.0, -4.0))
    before = collections()
    capture, trace = extension("addon.capture"), extension("addon.core.trace")
    pictures = {}
    for model in ("refraction", "straight"):
        scene.nonlinear_rays.model = model
        exported, settings = capture.capture(scene, bpy.context.view_layer)
        pictures[model] = trace.render(exported, settings).passes["Combined"]
        assert np.isfinite(pictures[model]).all()
    assert np.abs(pictures["refraction"] - pictures["straight"]).max() > 0.05
    assert collections() == before

    scene.nonlinear_rays.model = "refraction"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "f12.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(tmp_path / "f12.exr"))
    values = np.empty(24 * 24 * 4, np.float32)
    image.pixels.foreach_get(values)
    assert np.allclose(values.reshape(24, 24, 4), pictures["refraction"], atol=2e-3)
    bpy.data.images.remove(image)
    assert collections() == before
    assert math.isfinite(values.sum())
