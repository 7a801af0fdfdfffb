"""Scenes that nobody should make: every ray ends in a named status, no pixel of any pass is NaN or infinite."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.scene import Environment, Image, Light, Material, Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders import scenes

PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps", "Error")
WALL = scenes.quad((0, 3, 0), (2, 0, 0), (0, 0, 2), object_index=[7, 7])
IN_PLACE = scenes.triangles([[[-1, 1, -1], [1, 1, -1], [0, 1, 1]]], object_index=[1])


def soup(*corners, **options):
    return scenes.triangles(np.array(corners, float), **options)


def with_normals(normals):
    part = scenes.quad((0, 1, 0), (2, 0, 0), (0, 0, 2))
    part.normals[:] = normals
    return part


OBJECTS = {
    "coincident triangles": {"triangles": scenes.joined(IN_PLACE, IN_PLACE, IN_PLACE)},
    "a triangle without area": {"triangles": soup([[0, 0, 0], [1, 0, 1], [2, 0, 2]], [[1, 1, 1]] * 3)},
    "a needle": {"triangles": soup([[-1, 0, 0], [1, 0, 0], [1, 0, 1e-12]])},
    "a triangle through the camera": {"triangles": soup([[0, -8, 1], [1, -8, 1], [0, -8, 2]])},
    "a triangle edge-on": {"triangles": soup([[0, -9, 1], [0, 9, 1], [0, 0, 5]])},
    "normals of zero": {"triangles": with_normals(0.0)},
    "normals that cancel": {
        "triangles": with_normals([[[0, 0, 1], [0, 0, -1], [0, 0, 0]]] * 2),
    },
    "a tiny triangle": {"triangles": soup([[0, 0, 0], [1e-20, 0, 0], [0, 0, 1e-20]])},
    "a sphere around the camera": {"spheres": scenes.spheres([[0, -8, 1]], 1.0)},
    "a sphere around everything": {"spheres": scenes.spheres([[0, 0, 0]], 500.0)},
    "a sphere of radius zero": {"spheres": scenes.spheres([[0, 0, 0]], 0.0)},
    "a sphere of no size": {"spheres": scenes.spheres([[0, 0, 0]], 1e-30)},
    "a negative sphere": {"spheres": scenes.spheres([[0, 0, 0]], -1.0)},
    "coincident spheres": {"spheres": scenes.spheres([[0, 0, 0]] * 3, 1.0)},
    "an object at the centre": {"triangles": soup([[-1, 0, -1], [1, 0, -1], [0, 0, 1]])},
}
HUGE = (1e3, 1e6, 1e12, 1e25, 1e38, 1e200)


def checked(scene, **options):
    """Render every pass in both pipelines; all numbers, and a status for each ray. The frame of the paper's."""
    settings = {"passes": PASSES, "segments": 300, "tolerance": 1e-2} | options
    check(render(scene, Settings(pipeline="fused", **settings)))
    return check(render(scene, Settings(pipeline="paper", **settings)))


def check(frame):
    for name, pixels in frame.passes.items():
        assert np.isfinite(pixels).all(), f"{name}: {np.sum(~np.isfinite(pixels))} values are not finite"
    status = frame.passes["Status"]
    assert np.isin(status, [float(each) for each in Status if each is not Status.RUNNING]).all()
    assert frame.statistics.ray_count == status.size
    return frame


def hostile_scene(model, parts, **options):
    values = {"mass": 0.3} if model == "schwarzschild" else {}
    light = Light("POINT", (500, 500, 500), (2, -5, 4))
    materials = (Material(roughness=0.0, specular=1.0),)
    defaults = {"lights": (light,), "materials": materials, "environment": Environment((0.2, 0.2, 0.2))}
    return Scene(scenes.camera(16, 12), MODELS[model](**values), **(defaults | parts | options))


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
@pytest.mark.parametrize("name", OBJECTS)
def test_objects(name, model):
    options = {"passes": tuple(each for each in PASSES if each != "Error")} if model == "straight" else {}
    checked(hostile_scene(model, OBJECTS[name]), **options)


@pytest.mark.parametrize("name", OBJECTS)
def test_objects_do_not_disturb_their_neighbours(name):
    """A wall behind stays what it was wherever nothing is in front of it."""
    passes = ("Object Index", "Depth", "Combined")
    parts = dict(OBJECTS[name])
    parts["triangles"] = scenes.joined(WALL, parts.get("triangles", scenes.Triangles.empty()))
    alone = render(hostile_scene("straight", {"triangles": WALL}), Settings(passes=passes)).passes
    both = render(hostile_scene("straight", parts), Settings(passes=passes)).passes
    wall = alone["Object Index"] == 7
    covered = (both["Object Index"] != 7) & (both["Object Index"] != 0)
    assert ((both["Object Index"] == 7) | covered)[wall].all()


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
@pytest.mark.parametrize("size", HUGE)
def test_huge_triangles(size, model):
    """What float32 cannot hold is skipped with a warning, or shown; the ball before it stays in the picture."""
    parts = {"triangles": soup(*(size * WALL.positions)), "spheres": scenes.spheres([[0, 0, 0]], 1.0)}
    options = {"passes": tuple(each for each in PASSES if each != "Error")} if model == "straight" else {}
    frame = checked(hostile_scene(model, parts), **options)
    ball = frame.passes["Object Index"] == 101
    alone = checked(hostile_scene(model, {"spheres": parts["spheres"]}), **options).passes["Object Index"] == 101
    assert alone.any()
    # In curved space a ray that would have gone around may be caught by the wall: no pixel of the ball is new.
    assert not (ball & ~alone).any() and ball.sum() >= 0.8 * alone.sum()
    if size >= 1e25:
        assert "too far away" in frame.warnings[0]


def test_pixels_of_images_that_are_not_numbers():
    pixels = np.full((4, 4, 4), 0.5, np.float32)
    pixels[1, 1], pixels[2, 2], pixels[3, 3] = np.nan, np.inf, -np.inf
    materials = (Material(base_image=0, emission=(1, 1, 1), emission_image=0),)
    checked(hostile_scene("schwarzschild", {"triangles": WALL}, images=(Image("bad", pixels),), materials=materials))


def test_a_sky_that_is_not_a_number():
    faces = np.ones((6, 4, 4, 3), np.float32)
    faces[:, 1, 1], faces[:, 2, 2] = np.nan, np.inf
    checked(hostile_scene("schwarzschild", {}, environment=Environment(faces=faces)))


def test_a_light_on_the_surface():
    on_it = Light("POINT", (1e6, 1e6, 1e6), (0.0, 3.0, 0.0))
    checked(hostile_scene("schwarzschild", {"triangles": WALL}, lights=(on_it,)))


@pytest.mark.parametrize("step", [1e-9, 10.0, 1e5, 1e9])
@pytest.mark.parametrize("control", ["constant", "doubling"])
def test_steps_far_too_small_and_too_large(step, control):
    passes = PASSES if control == "doubling" else tuple(each for each in PASSES if each != "Error")
    frame = checked(hostile_scene("schwarzschild", {"triangles": WALL}), step_control=control, step=step, passes=passes)
    assert sum(frame.statistics.rays.values()) == 16 * 12


@pytest.mark.parametrize("failed_rays", ["environment", "marker"])
def test_failed_rays_show_what_the_user_chose(failed_rays):
    scene = hostile_scene("schwarzschild", {})
    frame = checked(scene, segments=1, failed_rays=failed_rays)
    assert set(frame.statistics.rays) == {Status.STEP_LIMIT}
    expected = (0.2, 0.2, 0.2, 1.0) if failed_rays == "environment" else (1.0, 0.0, 1.0, 1.0)
    assert (frame.passes["Combined"] == np.array(expected, np.float32)).all()


@pytest.mark.parametrize("bits", [16, 32])
def test_half_float_rays_are_worse_and_still_pictures(bits):
    checked(hostile_scene("schwarzschild", OBJECTS["coincident spheres"]), ray_bits=bits)


def test_a_camera_at_the_centre_of_nothing():
    """No mass, no field: the camera may stand where the model's centre is."""
    view = scenes.camera(8, 8, (0, 0, 1e-3), (0, 5, 0))
    checked(Scene(view, MODELS["schwarzschild"](mass=0.0), triangles=WALL))


def test_a_far_camera_with_a_long_lens():
    """1e5 lengths away: where digits end, but not where the picture does."""
    distance = 1e5
    view = scenes.camera(16, 16, (0, -distance, 0), half=1.0 / distance)
    frame = checked(
        Scene(view, scenes.STRAIGHT, spheres=scenes.spheres([[0, 0, 0]], 2.0)), passes=("Status", "Position")
    )
    assert (frame.passes["Status"] == Status.HIT).all()
