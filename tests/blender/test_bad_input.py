"""Scenes that cannot be rendered, or only in part: one clear error or a counted warning each, never NaN, and nothing
else changes. Each is a .blend of its own, opened and rendered by the extension's command; a good one is rendered after.
"""

import hashlib
import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field

import bpy
import numpy as np
import OpenEXR
import pytest

from tools.bpy_extension import REPOSITORY

SIZE = 32
NAN = math.nan


@dataclass
class Case:
    """spoil(scene, folder) changes the good scene. error: all of stderr. warnings: all of them.

    hit : whether rays still meet an object
    """

    spoil: object
    error: str = ""
    warnings: list[str] = field(default_factory=list)
    hit: bool = True


def good_scene():
    """A textured cube before a grey sky; nothing to say."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.world = with_nodes(bpy.data.worlds.new("Sky"))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location = (0, 0, 6)
    scene.collection.objects.link(scene.camera)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(with_nodes(bpy.data.materials.new("Paint")))
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    light.location = (2, 1, 5)
    scene.collection.objects.link(light)
    scene.nonlinear_rays.pass_status = scene.nonlinear_rays.pass_position = scene.nonlinear_rays.pass_normal = True
    return scene


def with_nodes(owner):
    if owner.node_tree is None:
        owner.use_nodes = True
    return owner


def principled():
    return bpy.data.materials["Paint"].node_tree.nodes["Principled BSDF"]


def background():
    return next(node for node in bpy.data.worlds["Sky"].node_tree.nodes if node.bl_idname == "ShaderNodeBackground")


def new_mesh(scene, name, vertices, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def without_camera(scene, _folder):
    bpy.data.objects.remove(scene.camera)


def with_a_light_for_camera(scene, _folder):
    scene.camera = bpy.data.objects["Lamp"]


def camera_is_nowhere(scene, _folder):
    scene.camera.location.x = NAN


def camera_has_no_size(scene, _folder):
    scene.camera.scale = (0, 0, 0)


def camera_has_no_lens(scene, _folder):
    scene.camera.data.shift_x = NAN


def camera_in_the_hole(scene, _folder):
    scene.nonlinear_rays.model, scene.camera.location = "schwarzschild", (0, 0, 1.5)


def empty_scene(scene, _folder):
    for obj in list(scene.objects):
        if obj != scene.camera:
            bpy.data.objects.remove(obj)


def no_pixels(scene, _folder):
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.resolution_percentage = 1


def too_many_pixels(scene, _folder):
    scene.render.resolution_x = scene.render.resolution_y = 65536


def empty_border(scene, _folder):
    scene.render.use_border = True
    scene.render.border_min_x = scene.render.border_max_x = 0.5


def textured(image):
    node = bpy.data.materials["Paint"].node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    bpy.data.materials["Paint"].node_tree.links.new(node.outputs["Color"], principled().inputs["Base Color"])


def texture_is_text(_scene, folder):
    (folder / "broken.png").write_text("This is not a picture.")
    image = bpy.data.images.new("Bark", 1, 1)
    image.source, image.filepath = "FILE", str(folder / "broken.png")
    textured(image)


def texture_is_cut_off(_scene, folder):
    image = bpy.data.images.new("Whole", 64, 64)
    image.filepath_raw, image.file_format = str(folder / "whole.png"), "PNG"
    image.save()
    (folder / "cut.png").write_bytes((folder / "whole.png").read_bytes()[:40])
    bpy.data.images.remove(image)
    image = bpy.data.images.new("Bark", 1, 1)
    image.source, image.filepath = "FILE", str(folder / "cut.png")
    textured(image)


def texture_is_lost(_scene, _folder):
    image = bpy.data.images.new("Bark", 1, 1)
    image.source, image.filepath = "FILE", "//nowhere/bark.png"
    textured(image)


def sky_is_lost(scene, _folder):
    image = bpy.data.images.new("Stars", 1, 1)
    image.source, image.filepath = "FILE", "//nowhere/stars.exr"
    tree = scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    tree.links.new(texture.outputs["Color"], background().inputs["Color"])


def nan_vertex(scene, _folder):
    new_mesh(scene, "Torn", [(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, NAN, 0)], [(0, 1, 2), (0, 2, 3)])


def infinite_vertex(scene, _folder):
    new_mesh(scene, "Torn", [(0, 0, 0), (3, 0, 0), (3, 3, 0), (math.inf, 3, 0)], [(0, 1, 2), (0, 2, 3)])


def object_is_nowhere(scene, _folder):
    new_mesh(scene, "Lost", [(0, 0, 0), (3, 0, 0), (3, 3, 0)], [(0, 1, 2)]).location = (0, NAN, 0)


def zero_area(scene, _folder):
    corners = [(0, 0, 0), (3, 0, 0), (3, 3, 0), (6, 0, 0), (3, 0, 0)]
    new_mesh(scene, "Flat", corners, [(0, 1, 2), (0, 1, 3), (0, 1, 4)])


def scaled_to_nothing(scene, _folder):
    new_mesh(scene, "Squashed", [(0, 0, 0), (3, 0, 0), (3, 3, 0)], [(0, 1, 2)]).scale = (0, 0, 0)


def no_faces(scene, _folder):
    new_mesh(scene, "Points", [(0, 0, 0), (3, 0, 0)], [])


def no_vertices(scene, _folder):
    new_mesh(scene, "Nothing", [], [])


def far_away(scene, _folder):
    new_mesh(scene, "Far", [(1e30, 0, 0), (2e30, 0, 0), (1e30, 1e30, 0)], [(0, 1, 2)])


def paint_is_nan(_scene, _folder):
    principled().inputs["Base Color"].default_value = (NAN, 1, 1, 1)
    principled().inputs["Roughness"].default_value = NAN


def glow_is_too_bright(_scene, _folder):
    principled().inputs["Emission Color"].default_value = (1e38, 1, 1, 1)
    principled().inputs["Emission Strength"].default_value = 1e6


def sky_is_nan(_scene, _folder):
    background().inputs["Strength"].default_value = NAN


def lamp_is_infinite(_scene, _folder):
    bpy.data.lights["Lamp"].energy = math.inf


def sphere_is_an_egg(_scene, _folder):
    cube = bpy.data.objects["Cube"]
    cube.nonlinear_rays.analytic_sphere, cube.scale = True, (1, 2, 1)


def model_without_scale(scene, _folder):
    scene.nonlinear_rays.scale = 0.0


def center_is_nowhere(scene, _folder):
    scene.nonlinear_rays.model = "schwarzschild"
    scene.nonlinear_rays.center = new_mesh(scene, "Hole", [], [])
    scene.nonlinear_rays.center.location.x = NAN


CASES = {
    "no camera": Case(without_camera, "no camera. Add one"),
    "a light for camera": Case(with_a_light_for_camera, "'Lamp' is set as the scene's camera but is no camera"),
    "camera nowhere": Case(camera_is_nowhere, "'Camera': the camera's transform is not a number"),
    "camera of no size": Case(camera_has_no_size, "'Camera': the camera's transform has no direction"),
    "camera shift nan": Case(camera_has_no_lens, "'Camera': the picture's edges are nan"),
    "camera in the hole": Case(camera_in_the_hole, "r = 1.5, inside the horizon"),
    "empty scene": Case(empty_scene, hit=False),
    "no pixels": Case(no_pixels, "0 × 0 pixels, but each side must lie in 1..65536"),
    "too many pixels": Case(too_many_pixels, r"needs \d+ MiB, but \d+ MiB are allowed. Lower the resolution"),
    "empty border": Case(empty_border, r"region \(16, 0, 16, 32\) is empty"),
    "texture of text": Case(texture_is_text, warnings=[r"'Paint': image 'Bark' cannot be read \('.*broken.png'\)"]),
    "texture cut off": Case(texture_is_cut_off, warnings=[r"'Paint': image 'Bark' cannot be read \('.*cut.png'\)"]),
    "texture lost": Case(texture_is_lost, warnings=[r"'Paint': image 'Bark' cannot be read \('//nowhere/bark.png'\)"]),
    "sky lost": Case(sky_is_lost, warnings=[r"'Sky': image 'Stars' cannot be read \('//nowhere/stars.exr'\)"]),
    "nan vertex": Case(nan_vertex, warnings=["'Torn': 1 of 2 triangles .* not finite and were skipped"]),
    "infinite vertex": Case(infinite_vertex, warnings=["'Torn': 1 of 2 triangles .* not finite and were skipped"]),
    "object nowhere": Case(object_is_nowhere, warnings=["'Lost': 1 of 1 triangles .* not finite and were skipped"]),
    "zero area": Case(zero_area, warnings=["'Flat': 2 of 3 triangles have no area and were skipped"]),
    "scaled to nothing": Case(scaled_to_nothing, warnings=["'Squashed': 1 of 1 triangles have no area"]),
    "no faces": Case(no_faces, warnings=["'Points' has vertices but no faces"]),
    "no vertices": Case(no_vertices),
    "far away": Case(far_away, warnings=["1 of 13 triangles .* too far away, and were skipped"]),
    "paint nan": Case(
        paint_is_nan,
        warnings=[r"'Paint': the Base Color of node .* is \(nan, 1, 1\)", "'Paint': the Roughness of node .* is nan"],
    ),
    "glow too bright": Case(glow_is_too_bright, warnings=[r"'Paint': the Emission Color of .* is \(1e\+44, "]),
    "sky nan": Case(sky_is_nan, warnings=["'Sky': its colour or its strength is not a number"]),
    "lamp infinite": Case(lamp_is_infinite, warnings=["'Lamp': its transform or its power is not finite"]),
    "an egg": Case(sphere_is_an_egg, r"'Cube': an analytic sphere needs .*\(1, 2, 1\)"),
    "model without scale": Case(model_without_scale, "model's scale is zero"),
    "center nowhere": Case(center_is_nowhere, "model's place is not a number"),
}


@pytest.fixture
def command(extension, tmp_path, capsys):
    """command(path) renders the file: exit status, warnings, errors (one a line), passes or None."""

    def render(path):
        folder = tmp_path / f"out of {path.stem}"
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
        capsys.readouterr()
        exit_status = extension("addon.commands").main(["render", "--frames", "1", "--output", str(folder)])
        said = capsys.readouterr()
        written = sorted(file.name for file in folder.iterdir())
        passes = None
        if exit_status == 0:
            assert written == [f"{path.stem}_0001.exr", f"{path.stem}_0001.png"]
            passes = read_exr(folder / written[0])
        else:
            assert written == []
        warnings = re.findall(r"^  Warning: (.*)$", said.out, re.MULTILINE)
        errors = [line for line in said.err.splitlines() if not line.startswith("Frame ")]
        return exit_status, warnings, errors, passes

    yield render
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def read_exr(path):
    """Channel name without its layer -> (height, width)."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name.split(".", 1)[1]: np.array(channel.pixels) for name, channel in file.parts[0].channels.items()}


def file_hash(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def datablocks():
    """Everything in the file by kind and name, but for the picture that Blender keeps of a render."""
    kinds = ("scenes", "objects", "meshes", "materials", "images", "worlds", "lights", "cameras", "collections")
    return {
        kind: sorted(item.name for item in getattr(bpy.data, kind) if item.name != "Render Result") for kind in kinds
    }


@pytest.mark.parametrize("name", CASES, ids=lambda name: name.replace(" ", "_"))
def test_a_bad_scene(command, extension, tmp_path, name):
    case = CASES[name]
    good, bad = tmp_path / "good.blend", tmp_path / "bad.blend"
    good_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(good))
    case.spoil(good_scene(), tmp_path)
    bpy.ops.wm.save_as_mainfile(filepath=str(bad))
    bpy.ops.wm.open_mainfile(filepath=str(bad), load_ui=False)
    before = file_hash(bad), datablocks(), bpy.data.is_dirty

    exit_status, warnings, errors, passes = command(bad)
    assert (file_hash(bad), datablocks(), bpy.data.is_dirty) == before
    if case.error:
        assert exit_status == 1 and len(errors) == 1, errors
        assert re.search(case.error, errors[0])
    else:
        assert exit_status == 0 and errors == []
        assert len(warnings) == len(case.warnings)
        for expected, warning in zip(case.warnings, warnings, strict=True):
            assert re.search(expected, warning)
        assert all(np.isfinite(pixels).all() for pixels in passes.values())
        assert (passes["Status.X"] == 1).any() == case.hit
        assert set(np.unique(passes["Status.X"])) <= {1, 2}

    exit_status, warnings, errors, passes = command(good)
    assert (exit_status, warnings, errors) == (0, [], [])
    assert 0.2 < (passes["Status.X"] == 1).mean() < 0.4


def test_an_empty_scene_shows_the_sky(command, tmp_path):
    empty_scene(good_scene(), tmp_path)
    background().inputs["Color"].default_value = (0.25, 0.5, 0.75, 1.0)
    path = tmp_path / "sky.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    _status, _warnings, _errors, passes = command(path)
    for letter, value in zip("RGB", (0.25, 0.5, 0.75), strict=True):
        assert (passes[f"Combined.{letter}"] == value).all()
    assert (passes["Status.X"] == 2).all()


def test_a_picture_that_cannot_be_read_is_magenta(command, tmp_path):
    texture_is_lost(good_scene(), tmp_path)
    path = tmp_path / "magenta.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    _status, _warnings, _errors, passes = command(path)
    hit = passes["Status.X"] == 1
    assert (passes["Combined.R"][hit] > 0.01).all() and (passes["Combined.B"][hit] > 0.01).all()
    # Green is the white highlight alone, which is the same in the other colours.
    assert (passes["Combined.G"][hit] < 0.5 * passes["Combined.R"][hit]).all()


@pytest.mark.parametrize(
    ("width", "height"), [(0, 10), (10, 0), (-1, 10), (100_000, 10), (10, 100_000), (100_000, 100_000), (0, 0)]
)
def test_sizes_that_are_refused(extension, width, height):
    """By the export, before anything is read; by core as well, which scripts call on their own."""
    scene_module = extension("addon.core.scene")
    good_scene()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    model, placement = extension("addon.core.models").MODELS["straight"](), scene_module.Placement()
    export = extension("addon.export").export_scene
    with pytest.raises(scene_module.SceneError, match=f"{width} × {height} pixels, but each side must lie in 1..65536"):
        export(depsgraph, model=model, placement=placement, width=width, height=height)

    camera = scene_module.Camera(np.eye(4), (-1, 1, -1, 1), width, height)
    trace, settings = extension("addon.core.trace"), extension("addon.core.settings").Settings()
    with pytest.raises(scene_module.SceneError, match=f"{width} x {height} pixels"):
        trace.render(scene_module.Scene(camera, model), settings)

    scene = export(depsgraph, model=model, placement=placement, width=8, height=8)
    assert trace.render(scene, settings).size == (8, 8)


def test_the_widest_picture_is_right_or_refused(extension):
    """65536 pixels in a row are rendered, tile by tile; a row beyond the memory limit is refused before it is made."""
    good_scene()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    scene_module, trace = extension("addon.core.scene"), extension("addon.core.trace")
    model, placement = extension("addon.core.models").MODELS["straight"](), scene_module.Placement()
    settings = extension("addon.core.settings").Settings(passes=("Combined",))
    export = extension("addon.export").export_scene
    frame = trace.render(export(depsgraph, model=model, placement=placement, width=65536, height=1), settings)
    assert frame.size == (65536, 1) and np.isfinite(frame.passes["Combined"]).all()
    with pytest.raises(scene_module.SceneError, match="MiB are allowed"):
        trace.render(export(depsgraph, model=model, placement=placement, width=65536, height=65536), settings)


def make_render(blend, out, **environment):
    """tools/render.py in a process of its own, as `make render` starts it."""
    command = [sys.executable, "tools/render.py", str(blend), "--output", str(out)]
    environment = {**os.environ, **environment}
    return subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=120)


def test_without_an_egl_device(extension, tmp_path):
    """`make render` where OpenGL has no driver: one line, no file, the .blend as it was."""
    blend, out = tmp_path / "good.blend", tmp_path / "out"
    good_scene()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    before = file_hash(blend)
    run = make_render(blend, out, __EGL_VENDOR_LIBRARY_FILENAMES="/nonexistent")
    assert run.returncode == 1
    lines = [line for line in run.stderr.splitlines() if line]
    assert len(lines) == 1, run.stderr
    assert "No OpenGL 3.3 device" in lines[0] and "apt install libegl1" in lines[0]
    assert list(out.iterdir()) == []
    assert file_hash(blend) == before


def test_an_error_of_the_export_is_one_line_in_a_shell_too(extension, tmp_path):
    blend, out = tmp_path / "no pixels.blend", tmp_path / "out"
    no_pixels(good_scene(), tmp_path)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    run = make_render(blend, out)
    assert run.returncode == 1 and list(out.iterdir()) == []
    assert len(run.stderr.splitlines()) == 1, run.stderr
