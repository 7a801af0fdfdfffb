"""The report from Blender: the command, the button, and the settings that it recommends."""

import json
import os
import signal

import bpy
import pytest

ROW = {
    "model": "schwarzschild",
    "pipeline": "fused",
    "integrator": "bogacki_shampine_32",
    "step_control": "embedded",
    "value": 1e-4,
    "goal_px": 1.0,
    "promised_px": 0.2,
    "rendered_px": 0.3,
    "ns_per_ray": 300.0,
}


@pytest.fixture
def scene(empty_file):
    """A black hole of mass 1, seen from 20 lengths away."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 20.0
    empty_file.collection.objects.link(camera)
    empty_file.camera = camera
    empty_file.render.resolution_x, empty_file.render.resolution_y = 16, 12
    empty_file.nonlinear_rays.model = "schwarzschild"
    return empty_file


@pytest.fixture
def few_methods(extension, monkeypatch):
    """Of the many that the report tries, one; its numbers are measured all the same."""
    work_precision = extension("addon.core.report.work_precision")
    method = extension("addon.core.report.methods").Method("fused", "dormand_prince_54", "embedded")
    monkeypatch.setattr(work_precision, "METHODS", (method,))


def panel_settings(scene, extension):
    """What a render of the scene would take."""
    return extension("addon.capture").capture(scene, bpy.context.view_layer)[1]


def test_the_command_writes_the_page_and_its_numbers(scene, extension, few_methods, tmp_path, capsys):
    folder = tmp_path / "new" / "report"
    assert extension("addon.commands").main(["report", "--quick", "--output", str(folder)]) == 0
    said = capsys.readouterr()
    assert str(folder / "index.html") in said.out and "100 %" in said.err
    content = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert {row["model"] for row in content["work_precision"]} == {"schwarzschild"}
    assert content["environment"]["Blender"] == bpy.app.version_string
    assert content["environment"]["Command"].endswith(f"report --output {folder} --quick")
    assert "Dangers" in (folder / "index.html").read_text(encoding="utf-8")


def test_ctrl_c_writes_no_report(scene, extension, monkeypatch, tmp_path, capsys):
    def write(folder, *, progress, **_rest):
        os.kill(os.getpid(), signal.SIGINT)
        progress(0.5, "half")

    monkeypatch.setattr(extension("addon.core.report.make_report"), "write", write)
    assert extension("addon.commands").main(["report", "--output", str(tmp_path)]) == 130
    assert "Stopped" in capsys.readouterr().err
    assert os.listdir(tmp_path) == []


def test_the_button_recommends_and_the_recommendation_is_what_was_measured(scene, extension, few_methods, tmp_path):
    """After Use This Setting, a render takes the integrator and the tolerance in radians of the report's row."""
    scene.nonlinear_rays.report_folder = str(tmp_path)
    scene.nonlinear_rays.integrator = "verlet"
    scene.nonlinear_rays.step_control = "constant"
    assert bpy.ops.nonlinear_rays.report() == {"FINISHED"}
    content = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    rows = content["recommended"]
    found = extension("addon.job").Button.recommended
    assert [one.goal for one in found] == [row["goal_px"] for row in rows] and rows
    for index, row in enumerate(rows):
        assert bpy.ops.nonlinear_rays.use_recommended(index=index) == {"FINISHED"}
        settings = panel_settings(scene, extension)
        assert {name: getattr(settings, name) for name in ("pipeline", "integrator", "step_control")} == {
            name: row[name] for name in ("pipeline", "integrator", "step_control")
        }
        assert settings.tolerance == pytest.approx(row["value"], rel=1e-6)  # a float32 in Blender
        assert found[index].error < row["goal_px"]
        assert found[index].nanoseconds == row["ns_per_ray"] > 0.0
        assert any(each["value"] == row["value"] and not each["papers_default"] for each in content["work_precision"])


def test_a_recommended_step_is_set(scene, extension):
    row = ROW | {"pipeline": "paper", "integrator": "euler", "step_control": "constant", "value": 0.125}
    recommended = extension("addon.recommended")
    recommended.apply(scene, recommended.of_row(row, 1e-3))
    settings = panel_settings(scene, extension)
    assert (settings.pipeline, settings.integrator, settings.step_control) == ("paper", "euler", "constant")
    assert settings.step == 0.125


def test_a_tolerance_after_a_step_leaves_no_step(scene, extension):
    scene.nonlinear_rays.use_custom_step, scene.nonlinear_rays.step = True, 3.0
    recommended = extension("addon.recommended")
    recommended.apply(scene, recommended.of_row(ROW, 1e-3))
    assert scene.nonlinear_rays.tolerance == pytest.approx(0.1)
    assert panel_settings(scene, extension).step is None


def test_beside_an_unsaved_file_is_nowhere(scene):
    with pytest.raises(RuntimeError, match="not saved"):
        bpy.ops.nonlinear_rays.report()


def test_a_recommendation_that_is_not_there_is_refused(scene, extension, monkeypatch):
    recommended = extension("addon.recommended").of_row(ROW, 1e-3)
    monkeypatch.setattr(extension("addon.job").Button, "recommended", (recommended,))
    with pytest.raises(RuntimeError, match="1 recommendations"):
        bpy.ops.nonlinear_rays.use_recommended(index=1)
