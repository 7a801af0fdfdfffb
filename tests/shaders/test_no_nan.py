"""No pass of any render holds NaN or infinity, and every ray ends in a named status, whatever the model, its
parameters, the camera and the settings are: what is not refused with a sentence is rendered.
"""

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from addon.core.models import MODELS, ParameterError
from addon.core.scene import Camera, Environment, Light, Material, Placement, Scene, SceneError
from addon.core.settings import INTEGRATORS, PASSES, PIPELINES, WITH_ERROR_ESTIMATE, Settings
from addon.core.status import Status
from addon.core.trace import render, suits
from tests.shaders import scenes

EXAMPLES = int(os.environ.get("NO_NAN_EXAMPLES", "3"))  # of a model; the hunt is worth hundreds now and then
NAMED = [float(status) for status in Status if status is not Status.RUNNING]


def sizes(low, high):
    """Numbers of all magnitudes."""
    return st.floats(np.log10(low), np.log10(high)).map(lambda power: float(10.0**power))


def values(parameter):
    """The default, the ends of the range, and all magnitudes in between."""
    ends = [max(parameter.minimum, -1e6), min(parameter.maximum, 1e6), parameter.default]
    between = st.tuples(sizes(1e-6, 1e6), st.sampled_from([1.0, -1.0]))
    return st.one_of(st.sampled_from(ends), between.map(lambda pair: float(np.clip(pair[0] * pair[1], *ends[:2]))))


@st.composite
def models(draw, name):
    model = MODELS[name]
    chosen = {option.name: draw(st.sampled_from([key for key, *_ in option.choices])) for option in model.options}
    names = [each.name for each in model.parameters]
    extreme = draw(st.sets(st.sampled_from(names), max_size=3)) if names else ()
    return model(**chosen, **{each.name: draw(values(each)) for each in model.parameters if each.name in extreme})


@st.composite
def some_settings(draw, model):
    possible = [name for name in INTEGRATORS if suits(name, model)]
    integrator = draw(st.sampled_from(possible))
    controls = ["constant", "doubling"] + ["embedded"] * (integrator in WITH_ERROR_ESTIMATE)
    control = draw(st.sampled_from(controls))
    estimates = control != "constant" and model.curved and not model.own_integrator()
    return {
        "integrator": integrator,
        "step_control": control,
        "observer": draw(st.sampled_from(model.observers)),
        "observer_velocity": draw(st.sampled_from([(0.0, 0.0, 0.0), (0.6, 0.0, 0.3), (-0.99, 0.1, 0.0)])),
        "step": draw(st.one_of(st.none(), sizes(1e-9, 1e9))),
        "tolerance": draw(sizes(1e-9, 3.0)),
        "max_steps": draw(st.sampled_from([1, 7, 300])),
        "segments": draw(st.sampled_from([1, 40])),
        "passes": tuple(each for each in PASSES if each != "Error" or estimates),
    }


@st.composite
def views(draw):
    """Of 8 x 6 pixels, at all distances, somewhere near the centre."""
    generator = np.random.default_rng(draw(st.integers(0, 1000)))
    position = generator.normal(size=3) * draw(sizes(1e-3, 1e6))
    target = draw(st.sampled_from([0.0, 0.3])) * generator.normal(size=3) * np.linalg.norm(position)
    half = draw(sizes(1e-6, 10.0))
    kind = draw(st.sampled_from(["PERSPECTIVE", "ORTHOGRAPHIC"]))
    window = (-half, half, -0.75 * half, 0.75 * half)
    return Camera(scenes.look_at(position, target), window, 8, 6, kind=kind)


def full_scene(model, view, scale=1.0):
    """Something of everything that a scene may hold."""
    faces = np.random.default_rng(1).random((6, 4, 4, 3)).astype(np.float32)
    return Scene(
        view,
        model,
        Placement(scale=scale),
        scenes.random_soup(3),
        scenes.spheres([[0.5, 3.0, 0.0]], 1.0),
        materials=(Material(specular=1.0, roughness=0.1),),
        lights=(Light("POINT", (100.0, 100.0, 100.0), (2.0, -5.0, 4.0)),),
        environment=Environment(faces=faces),
    )


def check(frame, pipeline):
    for part, pixels in frame.passes.items():
        assert np.isfinite(pixels).all(), f"{pipeline}, {part}: {np.sum(~np.isfinite(pixels))} values"
    assert np.isin(frame.passes["Status"], NAMED).all()
    assert sum(frame.statistics.rays.values()) == frame.passes["Status"].size


@pytest.mark.parametrize("name", MODELS)
@settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=st.data())
def test_every_pixel_is_a_number(egl, name, data):
    try:
        model = data.draw(models(name))
    except ParameterError:
        return
    scene = full_scene(model, data.draw(views()), data.draw(st.sampled_from([1.0, 1e-4, 1e4])))
    options = data.draw(some_settings(model))
    for pipeline in PIPELINES:
        try:
            frame = render(scene, Settings(pipeline=pipeline, **options))
        except SceneError:
            return
        check(frame, pipeline)


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_a_flow_that_explodes_still_has_a_direction(egl, pipeline):
    """Found by the hunt: Euler's steps carry some rays of a Rössler flow to where the field's square is infinite."""
    view = scenes.camera(8, 6, position=(0.12573022, -0.13210486, 0.64042265), half=1.0)
    options = {"integrator": "euler", "step_control": "constant", "max_steps": 300, "segments": 40}
    passes = tuple(name for name in PASSES if name != "Error")
    scene = full_scene(MODELS["roessler"](mode="flow"), view)
    check(render(scene, Settings(pipeline=pipeline, passes=passes, **options)), pipeline)
