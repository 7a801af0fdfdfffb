"""Rays that wind around: next to a photon orbit the step limit is doubled while they are few, and what is certain to be
absorbed ends.

At a = M the orbits of the outline's flat side lie on the horizon, where R has a double root: light inside of it by x
of the picture winds around some 0.4 M / x times (DOP853: 107 times at x = 0.004 M), and not, as elsewhere, by the
logarithm of x. So the limit of 5000 steps is met at every resolution, by an ever smaller part of the rays.
"""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.pipelines.fused import FusedPipeline, _few
from addon.core.scene import Camera, Scene
from addon.core.settings import Settings
from addon.core.status import Status, patience
from addon.core.trace import render, trace_rays
from tests.core.test_kerr import points
from tests.shaders import scenes
from tests.shaders.test_far_cameras import inside
from tests.shaders.test_model_kerr import constants_on_axis

FASTEST = MODELS["kerr"](spin=1.0)
FAR = 1e4  # M, of the camera, 60 degrees from the axis
FLAT = -2.3094  # M: where Bardeen's outline is flat, at xi = 2: 2 / sin(60 degrees)
ASIDE = scenes.spheres([[40.0, 0.0, 0.0]], 1.0)  # an object, which no ray of these pictures meets


def zoomed(half, pixels=64, middle=FLAT, **options):
    """A square picture, 2 half M wide, around a place of the outline."""
    place = FAR * np.array([np.sqrt(0.75), 0.0, 0.5])
    window = np.array([middle - half, middle + half, -half, half]) / FAR
    return Scene(Camera(scenes.look_at(place, (0, 0, 0)), tuple(window), pixels, pixels), FASTEST, **options)


def status_of(frame):
    return frame.passes["Status"].ravel()


def truth(scene, settings):
    """What every pixel's ray does, by what it conserves: bool, whether it falls in."""
    y, x = (values.ravel() + 0.5 for values in np.mgrid[0 : scene.camera.height, 0 : scene.camera.width])
    return inside(scene, settings, x, y)


@pytest.mark.parametrize("tolerance", [5e-5, 1e-6])
@pytest.mark.parametrize(("half", "middle"), [(8.0, 0.0), (0.2, FLAT)])
@pytest.mark.parametrize("objects", [{}, {"spheres": ASIDE}], ids=["sky", "objects"])
def test_the_fastest_holes_rim(half, middle, tolerance, objects):
    """Every ray is absorbed or escapes, as float64 says. Float32 may mistake those that are within some hundred
    roundings of L from the rim, 1e-5 M: of these pixels, the nearest is 1e-3 M away.
    """
    scene = zoomed(half, middle=middle, **objects)
    settings = Settings(observer="static", tolerance=tolerance, passes=("Status", "Steps"))
    frame = render(scene, settings)
    falls_in = truth(scene, settings)
    assert falls_in.any() and not falls_in.all()
    assert (status_of(frame) == np.where(falls_in, Status.ABSORBED, Status.ESCAPED)).all()
    if half == 0.2:
        rays, steps = frame.statistics.prolonged
        taken = frame.passes["Steps"].ravel()
        print(f"{rays} rays, up to {steps} steps, most {taken.max():.0f}, of absorbed {taken[falls_in].max():.0f}")
        assert settings.step_limit < taken.max() <= steps <= settings.max_steps
        assert rays == (taken > settings.step_limit).sum()
        assert str(steps) in patience(rays, steps)
        # What is absorbed is told after one draw where it can meet nothing.
        assert (taken[falls_in].max() < 600) == (not objects)


def test_no_more_than_max_steps():
    settings = Settings(observer="static", max_steps=6000, passes=("Status", "Steps"))
    frame = render(zoomed(0.2), settings)
    status, steps = status_of(frame), frame.passes["Steps"].ravel()
    assert (status == Status.STEP_LIMIT).any()
    assert (steps[status == Status.STEP_LIMIT] == 6000).all()
    assert steps.max() == 6000
    assert frame.statistics.prolonged[1] == 6000


def test_many_rays_stop_at_the_limit():
    """Of the rays in the middle of a block all need more than 600 steps, of this tolerance."""
    settings = Settings(observer="static", segments=60, tolerance=1e-6, passes=("Status", "Steps"))
    frame = render(zoomed(0.02, 32, FLAT - 0.02, spheres=ASIDE), settings)
    assert frame.statistics.prolonged is None
    assert (status_of(frame) == Status.STEP_LIMIT).all()
    assert frame.passes["Steps"].min() == frame.passes["Steps"].max() == 600


@pytest.mark.parametrize("options", [{"segments": 1}, {"segments": 60, "step_control": "constant", "step": 1e-3}])
def test_a_length_that_the_user_chose_is_kept(options):
    """By constant steps, or by fewer than one draw takes."""
    ends = trace_rays(
        FASTEST, [[20.0, 0.0, 0.0]], [[-1.0, 0.5, 0.0]], Settings(integrator="dormand_prince_54", **options)
    )
    assert ends.steps[0] <= options["segments"] * 10
    assert ends.status[0] == Status.STEP_LIMIT


def test_few_are_few_of_a_block_of_pixels():
    corners = np.stack(np.meshgrid(np.arange(0, 32, 2), np.arange(0, 32, 2)), axis=-1).reshape(-1, 2)
    running = np.zeros((len(corners), 2, 2), bool)
    left = corners[:, 0] < 16
    running[np.flatnonzero(left & (corners[:, 1] < 16))[:8]] = True  # 32 rays
    upper = np.flatnonzero(~left & (corners[:, 1] >= 16))
    running[upper[:9]] = True  # 36
    expected = np.ones(len(corners), bool)
    expected[upper] = False
    assert (_few(running, corners) == expected).all()


def test_the_picture_does_not_depend_on_the_tiles(monkeypatch):
    settings = Settings(observer="static", passes=("Status", "Steps"))
    whole = render(zoomed(0.1), settings)
    sizes = iter([(16, 32), (32, 16), (16, 16)] * 100)
    monkeypatch.setattr(FusedPipeline, "tile_size", lambda self: next(sizes))
    tiled = render(zoomed(0.1), settings)
    for name in settings.passes:
        assert np.array_equal(whole.passes[name], tiled.passes[name])
    assert whole.statistics.prolonged == tiled.statistics.prolonged


def test_given_rays_are_few():
    x = FLAT + np.array([-0.004, 0.004])
    place = FAR * np.array([np.sqrt(0.75), 0.0, 0.5])
    right = np.array([0.0, 1.0, 0.0])
    directions = -place / FAR + x[:, None] / FAR * right
    settings = Settings(observer="static", tolerance=1e-6)
    ends = trace_rays(FASTEST, np.tile(place, (2, 1)), directions, settings, scene=zoomed(1.0, spheres=ASIDE))
    assert ends.status.tolist() == [Status.ESCAPED, Status.ABSORBED]
    assert ends.steps.max() > settings.step_limit


@pytest.mark.parametrize("spin", [0.0, 0.5, -0.9, 0.998, 1.0, -1.0])
def test_absorbed_where_nothing_brings_it_back(glsl, spin):
    """Never where a ray goes outwards or has a turning point, a root of R, on its way down to the horizon, whatever the
    state; and at the fastest spin, where the bound is no bound but R's factor itself, wherever there is none.
    """
    model = MODELS["kerr"](spin=spin)
    x = points(model, 4000, nearest=1.02, farthest=20.0)
    generator = np.random.default_rng(4)
    d = generator.normal(size=x.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    outside = model.fields(x)[0] < 0.95  # of the ergosphere, where every direction is light's
    states = model.initial_states(x[outside], d[outside]).astype(np.float32).astype(float)
    found = glsl(
        ["models/kerr", "models/kerr_capture"],
        "out_result = vec4(float(absorbed(RayState(x.xyz, v.xyz))));",
        {"x": states[:, :3], "v": states[:, 3:]},
        uniforms=model.uniforms(),
    )["result"][:, 0].astype(bool)
    energy, around, carter = constants_on_axis(model, states).T
    a, r = model.traced_a, model.radius(states[:, :3])
    k = np.sqrt(np.maximum(carter + (around - a * energy) ** 2, 0.0))
    share = np.linspace(0.0, 1.0, 401)
    radii = model.horizon + (r[:, None] - model.horizon) * share  # from the horizon to the ray
    delta = np.maximum(radii**2 - 2.0 * radii + a * a, 0.0)
    rest = energy[:, None] * (radii**2 + a * a) - (a * around)[:, None] - k[:, None] * np.sqrt(delta)
    lowest = rest.min(axis=1) / (energy * r * r)  # where it is positive, R has no root
    rate = radial_rate(model, states)
    print(f"a = {spin}: {found.sum()} of {len(found)} absorbed")
    assert found.sum() > 100
    assert (lowest[found] > -1e-5).all()
    assert (rate[found] < 1e-5).all()
    if abs(spin) == 1.0:
        assert found[(lowest > 1e-4) & (rate < -1e-4)].all()


def radial_rate(model, states):
    """dr/dlambda, (n,), by a difference along the ray."""
    h = 1e-6
    x, v = states[:, :3], model.rhs(states)[:, :3]
    return (model.radius(x + h * v) - model.radius(x - h * v)) / (2 * h)
