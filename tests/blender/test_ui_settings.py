"""The properties of a scene -> core's Settings, Model and Placement; and what the panel warns of."""

import math

import bpy
import numpy as np
import pytest


@pytest.fixture
def model_properties(extension):
    return extension("addon.model_properties")


@pytest.fixture
def properties(extension):
    return extension("addon.properties")


@pytest.fixture
def problems(extension):
    return extension("addon.checks").problems


def add_camera(scene, location=(0.0, -20.0, 0.0)):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = location
    camera.rotation_euler = (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return camera


def core_camera(extension, width=100, height=50, kind="PERSPECTIVE"):
    return extension("addon.core.scene").Camera(np.eye(4), (-0.5, 0.5, -0.25, 0.25), width, height, kind)


def test_defaults_are_those_of_core_but_for_the_tolerance_in_pixels(empty_file, extension, properties):
    settings = properties.settings_from(empty_file, core_camera(extension))
    assert settings == extension("addon.core.settings").Settings(tolerance=settings.tolerance)


def test_tolerance_is_in_pixels(empty_file, extension, properties):
    empty_file.nonlinear_rays.tolerance = 0.25
    assert properties.settings_from(empty_file, core_camera(extension)).tolerance == pytest.approx(0.25 * 0.01)
    assert properties.settings_from(empty_file, core_camera(extension, 200, 100)).tolerance == pytest.approx(
        0.25 * 0.005
    )
    assert properties.settings_from(empty_file, core_camera(extension, kind="ORTHOGRAPHIC")).tolerance > 0.0


def test_choices_reach_the_settings(empty_file, properties):
    chosen = empty_file.nonlinear_rays
    chosen.step_control = "constant"
    chosen.observer = "static"
    chosen.use_custom_step, chosen.step = True, 0.125
    chosen.use_custom_escape_radius, chosen.escape_radius = True, 40.0
    chosen.segments, chosen.steps_per_segment, chosen.max_steps, chosen.samples = 7, 3, 99, 4
    chosen.edge_samples, chosen.filter_textures, empty_file.render.filter_size = 16, False, 2.5
    chosen.early_termination, chosen.failed_rays = "hits", "marker"
    chosen.batch_size, chosen.cull_batches, chosen.ray_bits = 5, False, "16"
    chosen.pass_object_index = chosen.pass_depth = True
    settings = properties.settings_from(empty_file, None)
    assert (settings.step_control, settings.observer, settings.step, settings.escape_radius) == (
        "constant",
        "static",
        0.125,
        40.0,
    )
    assert (settings.segments, settings.steps_per_segment, settings.max_steps, settings.samples) == (7, 3, 99, 4)
    assert (settings.edge_samples, settings.filter_textures, settings.filter_width) == (16, False, 2.5)
    assert (settings.early_termination, settings.failed_rays) == ("hits", "marker")
    assert (settings.batch_size, settings.cull_batches, settings.ray_bits) == (5, False, 16)
    assert settings.passes == ("Combined", "Depth", "Object Index")


def test_menus_offer_what_core_offers(empty_file, extension):
    core = extension("addon.core.settings")
    definitions = empty_file.nonlinear_rays.bl_rna.properties
    for name, choices in {
        "pipeline": core.PIPELINES,
        "integrator": core.INTEGRATORS,
        "step_control": core.STEP_CONTROLS,
        "observer": core.OBSERVERS,
        "early_termination": core.EARLY_TERMINATIONS,
        "failed_rays": core.FAILED_RAYS,
        "model": tuple(extension("addon.core.models").MODELS),
    }.items():
        assert set(definitions[name].enum_items.keys()) == set(choices), name


def test_model_parameters_reach_the_model(empty_file, model_properties):
    empty_file.nonlinear_rays.model = "schwarzschild"
    empty_file.nonlinear_rays.schwarzschild.mass = 2.5
    empty_file.nonlinear_rays.scale = 0.5
    model, placement = model_properties.model_and_placement(empty_file)
    assert (model.name, model.mass, placement.scale) == ("schwarzschild", 2.5, 0.5)
    assert not placement.position.any()


def test_animated_parameter_has_the_value_of_the_evaluated_frame(empty_file, model_properties):
    empty_file.nonlinear_rays.model = "schwarzschild"
    parameters = empty_file.nonlinear_rays.schwarzschild
    for frame, mass in ((1, 1.0), (11, 3.0)):
        parameters.mass = mass
        empty_file.keyframe_insert("nonlinear_rays.schwarzschild.mass", frame=frame)
    empty_file.frame_set(11)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    model, _placement = model_properties.model_and_placement(depsgraph.scene_eval, depsgraph)
    assert model.mass == 3.0


def test_centre_object_places_and_turns_the_model(empty_file, model_properties):
    centre = bpy.data.objects.new("Centre", None)
    empty_file.collection.objects.link(centre)
    centre.location, centre.rotation_euler, centre.scale = (1.0, 2.0, 3.0), (0.0, 0.0, math.pi / 2), (2.0, 2.0, 2.0)
    empty_file.nonlinear_rays.model = "schwarzschild"
    empty_file.nonlinear_rays.center = centre
    depsgraph = bpy.context.evaluated_depsgraph_get()
    _model, placement = model_properties.model_and_placement(empty_file, depsgraph)
    assert placement.position == pytest.approx([1.0, 2.0, 3.0])
    assert placement.rotation @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)


def test_straight_model_without_a_centre_is_at_the_camera(empty_file, model_properties):
    empty_file.nonlinear_rays.model = "straight"
    add_camera(empty_file, (1000.0, 0.0, 0.0))
    _model, placement = model_properties.model_and_placement(empty_file)
    assert placement.position == pytest.approx([1000.0, 0.0, 0.0])


def test_a_sound_scene_has_no_problems(empty_file, problems):
    empty_file.nonlinear_rays.model = "schwarzschild"
    add_camera(empty_file)
    empty_file.world = None
    assert problems(empty_file) == []


def test_no_camera_is_said(empty_file, problems):
    assert any("camera" in problem for problem in problems(empty_file))


def test_scale_zero_is_said(empty_file, problems):
    add_camera(empty_file)
    empty_file.nonlinear_rays.scale = 0.0
    assert any("scale is zero" in problem for problem in problems(empty_file))


def test_camera_inside_the_horizon_is_said(empty_file, problems):
    add_camera(empty_file, (0.0, -1.0, 0.0))
    empty_file.nonlinear_rays.model = "schwarzschild"
    assert any("horizon" in problem for problem in problems(empty_file))


@pytest.mark.parametrize(("model", "said"), [("kerr", True), ("schwarzschild", False), ("straight", False)])
def test_an_integrator_that_the_law_does_not_suit_is_said(empty_file, problems, model, said):
    add_camera(empty_file)
    empty_file.nonlinear_rays.model = model
    empty_file.nonlinear_rays.integrator = "nystrom_64"
    assert any("nystrom_64" in problem for problem in problems(empty_file)) is said


def test_error_pass_without_an_estimate_is_said(empty_file, problems):
    add_camera(empty_file)
    empty_file.nonlinear_rays.pass_error = True
    empty_file.nonlinear_rays.step_control = "constant"
    assert any("Step Control" in problem for problem in problems(empty_file))


def test_what_a_file_stores_of_a_choice_does_not_depend_on_the_others(extension):
    menus = extension("addon.menus")
    assert menus.items(("paper", "new_one"))[0] == menus.items(("paper",))[0]
    for menu in (menus.MODEL_ITEMS, menus.INTEGRATOR_ITEMS, menus.STEP_CONTROL_ITEMS):
        assert len({item[3] for item in menu}) == len(menu)


def test_the_observers_velocity_reaches_the_settings(empty_file, extension, properties):
    empty_file.nonlinear_rays.observer = "moving"
    empty_file.nonlinear_rays.observer_velocity = (0.5, 0.0, -0.25)
    assert properties.settings_from(empty_file, core_camera(extension)).observer_velocity == (0.5, 0.0, -0.25)


def test_a_wormhole_has_a_world_of_its_own_behind_it(empty_file, extension):
    add_camera(empty_file)
    near, far = bpy.data.worlds.new("Near"), bpy.data.worlds.new("Far")
    for world, color in ((near, (0.25, 0.0, 0.0)), (far, (0.0, 0.0, 0.5))):
        world.use_nodes = True
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1.0)
    empty_file.world = near
    empty_file.nonlinear_rays.model = "wormhole"
    empty_file.nonlinear_rays.far_world = far
    exported, _settings = extension("addon.capture").capture(empty_file, empty_file.view_layers[0])
    assert exported.environment.color == pytest.approx((0.25, 0.0, 0.0))
    assert exported.far_environment.color == pytest.approx((0.0, 0.0, 0.5))
    empty_file.nonlinear_rays.model = "straight"
    exported, _settings = extension("addon.capture").capture(empty_file, empty_file.view_layers[0])
    assert exported.far_environment is None
