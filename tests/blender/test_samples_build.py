"""The samples: what build.py writes, and that the files in the repository are what it writes."""

import re
import subprocess
import sys

import bpy
import numpy as np
import pytest

from tools.bpy_extension import REPOSITORY

SAMPLES = REPOSITORY / "sample_blends"
FIGURES = ("test_scene", "lorenz", "potential", "explosion", "schwarzschild", "wormhole")  # all show the test scene
NAMES = (*FIGURES, "neutron_star", "suzanne", "kerr", "mirage", "luneburg", "volume_refraction")
PRESETS = {  # whose parameters the sample has
    "test_scene": "figure_4a",
    "lorenz": "figure_4b",
    "potential": "figure_4c",
    "explosion": "figure_4d",
    "schwarzschild": "figure_4e",
    "neutron_star": "figure_4f",
    "volume_refraction": "volume",
} | {name: name for name in ("suzanne", "kerr", "wormhole", "mirage", "luneburg")}
ANALYTIC = {"Red Sphere", "Striped Sphere", "Green Sphere"}
TEST_OBJECTS = ANALYTIC | {"Floor", "Cube", "Pillar", "Screen", "Small Cube", "Torus", "Sun", "Lamp", "Camera"}

makes_samples = pytest.mark.skipif(bpy.app.version[:2] != (4, 5), reason="the samples are made with bpy 4.5")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A folder with all samples, built anew."""
    folder = tmp_path_factory.mktemp("samples")
    command = [sys.executable, SAMPLES / "build.py", "--output", folder]
    subprocess.run(command, check=True, capture_output=True, text=True, timeout=120)
    return folder


@pytest.fixture
def opened(extension):
    """opened(path) opens the .blend; the value is its scene."""

    def open_file(path):
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
        return bpy.context.scene

    yield open_file
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def content(scene):
    """All that a picture depends on, by name, as numbers, texts and bytes."""
    chosen = scene.nonlinear_rays
    found = {"settings": (chosen.model, chosen.observer, chosen.segments, chosen.samples), "sky": scene.world.name}
    found["parameters"] = parameters(scene)
    for item in scene.objects:
        found[item.name] = (
            np.round(np.array(item.matrix_world), 5).tolist(),
            item.pass_index,
            item.nonlinear_rays.analytic_sphere,
            tuple(slot.material.name for slot in item.material_slots),
        )
        for modifier in item.modifiers:
            found[f"{item.name}: {modifier.name}"] = modifier.type
        if item.type == "MESH":
            corners, points = item.data.uv_layers[0].uv, item.data.vertices
            uvs, places = np.empty(2 * len(corners), np.float32), np.empty(3 * len(points), np.float32)
            corners.foreach_get("vector", uvs)
            points.foreach_get("co", places)
            found[f"{item.name}: mesh"] = np.round(np.concatenate([places, uvs]), 5).tolist()
        elif item.type == "LIGHT":
            found[f"{item.name}: light"] = (item.data.type, item.data.energy, tuple(item.data.color))
        elif item.type == "CAMERA":
            found[f"{item.name}: camera"] = item.data.lens
    for image in bpy.data.images:
        found[f"{image.name}: image"] = image.packed_file.data if image.packed_file else None
    return found


def parameters(scene):
    """The chosen model's values; objects and worlds by their names."""
    group = getattr(scene.nonlinear_rays, scene.nonlinear_rays.model)
    names = {definition.identifier for definition in group.bl_rna.properties} - {"rna_type", "name", "named_values"}
    values = {name: getattr(group, name) for name in sorted(names)}
    return {name: getattr(value, "name", value) for name, value in values.items()}


def drawn_triangles(scene):
    """Triangles of all meshes but the stand-ins of analytic spheres and what is hidden."""
    drawn = [item for item in scene.objects if item.type == "MESH" and not item.hide_render]
    meshes = [item.data for item in drawn if not item.nonlinear_rays.analytic_sphere]
    return sum(len(polygon.vertices) - 2 for mesh in meshes for polygon in mesh.polygons)


def distance_to_hole(item):
    """Metres from the origin to the nearest vertex; for a flat floor, to its plane."""
    points = np.array([item.matrix_world @ vertex.co for vertex in item.data.vertices])
    return abs(points[0, 2]) if np.ptp(points[:, 2]) == 0 else np.linalg.norm(points, axis=1).min()


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_small_whole_and_ready_to_render(name, opened):
    path = SAMPLES / f"{name}.blend"
    assert path.stat().st_size < 1_000_000
    scene = opened(path)
    assert scene.render.engine == "NONLINEAR_RAYS"
    assert (scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage) == (640, 480, 100)
    assert scene.view_settings.view_transform == "Standard"
    assert scene.nonlinear_rays.samples == 4
    assert scene.camera is not None and scene.camera.type == "CAMERA"
    images = [image for image in bpy.data.images if image.source == "FILE"]
    assert images and all(image.packed_file and image.size[0] > 0 for image in images)
    assert all(image.filepath == "" for image in images)
    assert not bpy.data.libraries
    assert drawn_triangles(scene) <= (968 if name == "suzanne" else 600)


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_names_no_place_on_the_machine_that_made_it(name):
    text = uncompressed(SAMPLES / f"{name}.blend")
    assert not re.findall(rb"/(?:work|root|tmp|home|var|usr)/[\w.-]+", text)


def uncompressed(path):
    """The file's bytes, through Blender."""
    import zstandard

    with path.open("rb") as file:
        return zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True).read()


@pytest.mark.parametrize("name", FIGURES[1:])
def test_it_is_the_very_test_scene(name, opened):
    straight = content(opened(SAMPLES / "test_scene.blend"))
    scene = opened(SAMPLES / f"{name}.blend")
    curved = content(scene)
    assert straight.pop("settings")[0] == "straight" and curved.pop("settings")[0] == scene.nonlinear_rays.model
    del straight["parameters"], curved["parameters"]
    own = {
        "schwarzschild": {"Black Hole"},
        "wormhole": {"Planet", "Planet: mesh", "Planet: image", "Stars: image"},
    }.get(name, set())
    assert {key: value for key, value in curved.items() if key not in own} == straight
    assert own <= curved.keys()
    assert TEST_OBJECTS.issubset(straight)
    spheres = {item.name for item in scene.objects if item.nonlinear_rays.analytic_sphere}
    assert spheres - {"Planet"} == ANALYTIC


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_has_the_parameters_of_its_preset(name, opened, extension):
    scene = opened(SAMPLES / f"{name}.blend")
    chosen = scene.nonlinear_rays
    stored = parameters(scene), chosen.model, chosen.observer, chosen.tolerance, chosen.segments, chosen.pipeline
    extension("addon.presets").apply(scene, PRESETS[name])
    assert stored == (
        *(parameters(scene), chosen.model, chosen.observer, chosen.tolerance, chosen.segments, chosen.pipeline),
    )


def test_the_far_side_has_what_the_wormhole_sample_says(opened):
    """The planet is within the mouth, |x| < b/2, and nothing else is; the far sky is another one."""
    scene = opened(SAMPLES / "wormhole.blend")
    mouth = scene.nonlinear_rays.wormhole.throat_radius / 2
    assert scene.nonlinear_rays.far_world.name == "Stars" != scene.world.name
    for item in scene.objects:
        if item.type == "MESH":
            assert (distance_to_hole(item) < mouth) == (item.name == "Planet"), item.name


def test_the_neutron_star_is_larger_than_its_horizon(opened):
    scene = opened(SAMPLES / "neutron_star.blend")
    star = scene.objects["Neutron Star"]
    assert star.nonlinear_rays.analytic_sphere and not star.location.length
    assert star.scale[0] == 4 > 2 * scene.nonlinear_rays.schwarzschild.mass


def test_the_volume_is_there(opened):
    scene = opened(SAMPLES / "volume_refraction.blend")
    assert scene.nonlinear_rays.refraction.volume == scene.objects["Fog"]
    assert scene.objects["Shape"].hide_render and not scene.objects["Fog"].hide_render


@pytest.mark.parametrize("name", ["schwarzschild", "suzanne"])
def test_nothing_is_inside_four_masses(name, opened):
    scene = opened(SAMPLES / f"{name}.blend")
    assert scene.nonlinear_rays.schwarzschild.mass * scene.nonlinear_rays.scale == 1
    assert all(distance_to_hole(item) > 4 for item in scene.objects if item.type == "MESH")


def test_suzanne_has_a_picture_and_stars(opened):
    scene = opened(SAMPLES / "suzanne.blend")
    suzanne = scene.objects["Suzanne"]
    uvs = np.array([corner.vector[:] for corner in suzanne.data.uv_layers.active.uv])
    assert len(np.unique(uvs.round(4), axis=0)) > 500
    nodes = scene.world.node_tree.nodes
    assert [tuple(node.image.size) for node in nodes if node.type == "TEX_ENVIRONMENT"] == [(1024, 512)]


@pytest.mark.parametrize("name", NAMES)
def test_an_analytic_sphere_stands_in_with_its_own_texture_coordinates(name, opened):
    for item in opened(SAMPLES / f"{name}.blend").objects:
        if not item.nonlinear_rays.analytic_sphere:
            continue
        assert len(set(item.scale)) == 1
        points = np.array([item.data.vertices[loop.vertex_index].co for loop in item.data.loops])
        uvs = np.array([corner.vector[:] for corner in item.data.uv_layers[0].uv])
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose(uvs[:, 1], np.arcsin(points[:, 2]) / np.pi + 0.5, atol=1e-3)
        side = np.abs(points[:, 2]) < 0.99
        turn = uvs[side, 0] - (np.arctan2(points[side, 1], points[side, 0]) / (2 * np.pi) + 0.5)
        np.testing.assert_allclose(turn, np.round(turn), atol=1e-5)


@makes_samples
@pytest.mark.parametrize("name", NAMES)
def test_the_files_here_are_what_build_writes(name, built, opened):
    anew = content(opened(built / f"{name}.blend"))
    assert content(opened(SAMPLES / f"{name}.blend")) == anew


@makes_samples
def test_an_unknown_name_is_refused_with_the_known_ones():
    command = [sys.executable, SAMPLES / "build.py", "teapot"]
    refused = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert refused.returncode == 2
    assert "teapot" in refused.stderr and "suzanne" in refused.stderr
