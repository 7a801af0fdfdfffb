"""Triangles: shapes whose area, volume and normals are known; modifiers and instances counted; bad meshes."""

import math
import time

import bpy
import numpy as np
import pytest
from mathutils import Matrix


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


def make(name, vertices, faces, collection=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def cube():
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def area(triangles):
    sides = triangles.positions[:, 1:] - triangles.positions[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()


def volume(triangles):
    """Positive where the windings look outward."""
    a, b, c = np.moveaxis(triangles.positions, 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def test_cube(export):
    cube()
    scene = export()
    triangles = scene.triangles
    assert len(triangles) == 12
    assert area(triangles) == pytest.approx(24.0)
    assert volume(triangles) == pytest.approx(8.0)
    dtypes = [
        getattr(triangles, name).dtype for name in ("positions", "normals", "uvs", "material_index", "object_index")
    ]
    assert dtypes == [np.float64, np.float32, np.float32, np.int32, np.int32]
    # Flat faces: each corner's normal is the axis that all three corners share.
    middle = triangles.positions.mean(axis=1)
    axis = np.abs(middle).argmax(axis=1)
    expected = np.zeros((12, 3))
    expected[np.arange(12), axis] = np.sign(middle[np.arange(12), axis])
    assert np.allclose(triangles.normals, expected[:, None], atol=1e-6)
    assert scene.materials == (type(scene.materials[0])(),)
    assert scene.warnings == ()


def test_smooth_sphere_normals_are_radial_under_uneven_scale_and_mirror(export):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    obj = bpy.context.object
    obj.data.shade_smooth()
    for scale in ((1.0, 1.0, 3.0), (-1.0, 2.0, 1.0), (-1.0, -1.0, -1.0)):
        obj.scale = scale
        bpy.context.view_layer.update()
        triangles = export().triangles
        gradient = triangles.positions / np.square(scale)  # of the ellipsoid's equation
        expected = gradient / np.linalg.norm(gradient, axis=2, keepdims=True)
        assert np.einsum("ijk,ijk->ij", triangles.normals, expected).min() > 0.99
        assert np.allclose(np.linalg.norm(triangles.normals, axis=2), 1.0, atol=1e-5)
        assert volume(triangles) == pytest.approx(4.0 / 3.0 * math.pi * np.abs(np.prod(scale)), rel=0.02)


def test_custom_normals_are_kept(export):
    obj = make("Plane", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    slanted = np.array([0.6, 0.0, 0.8])
    obj.data.normals_split_custom_set([tuple(slanted)] * 4)
    assert np.allclose(export().triangles.normals, slanted, atol=1e-3)


def test_render_active_uv_map(export):
    obj = make("Plane", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    for name, factor in (("First", 1.0), ("Second", 10.0)):
        layer = obj.data.uv_layers.new(name=name)
        for corner, vertex in enumerate(obj.data.vertices):
            layer.uv[corner].vector = factor * vertex.co.xy
    obj.data.uv_layers["Second"].active_render = True
    triangles = export().triangles
    assert np.allclose(triangles.uvs, 10.0 * triangles.positions[..., :2])
    obj.data.uv_layers["First"].active_render = True
    assert np.allclose(export().triangles.uvs, triangles.positions[..., :2])


def test_modifiers_are_applied(export):
    obj = cube()
    array = obj.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace[0] = 5, 2.0
    assert len(export().triangles) == 60
    obj.modifiers.remove(array)
    subdivision = obj.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = 2
    assert len(export().triangles) == 12 * 16
    subdivision.show_viewport = False
    assert len(export().triangles) == 12


def test_collection_instances_and_linked_data_read_a_mesh_once(extension, export, monkeypatch):
    geometry = extension("addon.export.geometry")
    reads = []
    monkeypatch.setattr(
        geometry, "read_mesh", lambda mesh, read=geometry.read_mesh: reads.append(mesh.name) or read(mesh)
    )
    collection = bpy.data.collections.new("Inner")
    inner = make("Triangle", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], collection)
    inner.pass_index = 7
    for x in range(3):
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        instance.location.x = 10.0 * x
        bpy.context.scene.collection.objects.link(instance)
    other = bpy.data.objects.new("Linked", inner.data)
    other.location.x = -10.0
    bpy.context.scene.collection.objects.link(other)
    triangles = export().triangles
    assert sorted(triangles.positions[:, 0, 0]) == [-10.0, 0.0, 10.0, 20.0]
    assert sorted(triangles.object_index) == [0, 7, 7, 7]
    assert len(reads) == 1


# A metaball in a collection instance is not shown by Blender itself.
CASES = [(kind, where) for kind in ("text", "curve", "surface") for where in ("alone", "in a collection instance")]


@pytest.mark.parametrize(("kind", "where"), [*CASES, ("metaball", "alone")])
def test_objects_that_evaluate_to_meshes_come_once(export, kind, where):
    add = {
        "text": bpy.ops.object.text_add,
        "curve": bpy.ops.curve.primitive_bezier_circle_add,
        "surface": bpy.ops.surface.primitive_nurbs_surface_sphere_add,
        "metaball": bpy.ops.object.metaball_add,
    }[kind]
    add()
    obj = bpy.context.object
    if kind == "curve":
        obj.data.bevel_depth = 0.1
    if where != "alone":
        collection = bpy.data.collections.new("Inner")
        collection.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        bpy.context.scene.collection.objects.link(instance)
    triangles = export().triangles
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    expected = sum(triangle.area > 0 for triangle in mesh.loop_triangles)
    assert expected > 10
    assert abs(len(triangles) - expected) <= 4  # text has slivers
    assert len(np.unique(triangles.positions.mean(axis=1).round(6), axis=0)) > 0.95 * len(triangles)


def test_geometry_nodes_instances_with_materials(export):
    obj = make("Points", [(0, 0, 0), (5, 0, 0), (10, 0, 0)], [])
    gold = bpy.data.materials.new("Gold")
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    names = ("NodeGroupInput", "NodeGroupOutput")
    names += tuple(f"GeometryNode{name}" for name in ("MeshCube", "SetMaterial", "InstanceOnPoints"))
    start, end, box, paint, spread = (tree.nodes.new(name) for name in names)
    paint.inputs["Material"].default_value = gold
    tree.links.new(start.outputs[0], spread.inputs["Points"])
    tree.links.new(box.outputs["Mesh"], paint.inputs["Geometry"])
    tree.links.new(paint.outputs["Geometry"], spread.inputs["Instance"])
    tree.links.new(spread.outputs[0], end.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = tree
    scene = export()
    assert len(scene.triangles) == 36
    assert np.unique(scene.triangles.positions[..., 0]) == pytest.approx([-0.5, 0.5, 4.5, 5.5, 9.5, 10.5])
    assert {scene.materials[index].name for index in scene.triangles.material_index} == {"Gold"}


def test_materials_by_data_by_object_and_past_the_last_slot(export):
    obj = make("Three", [(0, 0, 0), (1, 0, 0), (0, 1, 0)] * 3, [(0, 1, 2), (3, 4, 5), (6, 7, 8)])
    red, green, blue = (bpy.data.materials.new(name) for name in ("Red", "Green", "Blue"))
    obj.data.materials.append(red)
    obj.data.materials.append(green)
    obj.material_slots[1].link = "OBJECT"
    obj.material_slots[1].material = blue
    obj.data.polygons.foreach_set("material_index", [0, 1, 5])
    scene = export()
    assert [scene.materials[index].name for index in scene.triangles.material_index] == ["Red", "Blue", "Blue"]
    assert len(scene.materials) == 2


def test_visibility(export):
    for name in ("shown", "hidden for render", "not for the camera"):
        make(name, [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    bpy.data.objects["hidden for render"].hide_render = True
    bpy.data.objects["not for the camera"].visible_camera = False
    bpy.data.objects["shown"].pass_index = 3
    assert list(export().triangles.object_index) == [3]


def test_inside_a_render_the_render_settings_count(extension, export):
    """In the depsgraph that Blender hands to RenderEngine.render: render levels, and what only the viewport hides."""
    placement = extension("addon.core.scene").Placement()
    straight = extension("addon.core.models").MODELS["straight"]()
    found = []

    class Engine(bpy.types.RenderEngine):
        bl_idname = "EXPORT_TEST"
        bl_label = "Export test"

        def render(self, depsgraph):
            scene = extension("addon.export").export_scene(depsgraph, model=straight, placement=placement)
            found.append((depsgraph.mode, len(scene.triangles), scene.camera.size))

    modifier = cube().modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 1
    cube().hide_set(True)
    cube().hide_render = True
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 32, 16
    bpy.utils.register_class(Engine)
    try:
        scene.render.engine = "EXPORT_TEST"
        bpy.ops.render.render()
    finally:
        scene.render.engine = "CYCLES"
        bpy.utils.unregister_class(Engine)
    assert found == [("RENDER", 12 * 4 + 12, (32, 16))]


def test_positions_keep_float64_far_from_the_origin(export):
    obj = make("Far", [(0, 0, 0), (1e-4, 0, 0), (0, 1e-4, 0)], [(0, 1, 2)])
    obj.location.x = 4096.0  # a power of two: float32 spacing there is 5e-4
    triangles = export().triangles
    assert len(triangles) == 1
    assert np.ptp(triangles.positions[..., 0]) == pytest.approx(1e-4, rel=1e-6)


def test_flattened_object_keeps_the_faces_that_have_area(export):
    obj = cube()
    obj.scale.z = 0.0
    scene = export()
    assert len(scene.triangles) == 4
    assert np.allclose(np.abs(scene.triangles.normals[..., 2]), 1.0)
    assert scene.warnings == ("'Cube': 8 of 12 triangles have no area and were skipped.",)


def test_bad_triangles_are_counted_by_name(export):
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (math.nan, 0, 1), (math.inf, 0, 1)]
    make("Broken", vertices, [(0, 1, 2), (0, 1, 3), (0, 1, 4), (0, 2, 5)])
    scene = export()
    assert len(scene.triangles) == 1
    assert np.isfinite(scene.triangles.positions).all()
    assert np.isfinite(scene.triangles.normals).all()
    assert scene.warnings == (
        "'Broken': 2 of 4 triangles have corners that are not finite and were skipped.",
        "'Broken': 1 of 4 triangles have no area and were skipped.",
    )


def test_mesh_without_faces_and_empty_scene(export):
    assert len(export().triangles) == 0
    make("Nothing", [], [])
    assert export().warnings == ()
    make("Cloud", [(0, 0, 0), (1, 0, 0)], [])
    scene = export()
    assert len(scene.triangles) == 0
    assert scene.triangles.positions.shape == (0, 3, 3)
    assert scene.warnings == ("'Cloud' has vertices but no faces, and is not shown.",)


def test_parented_shear(export):
    parent = bpy.data.objects.new("Parent", None)
    parent.scale = (1.0, 3.0, 1.0)
    bpy.context.scene.collection.objects.link(parent)
    obj = cube()
    obj.parent, obj.rotation_euler.z = parent, 0.5
    bpy.context.view_layer.update()
    triangles = export().triangles
    expected = np.array(Matrix.Diagonal((1, 3, 1)) @ Matrix.Rotation(0.5, 3, "Z"))
    assert volume(triangles) == pytest.approx(8.0 * np.linalg.det(expected), rel=1e-5)
    facing = np.cross(*np.moveaxis(triangles.positions[:, 1:] - triangles.positions[:, :1], 1, 0))
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    assert np.allclose(triangles.normals, facing[:, None], atol=1e-5)


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_a_large_mirrored_mesh_with_gaps_keeps_every_corner(extension, export, faces):
    """More than one strip, with triangles that are skipped in the first and in the last one, against Blender's own list
    of triangles. A vertex has at most eight of them.
    """
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=100, y_subdivisions=100)
    obj = bpy.context.object
    if faces == "triangles":
        obj.modifiers.new("Triangulate", "TRIANGULATE").quad_method = "FIXED"
    obj.data.vertices[102].co.z = obj.data.vertices[-103].co.z = math.nan
    obj.scale = (-2.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    assert len(mesh.polygons) == (20_000 if faces == "triangles" else 10_000)
    listed = np.array([triangle.vertices for triangle in mesh.loop_triangles])
    expected = np.array([vertex.co for vertex in mesh.vertices], np.float64)[listed[:, [0, 2, 1]]] * (-2, 1, 1)
    kept = np.isfinite(expected).all(axis=(1, 2))
    assert len(kept) == 20_000 > 2 * extension("addon.core.strips").STRIP and 0 < (~kept).sum() <= 16
    scene = export()
    assert np.array_equal(scene.triangles.positions, expected[kept])
    assert np.allclose(scene.triangles.normals, (0, 0, 1))
    assert scene.warnings == (
        f"'Grid': {(~kept).sum()} of 20000 triangles have corners that are not finite and were skipped.",
    )


def test_a_million_triangles_take_seconds(export):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=700, y_subdivisions=700)
    start = time.perf_counter()
    assert len(export().triangles) == 2 * 700 * 700
    assert time.perf_counter() - start < 20.0
