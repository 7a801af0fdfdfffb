"""The command line: frames, exit statuses, what is written and what is not."""

import os
import signal

import bpy
import numpy as np
import pytest


@pytest.fixture
def commands(extension):
    return extension("addon.commands")


@pytest.fixture
def scene(empty_file):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_file.collection.objects.link(camera)
    empty_file.camera = camera
    empty_file.render.resolution_x, empty_file.render.resolution_y = 16, 8
    return empty_file


@pytest.fixture
def fake_render(extension, monkeypatch):
    """trace.render replaced; returns the list of (scene, settings) it was called with."""
    calls = []
    trace, frame = extension("addon.core.trace"), extension("addon.core.frame")

    def render(core_scene, settings, *, progress=None, cancelled=None):
        calls.append((core_scene, settings))
        progress(0.5, "half")
        if cancelled():
            raise trace.Cancelled
        width, height = core_scene.camera.size
        return frame.Frame({"Combined": np.ones((height, width, 4), np.float32)})

    monkeypatch.setattr(trace, "render", render)
    return calls


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1", [1]),
        ("1-4", [1, 2, 3, 4]),
        ("1-10x4", [1, 5, 9]),
        ("1,3,7-9", [1, 3, 7, 8, 9]),
        ("3, 1", [3, 1]),
        ("-2--1", [-2, -1]),
        ("2,1-3", [2, 1, 3]),
    ],
)
def test_frames(commands, text, frames):
    assert commands.parse_frames(text) == frames


@pytest.mark.parametrize("text", ["", "a", "1-", "5-1", "1-4x0", "1,,2", "1.5", "1-99999999999"])
def test_frames_that_make_no_sense_are_named(commands, text):
    with pytest.raises(commands.UsageError):
        commands.parse_frames(text)


def test_each_frame_becomes_a_png_and_an_exr(commands, scene, fake_render, tmp_path, capsys):
    folder = tmp_path / "new" / "folder"
    assert commands.main(["render", "--frames", "3-4", "--output", str(folder)]) == 0
    assert sorted(os.listdir(folder)) == [
        f"untitled_{frame}.{kind}" for frame in ("0003", "0004") for kind in ("exr", "png")
    ]
    said = capsys.readouterr().out
    assert str(folder / "untitled_0004.png") in said
    assert "Milliseconds" in said


def test_default_is_the_current_frame(commands, scene, fake_render, tmp_path):
    scene.frame_set(12)
    assert commands.main(["render", "--output", str(tmp_path)]) == 0
    assert (tmp_path / "untitled_0012.png").exists()


def test_frames_are_evaluated_for_render(commands, scene, fake_render, tmp_path):
    """Animation, visibility and modifiers for render, not for the viewport."""
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    modifier = plane.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type, modifier.levels, modifier.render_levels = "SIMPLE", 0, 2
    plane.hide_viewport = True
    for frame, x in ((1, 0.0), (2, 5.0)):
        plane.location.x = x
        plane.keyframe_insert("location", frame=frame)
    assert commands.main(["render", "--frames", "1,2", "--output", str(tmp_path)]) == 0
    first, second = (core_scene.triangles for core_scene, _settings in fake_render)
    assert len(first) == len(second) == 32
    assert (second.positions - first.positions)[..., 0] == pytest.approx(5.0)


def user_images():
    """Every render makes Blender's own Render Result."""
    return {image.name for image in bpy.data.images} - {"Render Result", "Viewer Node"}


def test_the_file_is_left_as_it_was(commands, scene, fake_render, tmp_path):
    scene.render.engine = "BLENDER_WORKBENCH"
    before = (scene.render.resolution_x, scene.render.image_settings.file_format, len(bpy.data.scenes), user_images())
    assert commands.main(["render", "--frames", "1", "--output", str(tmp_path)]) == 0
    after = (scene.render.resolution_x, scene.render.image_settings.file_format, len(bpy.data.scenes), user_images())
    assert before == after
    assert scene.render.engine == "BLENDER_WORKBENCH"


def one_line(capsys):
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("Frame ")]
    assert len(lines) == 1, lines
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ([], 2, "required"),
        (["paint"], 2, "paint"),
        (["render", "--frames", "x"], 2, "'x'"),
        (["render", "--layer", "None such"], 2, "None such"),
        (["render", "--output", "/proc/none"], 1, "/proc/none"),
        (["report", "--frames", "1"], 2, "--frames"),
        (["report", "--layer", "None such"], 2, "None such"),
        (["report", "--output", "/proc/none"], 1, "/proc/none"),
    ],
)
def test_a_wrong_command_line_says_why_in_one_line(commands, scene, capsys, arguments, status, words):
    assert commands.main(arguments) == status
    assert words in one_line(capsys)


@pytest.mark.parametrize(("command", "option"), [("render", "--frames"), ("report", "--quick")])
def test_help_is_no_failure(commands, capsys, command, option):
    assert commands.main([command, "--help"]) == 0
    assert option in capsys.readouterr().out


def test_no_camera_is_one_line(commands, empty_file, tmp_path, capsys):
    assert commands.main(["render", "--frames", "1", "--output", str(tmp_path)]) == 1
    assert "no camera" in one_line(capsys)
    assert os.listdir(tmp_path) == []


def test_a_failure_of_the_renderer_is_one_line_and_leaves_no_file(
    commands, scene, extension, monkeypatch, tmp_path, capsys
):
    def render(*_args, **_kwargs):
        raise extension("addon.core.device").DeviceError("No OpenGL here.\nInstall it.")

    monkeypatch.setattr(extension("addon.core.trace"), "render", render)
    assert commands.main(["render", "--frames", "1", "--output", str(tmp_path)]) == 1
    assert "No OpenGL here. Install it." in one_line(capsys)
    assert os.listdir(tmp_path) == []


def test_a_file_that_cannot_be_written_leaves_nothing_half_done(
    commands, scene, fake_render, extension, monkeypatch, tmp_path, capsys
):
    def save(_frame, path, _layer):
        raise OSError(f"Cannot write '{path}'.")

    monkeypatch.setattr(extension("addon.core.frame").Frame, "save", save)
    assert commands.main(["render", "--frames", "1", "--output", str(tmp_path)]) == 1
    assert "Cannot write" in one_line(capsys)
    assert os.listdir(tmp_path) == []


def test_ctrl_c_stops_and_leaves_no_file(commands, scene, fake_render, extension, monkeypatch, tmp_path, capsys):
    trace = extension("addon.core.trace")
    finished = trace.render

    def render(core_scene, settings, *, progress, cancelled):
        os.kill(os.getpid(), signal.SIGINT)
        return finished(core_scene, settings, progress=progress, cancelled=cancelled)

    monkeypatch.setattr(trace, "render", render)
    before = signal.getsignal(signal.SIGINT)
    assert commands.main(["render", "--frames", "1-3", "--output", str(tmp_path)]) == 130
    assert "Stopped" in one_line(capsys)
    assert os.listdir(tmp_path) == []
    assert signal.getsignal(signal.SIGINT) is before
