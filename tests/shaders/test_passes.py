"""Passes are in world space, wherever the model stands; the sky is in the right direction."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core import environment_cube
from addon.core.models import MODELS
from addon.core.report.cases import of_scene
from addon.core.report.errors import near_critical
from addon.core.scene import Environment, Light, Placement, Scene
from addon.core.settings import PASS_CHANNELS, PIPELINES, Settings
from addon.core.status import Status
from addon.core.trace import render, trace_rays
from tests.shaders import scenes, truth

ALL = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps", "Drift")
PLACEMENTS = {
    "at the origin": Placement(),
    "moved": Placement(np.array([5.0, -3.0, 2.0])),
    "turned": Placement(rotation=scenes.rotation(0.3, -1.2, 2.2)),
    "scaled": Placement(scale=0.05),
    "moved, turned, scaled": Placement(np.array([-4.0, 7.0, 1.0]), scenes.rotation(2.0, 0.4, -1.0), 12.0),
}


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_straight_passes_are_in_world_space(placement):
    """Wherever the model stands, straight rays meet the same world."""
    scene = scenes.mixed(placement=PLACEMENTS[placement])
    passes = render(scene, Settings(passes=ALL)).passes
    exact = truth.cast(scene)
    _, directions = truth.camera_rays(scene.camera)
    clear = exact.margin > 1e-3
    hit = passes["Status"][..., 0] == Status.HIT
    assert np.array_equal(hit[clear], exact.hit[clear])
    both = hit & exact.hit & clear
    # Grazing hits are loose; test_intersection.py bounds each by its own conditioning. Here: the frame of reference.
    error = np.linalg.norm(passes["Position"] - exact.position, axis=-1)[both]
    assert np.percentile(error, 95) < 2e-5 and error.max() < 5e-3
    assert np.abs(passes["Normal"] - exact.normal)[both].max() < 5e-3
    assert np.abs(passes["Direction"] - directions).max() < 1e-6
    assert np.array_equal(passes["Object Index"][both][:, 0], exact.object_index[both])
    for name in ("Position", "Normal", "Object Index"):
        assert not passes[name][~hit].any()


def test_shapes_and_types_of_all_passes():
    passes = render(scenes.mixed(), Settings(passes=ALL)).passes
    assert tuple(passes) == ALL
    for name, pixels in passes.items():
        assert pixels.shape == (24, 32, len(PASS_CHANNELS[name])) and pixels.dtype == np.float32


def sky_camera(kind="PERSPECTIVE"):
    return scenes.Camera(scenes.look_at((1, 2, 3), (-3, 5, 4)), (-1.5, 1.5, -1.0, 1.0), 36, 24, kind)


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("size", [4, 32])
def test_the_cube_shows_its_own_directions(placement, size):
    """Faces that hold the direction of each texel; between texels they are interpolated along a chord of the cube's
    face, whose sag is below 2 / size^2. At a seam the mean of the two nearest centres, each 1 / size inside its face,
    is longer than the unit direction by up to t / (2 + t^2)^1.5 / size < 0.2 / size. Weights of 8 bits add 2^-8 of a
    texel's 2 / size.
    """
    faces = environment_cube.face_directions(size).astype(np.float32)
    scene = Scene(sky_camera(), scenes.STRAIGHT, PLACEMENTS[placement], environment=Environment(faces=faces))
    passes = render(scene, Settings(passes=("Combined", "Direction", "Status"), filter_textures=False)).passes
    _, directions = truth.camera_rays(scene.camera)
    assert (passes["Status"] == Status.ESCAPED).all()
    assert np.abs(passes["Direction"] - directions).max() < 1e-6
    tolerance = 2.0 / size**2 + 0.2 / size + 2.0 / size / 256
    assert np.abs(passes["Combined"][..., :3] - directions).max() < tolerance
    assert (passes["Combined"][..., 3] == 1.0).all()


@pytest.mark.parametrize("face", range(6))
def test_each_face_is_where_opengl_has_it(face):
    """A camera that looks along an axis sees that face's colour in the middle: +X -X +Y -Y +Z -Z."""
    faces = np.zeros((6, 2, 2, 3), np.float32)
    faces[face] = (1.0, 2.0, 3.0)
    axis = np.zeros(3)
    axis[face // 2] = 1 - 2 * (face % 2)
    view = scenes.Camera(scenes.look_at((0, 0, 0), axis, up=(0.1, 0.7, 0.7)), (-0.1, 0.1, -0.1, 0.1), 2, 2)
    scene = Scene(view, scenes.STRAIGHT, environment=Environment((9, 9, 9), faces))
    assert render(scene, Settings()).passes["Combined"][0, 0].tolist() == [1.0, 2.0, 3.0, 1.0]


def test_a_constant_sky():
    scene = Scene(sky_camera("ORTHOGRAPHIC"), scenes.STRAIGHT, environment=Environment((0.25, 0.5, 4.0)))
    assert (render(scene, Settings()).passes["Combined"] == np.array([0.25, 0.5, 4.0, 1.0], np.float32)).all()


def test_bent_light_brings_the_sky_from_its_final_direction():
    """Around the hole: the colour is the sky in the Direction pass, also with a turned model; absorbed is black. The
    tolerance is that of the cube's own directions, above, seams included.
    """
    faces = environment_cube.face_directions(32).astype(np.float32)
    placement = Placement(np.array([1.0, 2.0, 3.0]), scenes.rotation(1.0, 0.3, 0.2), 0.5)
    view = scenes.Camera(scenes.look_at((1, -8, 3), (1, 2, 3)), (-0.9, 0.9, -0.9, 0.9), 24, 24)
    scene = Scene(view, MODELS["schwarzschild"](), placement, environment=Environment(faces=faces))
    passes = render(
        scene, Settings(passes=("Combined", "Direction", "Status"), segments=5000, filter_textures=False)
    ).passes
    status = passes["Status"][..., 0]
    assert set(np.unique(status)) == {Status.ABSORBED, Status.ESCAPED}
    escaped = status == Status.ESCAPED
    assert np.abs(passes["Combined"][..., :3] - passes["Direction"])[escaped].max() < (
        2.0 / 32**2 + 0.2 / 32 + 2.0 / 32 / 256
    )
    assert (passes["Combined"][status == Status.ABSORBED] == (0, 0, 0, 1)).all()
    _, straight = truth.camera_rays(view)
    assert np.linalg.norm(passes["Direction"] - straight, axis=-1)[escaped].max() > 0.5  # it was bent


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
@pytest.mark.parametrize("factor", [1e-4, 1e4])
def test_the_same_scene_at_any_scale_is_the_same_picture(model, factor):
    """World, camera, lamps and model times a factor: model space is the same within a rounding of float64, so that only
    pixels on an edge may differ.
    """
    light = lamp()
    scene = scenes.mixed(MODELS[model](mass=0.3) if model == "schwarzschild" else MODELS[model](), lights=(light,))
    settings = Settings(passes=ALL, segments=3000, tolerance=1e-2)
    one, other = (render(each, settings).passes for each in (scene, scenes.scaled(scene, factor)))
    same = (one["Status"] == other["Status"])[..., 0] & (one["Object Index"] == other["Object Index"])[..., 0]
    assert same.mean() > 0.995
    assert np.abs(one["Combined"] - other["Combined"])[same].max() < 1e-3 * one["Combined"].max()
    assert np.abs(one["Position"] - other["Position"] / factor)[same].max() < 1e-3


def lamp():
    return Light("POINT", (800.0, 800.0, 800.0), (2.0, -6.0, 4.0))


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_a_scene_far_from_the_origin_is_the_same_picture(model):
    """1e5 lengths away: everything is relative to the model's centre before it becomes float32."""
    away = np.array([1e5, -0.7e5, 0.3e5])
    scene = scenes.mixed(MODELS[model](mass=0.3) if model == "schwarzschild" else MODELS[model]())
    matrix = scene.camera.world_from_camera.copy()
    matrix[:3, 3] += away
    moved = scenes.replace(
        scene,
        camera=scenes.replace(scene.camera, world_from_camera=matrix),
        placement=Placement(away),
        triangles=scenes.replace(scene.triangles, positions=scene.triangles.positions + away),
        spheres=scenes.replace(scene.spheres, centres=scene.spheres.centres + away),
    )
    settings = Settings(passes=("Combined", "Status", "Object Index"), segments=3000, tolerance=1e-2)
    one, other = (render(each, settings).passes for each in (scene, moved))
    same = (one["Status"] == other["Status"])[..., 0] & (one["Object Index"] == other["Object Index"])[..., 0]
    assert same.mean() > 0.995


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_drift_is_that_of_the_same_rays(pipeline):
    """test_conserved.py holds trace_rays' drift against closed forms. Euler's long steps drift by far more than float32
    rounds: 1e-3 is what another rounding of a ray's direction may change of it, away from the critical rays.
    """
    scene = Scene(scenes.camera(half=1.5), scenes.HOLE)
    passes = ("Combined", "Status", "Drift")
    settings = Settings(pipeline, "euler", "constant", step=0.1, segments=5000, passes=passes)
    frame = render(scene, settings)
    rays = of_scene(scene).pixel_rays(*frame.size)
    ends = trace_rays(scenes.HOLE, *rays, settings)
    status, drift = (frame.passes[name].ravel() for name in ("Status", "Drift"))
    away = (status == Status.ESCAPED) & ~near_critical(scenes.HOLE, *rays)
    assert away.sum() > 300 and drift[away].max() > 1e-2
    assert drift[away] == pytest.approx(ends.invariant_drift[away], rel=1e-3, abs=1e-6)
    assert frame.statistics.worst_drift == drift[status == Status.ESCAPED].max()
    assert render(scene, replace(settings, passes=("Combined", "Steps"))).statistics.worst_drift is None
