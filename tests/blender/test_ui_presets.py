"""The presets: each applies cleanly, and gives settings and a model that core takes."""

from dataclasses import replace

import bpy
import numpy as np
import pytest


@pytest.fixture
def presets(extension):
    return extension("addon.presets")


def read(scene, extension, preset):
    """Settings and Model of the scene. A grid's volume is not the preset's to choose."""
    settings = extension("addon.properties").settings_from(scene, None)
    if preset == "volume":
        scene.nonlinear_rays.refraction.medium = "explosion"
    model, _placement = extension("addon.model_properties").model_and_placement(scene)
    return settings, model


def test_every_preset_applies_to_any_scene(empty_file, extension, presets):
    chosen = empty_file.nonlinear_rays
    for name, preset in presets.PRESETS.items():
        for model in extension("addon.core.models").MODELS:
            chosen.model = model
            assert bpy.ops.nonlinear_rays.apply_preset(preset=name) == {"FINISHED"}
            assert chosen.model == (preset.model or model)
        for setting, value in preset.settings.items():
            assert getattr(chosen, setting) == (pytest.approx(value) if isinstance(value, float) else value), setting
        group = getattr(chosen, chosen.model)
        for entry, value in preset.values.items():
            assert getattr(group, entry) == (pytest.approx(value) if isinstance(value, float) else value), entry
        _settings, model = read(empty_file, extension, name)
        assert model.name == chosen.model
        for observer in model.observers[:1]:
            assert not model.observer_problem(observer, (0.0, -27.0, 4.5)), name


def test_a_preset_does_not_depend_on_what_was_before(empty_file, extension, presets):
    chosen = empty_file.nonlinear_rays
    fresh = {}
    for name in presets.PRESETS:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.context.scene.nonlinear_rays.model = "kerr"
        presets.apply(bpy.context.scene, name)
        settings, model = read(bpy.context.scene, extension, name)
        fresh[name] = settings, model.name, model.values if presets.PRESETS[name].model else {}
    for name in reversed(presets.PRESETS):
        scene = bpy.context.scene
        chosen = scene.nonlinear_rays
        if not presets.PRESETS[name].model:
            chosen.model = "kerr"
            chosen.observer = "chart"
        presets.apply(scene, name)
        settings, model = read(scene, extension, name)
        values = model.values if presets.PRESETS[name].model else {}
        assert str((settings, model.name, values)) == str(fresh[name]), name


def test_a_law_keeps_what_is_the_scenes_own(empty_file, presets):
    centre = bpy.data.objects.new("Centre", None)
    chosen = empty_file.nonlinear_rays
    chosen.center, chosen.scale, chosen.samples, chosen.pass_depth = centre, 3.0, 7, True
    for name in presets.PRESETS:
        presets.apply(empty_file, name)
    assert (chosen.center, chosen.scale, chosen.samples, chosen.pass_depth) == (centre, 3.0, 7, True)


def test_accuracy_keeps_the_law(empty_file, presets):
    chosen = empty_file.nonlinear_rays
    chosen.model, chosen.kerr.spin, chosen.observer = "kerr", 0.5, "falling"
    for name in presets.ACCURACY:
        presets.apply(empty_file, name)
        assert (chosen.model, chosen.kerr.spin, chosen.observer) == ("kerr", 0.5, "falling")


def test_the_default_is_what_a_new_scene_has(empty_file, extension, presets):
    settings_from = extension("addon.properties").settings_from
    new = settings_from(empty_file, None)
    presets.apply(empty_file, "paper")
    paper = settings_from(empty_file, None)
    assert (paper.pipeline, paper.integrator, paper.step_control) == ("paper", "euler", "doubling")
    assert paper.steps_per_segment == 10
    presets.apply(empty_file, "default")
    assert settings_from(empty_file, None) == new


def test_the_paper_has_its_parameters(empty_file, extension, presets):
    """Section 5.1: β = 8/3, σ = 10, ρ = 28; α = 3/8, β = 2, γ = 4."""
    presets.apply(empty_file, "figure_4b")
    lorenz = empty_file.nonlinear_rays.lorenz
    assert (lorenz.sigma, lorenz.rho, lorenz.beta, lorenz.mode) == (10, 28, pytest.approx(8 / 3), "force")
    presets.apply(empty_file, "roessler")
    roessler = empty_file.nonlinear_rays.roessler
    assert (roessler.alpha, roessler.beta, roessler.gamma, roessler.mode) == (0.375, 2, 4, "force")


def test_every_preset_has_a_tooltip_of_its_own(presets):
    descriptions = [preset.description for preset in presets.PRESETS.values()]
    assert all(descriptions) and len(set(descriptions)) == len(descriptions)
    assert not any(text.endswith(".") for text in descriptions)  # Blender adds it
    operator = presets.NONLINEAR_RAYS_OT_apply_preset
    for name, preset in presets.PRESETS.items():
        properties = type("Properties", (), {"preset": name})
        assert operator.description(None, properties) == preset.description


@pytest.mark.parametrize(("name", "bound"), [("default", 1e-4), ("high", 1e-5)])
def test_a_preset_keeps_its_promise(empty_file, extension, presets, name, bound):
    """Directions around a black hole in a picture 640 wide with a lens of 24 mm, against tolerance 1e-7."""
    core = extension("addon.core.scene")
    camera = core.Camera(np.eye(4), (-0.75, 0.75, -0.5625, 0.5625), 640, 480, "PERSPECTIVE")
    presets.apply(empty_file, name)
    settings = extension("addon.properties").settings_from(empty_file, camera)
    hole = extension("addon.core.models").MODELS["schwarzschild"]()
    b = np.array([5.5, 6, 7, 8, 10, 15, 20, 30, 50, 100])
    positions = np.stack([np.full_like(b, -1000.0), b, 0 * b], axis=1)
    directions = np.tile([1.0, 0.0, 0.0], (len(b), 1))

    def ends(tolerance):
        chosen = replace(settings, tolerance=tolerance, segments=50_000)
        return extension("addon.core.trace").trace_rays(hole, positions, directions, chosen).direction

    error = np.linalg.norm(ends(settings.tolerance) - ends(1e-7), axis=1)
    print(f"{name}: {error.max():.1e} rad, bound {bound:g}")
    assert error.max() < bound


# The observer's velocity from the camera's animation


@pytest.fixture
def moving_camera(empty_file):
    """A scene whose camera hangs on an Empty that goes 0.5 m a frame along X, at 25 frames a second."""
    scene = empty_file
    carrier = bpy.data.objects.new("Carrier", None)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.parent, camera.location = carrier, (0, -20, 0)
    for thing in (carrier, camera):
        scene.collection.objects.link(thing)
    for frame, x in ((1, -5.0), (21, 5.0)):
        carrier.location = x, 0.0, 0.0
        carrier.keyframe_insert("location", frame=frame)
    animation = carrier.animation_data.action
    curves = (
        animation.fcurves if hasattr(animation, "fcurves") else animation.layers[0].strips[0].channelbags[0].fcurves
    )
    for curve in curves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    scene.camera = camera
    scene.render.fps, scene.render.fps_base = 25, 1.0
    scene.frame_set(11)
    chosen = scene.nonlinear_rays
    chosen.model, chosen.observer, chosen.velocity_from_camera = "schwarzschild", "moving", True
    return scene


def test_the_camera_gives_the_velocity(moving_camera, extension):
    """12.5 m/s are, with 0.5 m a model length and light at 50 of them a second, half the speed of light."""
    chosen = moving_camera.nonlinear_rays
    chosen.scale, chosen.speed_of_light = 0.5, 50.0
    exported, settings = extension("addon.capture").capture(moving_camera, moving_camera.view_layers[0])
    assert settings.observer_velocity == pytest.approx((0.5, 0.0, 0.0), abs=1e-6)
    assert exported.camera.world_from_camera[:3, 3] == pytest.approx((0.0, -20.0, 0.0), abs=1e-5)
    assert moving_camera.frame_current == 11
    chosen.velocity_from_camera, chosen.observer_velocity = False, (0.0, 0.25, 0.0)
    _exported, settings = extension("addon.capture").capture(moving_camera, moving_camera.view_layers[0])
    assert settings.observer_velocity == (0.0, 0.25, 0.0)


def test_f12_uses_it_too(moving_camera, extension, monkeypatch):
    chosen, found = moving_camera.nonlinear_rays, []
    chosen.speed_of_light = 50.0
    engine = extension("addon.engine")

    def render(_scene, settings, **_options):
        found.append(settings.observer_velocity)
        raise engine.trace.Cancelled

    monkeypatch.setattr(engine.trace, "render", render)
    moving_camera.render.engine = "NONLINEAR_RAYS"
    moving_camera.render.resolution_x = moving_camera.render.resolution_y = 8
    bpy.ops.render.render()
    assert found == [pytest.approx((0.25, 0.0, 0.0), abs=1e-6)]


def test_a_camera_as_fast_as_light_is_refused(moving_camera, extension):
    scene_error = extension("addon.core.scene").SceneError
    with pytest.raises(scene_error, match=r"12\.5 times the speed of light in frame 11\. Raise Speed of Light"):
        extension("addon.capture").capture(moving_camera, moving_camera.view_layers[0])


def test_another_observer_has_no_velocity(moving_camera, extension):
    moving_camera.nonlinear_rays.observer = "static"
    _exported, settings = extension("addon.capture").capture(moving_camera, moving_camera.view_layers[0])
    assert settings.observer_velocity == (0.0, 0.0, 0.0)
