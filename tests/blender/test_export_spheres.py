"""Analytic spheres: where the unit sphere goes, and which matrices are none."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector


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


@pytest.fixture
def star(export):
    """An object marked Analytic Sphere, with a mesh to stand in for it."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    obj = bpy.context.object
    obj.name = "Star"
    obj.nonlinear_rays.analytic_sphere = True
    return obj


def test_centre_radius_axes_and_material(export, star):
    star.location, star.rotation_euler, star.scale = (1, 2, 3), (0.1, 0.2, 0.3), (2, 2, 2)
    star.pass_index = 4
    star.data.materials.append(bpy.data.materials.new("Sun"))
    scene = export()
    assert len(scene.triangles) == 0
    spheres = scene.spheres
    assert spheres.centres == pytest.approx(np.array([[1.0, 2.0, 3.0]]))
    assert spheres.radii == pytest.approx([2.0])
    # The direction of the sphere's own X in the world has the sphere's own coordinates (1, 0, 0).
    in_world = Euler((0.1, 0.2, 0.3)).to_matrix() @ Vector((1, 0, 0))
    assert spheres.axes[0] @ in_world == pytest.approx([1, 0, 0], abs=1e-6)
    assert scene.materials[spheres.material_index[0]].name == "Sun"
    assert spheres.object_index[0] == 4
    assert [array.dtype for array in (spheres.centres, spheres.radii, spheres.axes)] == [np.float64] * 3


def test_evaluated_transform_through_parent_and_constraint(export, star):
    parent = bpy.data.objects.new("Parent", None)
    parent.scale, parent.location = (3, 3, 3), (10, 0, 0)
    bpy.context.scene.collection.objects.link(parent)
    star.parent = parent
    star.constraints.new("LIMIT_LOCATION").use_min_z = True
    star.constraints[0].min_z = 7
    spheres = export().spheres
    assert spheres.centres == pytest.approx(np.array([[10.0, 0.0, 7.0]]))
    assert spheres.radii == pytest.approx([3.0])


def test_negative_scale_is_its_absolute_value(export, star):
    star.scale = (-2, -2, -2)
    assert export().spheres.radii == pytest.approx([2.0])


def test_instances_count(export, star):
    collection = bpy.data.collections.new("Inner")
    collection.objects.link(star)
    bpy.context.scene.collection.objects.unlink(star)
    for x in (0, 5):
        instance = bpy.data.objects.new("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        instance.location.x = x
        bpy.context.scene.collection.objects.link(instance)
    spheres = export().spheres
    assert sorted(spheres.centres[:, 0]) == [0.0, 5.0]


def test_empty_can_be_a_sphere_and_needs_no_material(export):
    obj = bpy.data.objects.new("Point", None)
    obj.nonlinear_rays.analytic_sphere = True
    bpy.context.scene.collection.objects.link(obj)
    scene = export()
    assert len(scene.spheres) == 1
    assert scene.materials[0].name == "Default"


def test_ticking_the_box_after_an_export_counts(export, star):
    export()
    star.nonlinear_rays.analytic_sphere = False
    scene = export()
    assert (len(scene.spheres), len(scene.triangles)) == (0, 80)


def test_hidden_sphere_is_left_out(export, star):
    star.hide_render = True
    assert len(export().spheres) == 0


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (Matrix.Diagonal((1, 1, 2, 1)), "'Star': an analytic sphere needs one scale for all axes, but has (1, 1, 2). "),
        (Matrix.Diagonal((1, 1, 1.001, 1)), "needs one scale for all axes, but has (1, 1, 1.001)"),
        (Matrix.Diagonal((0, 0, 0, 1)), "'Star': an analytic sphere needs a scale, but has (0, 0, 0)"),
        (Matrix.Shear("XY", 4, (0.3, 0.0)), "Star"),
        (Matrix.Translation((math.nan, 0, 0)), "'Star': an analytic sphere needs a finite transform"),
    ],
)
def test_what_is_no_sphere_is_named(extension, matrix, words):
    problem = extension("addon.export.spheres").sphere_problem("Star", np.array(matrix))
    assert words in problem
    assert "or clear Analytic Sphere." in problem


def test_shear_of_equal_lengths_is_named(extension):
    sheared = np.eye(4)
    sheared[:3, 1] = (math.sin(0.2), math.cos(0.2), 0.0)
    problem = extension("addon.export.spheres").sphere_problem("Star", sheared)
    assert "needs axes at right angles, but two stand at 78.54 degrees" in problem


def test_rounding_of_a_rotation_is_forgiven(extension):
    matrix = Matrix.LocRotScale((1e5, 0, 0), Euler((0.3, 1.0, 2.0)), (1e-3, 1e-3, 1.00005e-3))
    assert extension("addon.export.spheres").sphere_problem("Star", np.array(matrix)) is None


def test_uneven_scale_raises_on_export(extension, export, star):
    star.scale = (1, 1, 2)
    with pytest.raises(extension("addon.core.scene").SceneError, match=r"'Star': .* one scale for all axes"):
        export()
