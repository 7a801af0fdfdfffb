"""The camera's window against Blender's own projection, and the sizes and cameras that are refused."""

import math

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector


@pytest.fixture
def export(extension, empty_file):
    """export(**options) -> Scene of the open file."""
    straight = extension("addon.core.models").MODELS["straight"]()
    placement = extension("addon.core.scene").Placement()

    def export_now(**options):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        return extension("addon.export").export_scene(depsgraph, model=straight, placement=placement, **options)

    return export_now


@pytest.fixture
def scene_error(extension):
    return extension("addon.core.scene").SceneError


@pytest.fixture
def camera(empty_file):
    obj = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_file.collection.objects.link(obj)
    empty_file.camera = obj
    obj.location, obj.rotation_euler = (3, -5, 2), (1.2, 0.1, 0.6)
    return obj


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize(("width", "height"), [(320, 180), (180, 320), (200, 200)])
@pytest.mark.parametrize("aspect", [(1.0, 1.0), (2.0, 1.0), (1.0, 1.5)])
def test_window_is_blenders_own_projection(export, camera, kind, fit, width, height, aspect):
    data, render = camera.data, bpy.context.scene.render
    data.type, data.sensor_fit, data.shift_x, data.shift_y = kind, fit, 0.13, -0.21
    data.lens, data.sensor_width, data.sensor_height, data.ortho_scale = 40.0, 36.0, 20.0, 5.0
    render.pixel_aspect_x, render.pixel_aspect_y = aspect
    seen = export(width=width, height=height).camera
    left, right, bottom, top = seen.window
    projection = np.array(
        camera.calc_matrix_camera(
            bpy.context.evaluated_depsgraph_get(), x=width, y=height, scale_x=aspect[0], scale_y=aspect[1]
        )
    )
    depth = -1.0 if kind == "PERSP" else -4.0
    for x, y, clip in (
        (left, bottom, (-1, -1)),
        (right, top, (1, 1)),
        ((left + right) / 2, (bottom + top) / 2, (0, 0)),
    ):
        projected = projection @ (x, y, depth, 1.0)
        assert projected[:2] / projected[3] == pytest.approx(clip, abs=1e-5)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_points_land_where_blender_sees_them(export, camera, kind):
    """The whole way: a world point through world_from_camera and the window; a scaled camera, half resolution."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 640, 360, 50
    camera.data.type, camera.scale = kind, (2.0, 2.0, 2.0)
    camera.data.shift_x = 0.1
    bpy.context.view_layer.update()
    seen = export().camera
    assert (seen.width, seen.height) == (320, 180)
    rotation = seen.world_from_camera[:3, :3]
    assert rotation.T @ rotation == pytest.approx(np.eye(3), abs=1e-6)
    left, right, bottom, top = seen.window
    for point in ((0, 0, 0), (1, 2, 0.5), (-1, 0, 3)):
        x, y, z = rotation.T @ (np.array(point) - seen.world_from_camera[:3, 3])
        scale = 1.0 if kind == "ORTHO" else -1.0 / z
        found = ((x * scale - left) / (right - left), (y * scale - bottom) / (top - bottom))
        camera.scale = (1.0, 1.0, 1.0)  # world_to_camera_view normalises the matrix, but not its inverse's depth
        assert found == pytest.approx(tuple(world_to_camera_view(scene, camera, Vector(point)))[:2], abs=1e-4)


def test_another_camera_size_and_region(export, camera):
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    other.location.z = 9.0
    bpy.context.scene.collection.objects.link(other)
    seen = export(camera=other, width=100, height=50, region=(10, 0, 60, 50)).camera
    assert seen.world_from_camera[2, 3] == 9.0
    assert (seen.size, seen.pixel_box) == ((50, 50), (10, 0, 60, 50))
    assert seen.window[1] - seen.window[0] == pytest.approx(other.data.sensor_width / other.data.lens)


def test_depth_of_field_is_a_warning(export, camera):
    camera.data.dof.use_dof = True
    assert export().warnings == ("'Camera': depth of field is not shown.",)


def test_no_camera(export, scene_error):
    with pytest.raises(scene_error) as caught:
        export()
    assert str(caught.value) == "The scene has no camera. Add one with Add > Camera, or set Scene > Camera."


def test_panoramic_camera(export, camera, scene_error):
    camera.data.type = "PANO"
    with pytest.raises(scene_error, match="'Camera' is a panoramic camera, but only perspective and orthographic"):
        export()


def test_something_else_as_camera(export, empty_file, scene_error):
    empty_file.camera = bpy.data.objects.new("Lamp", None)
    empty_file.collection.objects.link(empty_file.camera)
    with pytest.raises(scene_error, match=r"'Lamp' .* is no camera"):
        export()


def test_flat_camera(export, camera, scene_error):
    camera.scale.z = 0.0
    with pytest.raises(scene_error, match="'Camera': the camera's transform has no direction"):
        export()


@pytest.mark.parametrize(("width", "height"), [(0, 100), (100, 0), (-1, 100), (100_000, 100)])
def test_sizes_that_are_refused(export, camera, scene_error, width, height):
    with pytest.raises(
        scene_error, match=rf"The picture is {width} × {height} pixels, but each side must lie in 1\.\.65536"
    ):
        export(width=width, height=height)


@pytest.mark.parametrize("region", [(0, 0, 0, 5), (5, 5, 4, 6), (-1, 0, 5, 5), (0, 0, 11, 5)])
def test_regions_that_are_refused(export, camera, scene_error, region):
    with pytest.raises(scene_error, match="region"):
        export(width=10, height=10, region=region)


def test_field_of_view_is_the_angle_that_blender_shows(export, camera):
    left, right, _, _ = export(width=320, height=180).camera.window
    assert 2.0 * math.atan((right - left) / 2.0) == pytest.approx(camera.data.angle_x, rel=1e-5)
