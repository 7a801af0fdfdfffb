"""The render engine: what F12 writes, in which layer and where in the picture, and what happens when it cannot."""

import time

import bpy
import numpy as np
import pytest

OpenEXR = pytest.importorskip("OpenEXR")


@pytest.fixture
def scene(empty_file):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_file.collection.objects.link(camera)
    empty_file.camera = camera
    empty_file.render.engine = "NONLINEAR_RAYS"
    empty_file.render.resolution_x, empty_file.render.resolution_y = 17, 11
    return empty_file


@pytest.fixture
def fake_render(extension, monkeypatch):
    """Each pass shows the pixel's own column, row and, in the third channel, 0.5; alpha is 1."""
    trace, frame, core = (extension(f"addon.core.{name}") for name in ("trace", "frame", "settings"))
    calls = []

    def render(core_scene, settings, *, progress=None, cancelled=None):
        calls.append((core_scene, settings))
        x0, y0, x1, y1 = core_scene.camera.pixel_box
        rows, columns = np.mgrid[y0:y1, x0:x1]
        picture = np.stack([columns, rows, np.full_like(rows, 0.5, dtype=float), np.ones_like(rows)], -1).astype(
            np.float32
        )
        return frame.Frame({name: picture[..., : len(core.PASS_CHANNELS[name])].copy() for name in settings.passes})

    monkeypatch.setattr(trace, "render", render)
    return calls


def write_exr(scene, path):
    """Render to a multi-layer EXR and return its channels, name -> (rows, columns), row 0 at the bottom."""
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "MULTI_LAYER_IMAGE"
    output.file_format, output.color_depth = "OPEN_EXR_MULTILAYER", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    channels = {}
    for part in OpenEXR.File(str(path), separate_channels=True).parts:
        prefix = "" if part.name() in (None, "") else f"{part.name()}."
        for name, channel in part.channels.items():
            full = name if name.count(".") >= 2 else prefix + name
            channels[full] = channel.pixels[::-1]
    return channels


def channel(channels, end):
    found = [pixels for name, pixels in channels.items() if name.endswith(end)]
    assert len(found) == 1, (end, sorted(channels))
    return found[0]


def test_passes_reach_the_file_the_right_way_up(scene, fake_render, tmp_path):
    scene.nonlinear_rays.pass_depth = scene.nonlinear_rays.pass_normal = True
    channels = write_exr(scene, tmp_path / "f12.exr")
    columns, rows = np.arange(17), np.arange(11)[:, None]
    assert np.array_equal(channel(channels, "Combined.R"), np.broadcast_to(columns, (11, 17)))
    assert np.array_equal(channel(channels, "Combined.G"), np.broadcast_to(rows, (11, 17)))
    assert np.array_equal(channel(channels, "Normal.Y"), np.broadcast_to(rows, (11, 17)))
    assert np.array_equal(channel(channels, "Depth.V"), np.broadcast_to(columns, (11, 17)))
    assert not any("Steps" in name for name in channels)


def test_each_view_layer_is_rendered(scene, fake_render, tmp_path):
    scene.view_layers.new("Second")
    channels = write_exr(scene, tmp_path / "layers.exr")
    names = {name.split(".")[0] for name in channels}
    assert {"ViewLayer", "Second"} <= names
    assert len(fake_render) == 2


@pytest.mark.parametrize("crop", [False, True])
@pytest.mark.parametrize("border", [(0.25, 0.75, 0.1, 0.9), (0.0, 0.5, 0.5, 1.0), (0.33, 0.67, 0.34, 0.66)])
def test_a_border_is_a_part_of_the_whole_picture(scene, fake_render, tmp_path, border, crop):
    render = scene.render
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = border
    channels = write_exr(scene, tmp_path / "border.exr")
    ((core_scene, _settings),) = fake_render
    x0, y0, x1, y1 = core_scene.camera.region
    assert (core_scene.camera.width, core_scene.camera.height) == (17, 11)
    red, green = channel(channels, "Combined.R"), channel(channels, "Combined.G")
    if crop:
        assert red.shape == (y1 - y0, x1 - x0)
    else:
        assert red.shape == (11, 17)
        red, green = red[y0:y1, x0:x1], green[y0:y1, x0:x1]
    assert np.array_equal(red[0], np.arange(x0, x1))
    assert np.array_equal(green[:, 0], np.arange(y0, y1))


def test_an_error_is_reported_and_writes_no_file(scene, extension, monkeypatch, tmp_path):
    def render(*_args, **_kwargs):
        raise extension("addon.core.scene").SceneError("The scene is broken. Mend it.")

    monkeypatch.setattr(extension("addon.core.trace"), "render", render)
    scene.render.filepath = str(tmp_path / "broken.png")
    with pytest.raises(RuntimeError, match=r"The scene is broken\. Mend it\."):
        bpy.ops.render.render(write_still=True)
    assert list(tmp_path.iterdir()) == []


def test_animation_renders_every_frame(scene, fake_render, tmp_path):
    scene.frame_start, scene.frame_end = 2, 4
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    assert len(list(tmp_path.iterdir())) == 3


def test_the_button_from_a_script_replaces_the_image(scene, fake_render):
    scene.render.engine = "BLENDER_WORKBENCH"
    assert bpy.ops.nonlinear_rays.render() == {"FINISHED"}
    image = bpy.data.images["Nonlinear Rays"]
    assert tuple(image.size) == (17, 11)
    assert image.pixels[4 * (17 * 3 + 5) + 1] == 3.0
    address = image.as_pointer()
    scene.render.resolution_percentage = 50
    assert bpy.ops.nonlinear_rays.render() == {"FINISHED"}
    assert bpy.data.images["Nonlinear Rays"].as_pointer() == address
    assert tuple(image.size) == (8, 5)
    assert (scene.render.engine, [one.name for one in bpy.data.scenes]) == ("BLENDER_WORKBENCH", [scene.name])


def test_the_button_keeps_the_users_render_result(scene, fake_render, tmp_path):
    """The capture renders a copy of the scene: what F12 made is still there to be saved."""
    bpy.ops.render.render()
    assert bpy.ops.nonlinear_rays.render() == {"FINISHED"}
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "IMAGE"
    output.file_format = "OPEN_EXR"
    bpy.data.images["Render Result"].save_render(str(tmp_path / "kept.exr"), scene=scene)
    assert tuple(bpy.data.images.load(str(tmp_path / "kept.exr")).size) == (17, 11)


def test_the_button_without_a_camera_reports_it(empty_file):
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.nonlinear_rays.render()


def test_a_job_can_be_cancelled(extension, monkeypatch):
    trace, job = extension("addon.core.trace"), extension("addon.job")

    def render(_scene, _settings, *, progress, cancelled):
        while not cancelled():
            progress(0.25, "")
            time.sleep(0.01)
        raise trace.Cancelled

    monkeypatch.setattr(trace, "render", render)
    scene = extension("addon.core.scene").Scene(camera=None, model=None)
    running = job.render_job(scene, extension("addon.core.settings").Settings())
    assert not running.wait(0.2)
    assert running.fraction == 0.25
    assert "25 %" in running.text
    job.stop_all()
    assert running.done
    assert running.was_cancelled


def test_viewport_camera_is_the_viewports(extension):
    """The middle and the corners of clip space go back where they came from."""
    view_camera = extension("addon.viewport").view_camera
    near, far = 0.1, 100.0
    perspective = np.array([[2.0, 0, 0.3, 0], [0, 3.0, -0.2, 0], [0, 0, -1.0, -0.2], [0, 0, -1.0, 0]])
    camera = view_camera(np.eye(4), perspective, True, 40, 20)
    left, right, bottom, top = camera.window
    for x, y, clip in ((left, bottom, (-1, -1)), (right, top, (1, 1))):
        projected = perspective @ [5 * x, 5 * y, -5.0, 1.0]
        assert projected[:2] / projected[3] == pytest.approx(clip)
    orthographic = np.array([[0.5, 0, 0, 0.1], [0, 0.25, 0, -0.3], [0, 0, -2 / (far - near), -1], [0, 0, 0, 1.0]])
    left, right, bottom, top = view_camera(np.eye(4), orthographic, False, 40, 20).window
    assert (orthographic @ [left, bottom, -5.0, 1.0])[:2] == pytest.approx([-1, -1])
    assert (orthographic @ [right, top, -5.0, 1.0])[:2] == pytest.approx([1, 1])


@pytest.mark.parametrize("crop", [False, True])
def test_the_button_renders_the_border_only(scene, fake_render, crop):
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    scene.render.border_min_x, scene.render.border_max_x = 0.0, 0.5
    assert bpy.ops.nonlinear_rays.render() == {"FINISHED"}
    assert tuple(bpy.data.images["Nonlinear Rays"].size) == (8, 11)


def test_the_real_renderer_fills_every_pass(scene, extension, tmp_path):
    """A plane before the camera with a small hole beside it: hits in the middle, the sky around it."""
    bpy.ops.mesh.primitive_plane_add(size=3.0, location=(0.0, 0.0, -10.0))
    plane = bpy.context.object
    plane.pass_index = 7
    chosen = scene.nonlinear_rays
    chosen.model = "schwarzschild"
    hole = bpy.data.objects.new("Hole", None)
    hole.location = (4.0, 0.0, -10.0)
    scene.collection.objects.link(hole)
    chosen.scale, chosen.center = 0.2, hole
    names = extension("addon.properties").OPTIONAL_PASSES
    for name in names:
        setattr(chosen, extension("addon.properties").pass_property(name), True)
    channels = write_exr(scene, tmp_path / "real.exr")
    assert channel(channels, "Object Index.X")[0, 8] == 0.0
    assert channel(channels, "Object Index.X")[5, 8] == 7.0
    assert channel(channels, "Position.Z")[5, 8] == pytest.approx(-10.0, abs=1e-3)
    assert {"Combined", *names} <= {name.split(".")[-2] for name in channels}
    assert np.isfinite(np.stack(list(channels.values()))).all()
