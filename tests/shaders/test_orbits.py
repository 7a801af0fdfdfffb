"""The sky behind a Schwarzschild hole by Binet's equation: where nothing can be hit, rays are orbits in their plane.
Held against DOP853, the critical impact parameter, and the same rays in space.
"""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.pipelines import fused as fused_pipeline
from addon.core.reference import angles, true_ends
from addon.core.scene import Environment
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import pack_for, render, takes_orbits, trace_rays
from tests.shaders import scenes, truth

EPS = 2.0**-24
IN_SPACE = {"integrator": "nystrom_64"}
ORBIT = ("models/schwarzschild", "models/schwarzschild_orbit", "common/bounds")


def rays(r, spread=None, n=300, mass=1.0, seed=1):
    """(n, 3), (n, 3): from the distance r M, all around or within a cone towards the hole; in float32's numbers."""
    generator = np.random.default_rng(seed)
    turned = scenes.rotation(0.3, -1.1, 2.0)
    x = np.tile(turned @ [-r * mass, 0.0, 0.0], (n, 1)).astype(np.float32).astype(np.float64)
    d = generator.normal(size=(n, 3))
    if spread:
        d = np.column_stack([np.ones(n), spread * generator.uniform(-1.0, 1.0, (n, 2))]) @ turned.T
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    return x, d


def exact(model, x, d, ends):
    """The truth at the τ that the rays ended at."""
    unit = d / np.linalg.norm(d, axis=1, keepdims=True)
    return true_ends(model, x, unit, parameters=ends.parameter.astype(np.float64))


# What takes it


def test_orbits_are_taken_where_nothing_can_be_hit():
    hole, default = scenes.HOLE, Settings()
    sky = pack_for(scenes.mixed(hole, count=0), default)
    assert sky.sphere_count and not takes_orbits(hole, default, sky)
    nothing = replace(sky, sphere_count=0)
    assert takes_orbits(hole, default, nothing)
    other = (
        Settings(pipeline="paper", integrator="automatic", step_control="embedded"),
        Settings(step_control="constant"),
        Settings(step_control="doubling"),
        Settings(step=0.1),
        Settings(integrator="nystrom_64"),
    )
    assert not any(takes_orbits(hole, settings, nothing) for settings in other)
    assert not any(takes_orbits(model, default, nothing) for model in (MODELS["kerr"](), scenes.STRAIGHT))


def test_the_frame_says_so():
    scene = replace(scenes.mixed(scenes.HOLE), camera=scenes.camera(8, 6))
    phrase = "positions along the rays"
    assert phrase not in render(scene, Settings()).statistics.left_out
    empty = replace(scene, triangles=scenes.triangles(np.zeros((0, 3, 3))), spheres=scenes.spheres([], []))
    assert phrase in render(empty, Settings()).statistics.left_out


# The equation


@pytest.mark.parametrize("mass", [1.0, 0.25, 1e5])
def test_the_equation_is_the_force_in_another_chart(glsl, mass):
    """With u = 1/r: dw/dpsi = r^2 d(-dr/dtau)/dtau, where d^2r/dtau^2 = v_across^2 / r + f.x / r of the model's own
    float64 right-hand side. Some 20 rounded operations on terms as large as h^2 u and 3 M h^2 u^2.
    """
    model = MODELS["schwarzschild"](mass=mass)
    x, d = rays(1.0, n=600)
    x *= np.geomspace(2.0, 200.0, 600)[:, None] * mass
    found = glsl(
        ORBIT,
        "RayState s = orbit_state(RayState(x.xyz, v.xyz)); RayState rate = rhs(s);"
        "out_x = vec4(rate.x, s.x.x); out_v = vec4(rate.v, 0.0);",
        {"x": x, "v": d},
        ("x", "v"),
        {"u_mass": mass, "u_escape_radius": 1e3 * mass},
        flags=("ORBIT",),
    )
    x, d = x.astype(np.float32).astype(np.float64), d.astype(np.float32).astype(np.float64)
    r, h = np.linalg.norm(x, axis=1), np.linalg.norm(np.cross(x, d), axis=1)
    force = model.rhs(np.concatenate([x, d], axis=1))[:, 3:]
    radial_speed = np.sum(x * d, axis=1) / r
    radial = (h / r) ** 2 / r + np.sum(x * force, axis=1) / r
    assert np.abs(found["x"][:, 3] * r - 1.0).max() < 10 * EPS
    assert np.abs(found["x"][:, 0] + radial_speed).max() < 20 * EPS
    assert np.abs(found["x"][:, 1] - h).max() < 20 * EPS * r.max()
    size = h * h / r * (1.0 + 3.0 * mass / r)
    cancelled = 20 * EPS * r * h / r * (1.0 + 3.0 * mass / r)  # h is rounded relative to |x||v|
    assert (np.abs(found["v"][:, 0] + r**2 * radial) < 20 * EPS * size + 2.0 * cancelled).all()
    assert (np.abs(found["v"][:, 2] - h * h / r) < 20 * EPS * h * h / r + 2.0 * cancelled).all()
    assert (found["v"][:, 1] == 0.0).all()


def test_no_step_of_a_straight_ray_goes_past_infinity(glsl):
    """A straight ray has u = sin(its angle from infinity) / b. Behind the longest step it is not at infinity yet:
    outwards half of 1 / R is left, but for the steps' rounding, inwards something.
    """
    radius = 100.0
    x, d = rays(1.0, n=2000)
    x *= np.geomspace(0.1, 99.0, 2000)[:, None]
    found = glsl(
        ORBIT,
        "RayState s = orbit_state(RayState(x.xyz, v.xyz)); out_step = vec4(longest_step(s), s.v.y, s.x.x, s.v.x);",
        {"x": x, "v": d},
        ("step",),
        {"u_mass": 1e-30, "u_escape_radius": radius},
        flags=("ORBIT",),
    )["step"].astype(np.float64)
    step, h, u, w = found.T
    at_infinity = np.arctan2(h * u, -w)  # the angle that a straight ray has to go
    left = np.sin(at_infinity - h * step) / h  # its u behind the step, as E = 1
    outwards = w < 0.0
    assert (left[outwards] > 0.45 / radius).all() and (left[~outwards] > 0.0).all()
    # And it is no shorter than it has to be where rays are nearly radial: the series' next term is 5/112 q^7.
    far = outwards & (h * u < 0.5)
    assert (left[far] < np.maximum(0.55 / radius, 0.55 * u[far])).all()


# Its ends


@pytest.mark.parametrize("tolerance", [1e-2, 2e-3, 1e-4])
@pytest.mark.parametrize(("r", "spread"), [(27.4, 0.75), (100.0, None), (6.0, None), (1e3, 0.02), (1e4, None)])
def test_the_ends_are_as_right_as_the_tolerance_says(egl, r, spread, tolerance):
    """The 99th percentile of the direction's error, against DOP853 far out; and where the ray is by the τ at which it
    ended, against the same: what its direction is off by shifts it by as much.
    """
    x, d = rays(r, spread)
    ends = trace_rays(scenes.HOLE, x, d, Settings(tolerance=tolerance))
    true, last = exact(scenes.HOLE, x, d, ends), true_ends(scenes.HOLE, x, d / np.linalg.norm(d, axis=1)[:, None])
    assert (ends.status == last.status).all()
    escaped = ends.status == Status.ESCAPED
    assert escaped.sum() > 150
    error = angles(ends.direction.astype(float), last.direction)[escaped]
    away = np.linalg.norm(ends.position - true.position, axis=1) / np.linalg.norm(true.position, axis=1)
    print(f"\n{r} M, {tolerance}: 99 % below {np.percentile(error, 99):.1e} rad, {ends.steps.mean():.1f} steps a ray")
    assert np.percentile(error, 99) < tolerance
    assert np.percentile(away[escaped], 99) < 2.0 * tolerance
    # Aimed at 2 R at most; an error of u, held against its half there, is given that much again.
    radius, distance = scenes.HOLE.escape_radius(r), np.linalg.norm(ends.position[escaped], axis=1)
    assert ((distance > (1.0 - 4 * EPS) * radius) & (distance < (1.0 + 4 * EPS) * 4.0 * radius)).all()


def test_darwins_deflection(egl):
    """As the README has it for rays in space: from 1e4 M, to a few roundings of an angle of up to 2 pi, times what the
    photon sphere makes of those of b.
    """
    b = np.array([5.5, 6.0, 10.0, 30.0, 100.0, 1000.0])
    x = np.column_stack([np.full(6, -1e4), b, 0 * b])
    ends = trace_rays(scenes.HOLE, x, np.tile([1.0, 0.0, 0.0], (6, 1)), Settings(tolerance=1e-6))
    found = -np.arctan2(ends.direction[:, 1].astype(float), ends.direction[:, 0].astype(float))
    closed = np.array([truth.darwin(one) for one in b])
    condition = np.array([abs(truth.darwin(1.001 * one) - truth.darwin(0.999 * one)) / 0.002 for one in b])
    error = np.abs(np.angle(np.exp(1j * (found - closed))))
    print(f"\nDarwin's deflection, b = {b}: errors {error} rad")
    # b at infinity is less than b at 1e4 M by (M/r) (b/r)^2, 1e-6 of b = 1000.
    assert (error < 1e-6 + 10 * EPS * np.pi + 8 * EPS * condition).all()


@pytest.mark.parametrize("r", [2.2, 5.0, 27.4, 95.0])
def test_captured_or_not_is_what_the_impact_parameter_says(egl, r):
    """b of each float32 ray in float64 against 3 sqrt 3: what neither the tolerance's share of a step nor a few
    roundings of b can turn over, ends on its own side.
    """
    n = 1000
    generator = np.random.default_rng(2)
    angle = truth.shadow_angle(r, "chart") * (1.0 + generator.uniform(-1e-4, 1e-4, n))
    if r < 3.0:
        angle = np.pi - angle
    around = generator.uniform(0.0, 2.0 * np.pi, n)
    d = np.column_stack([np.cos(angle), np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around)])
    d = d.astype(np.float32).astype(np.float64)
    x = np.tile([-r, 0.0, 0.0], (n, 1)).astype(np.float32).astype(np.float64)
    h_squared = np.sum(np.cross(x, d) ** 2, axis=1)
    b = np.sqrt(h_squared / (np.sum(d * d, axis=1) - 2.0 * h_squared / np.abs(x[:, 0]) ** 3))
    off = b / truth.CRITICAL - 1.0
    falls = off < 0.0 if r > 3.0 else off > 0.0
    for tolerance, band in ((1e-4, 1e-5), (1e-6, 20 * EPS)):
        status = trace_rays(scenes.HOLE, x, d, Settings(tolerance=tolerance)).status
        clear = np.abs(off) > band
        assert clear.sum() > 800
        assert np.array_equal(status[clear] == Status.ABSORBED, falls[clear])
        assert set(status[clear]) == {Status.ABSORBED, Status.ESCAPED}


def test_radial_rays_stay_so(egl):
    """h = 0: in, out, and away from outside the bounding sphere, where no step is taken. They pass by the centre, as
    near as a direction's rounding.
    """
    x = np.array([[-10.0, 0, 0], [-10.0, 0, 0], [0, 7.0, 0], [2.5, 0, 0], [2e6, 0, 0], [1e6, 0, 0]])
    d = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, -1.0, 0], [1.0, 0, 0], [1.0, 0, 0], [-1.0, 0, 0]])
    ends = trace_rays(scenes.HOLE, x, d, Settings())
    inwards = np.array([True, False, True, False, False, True])
    assert np.array_equal(ends.status, np.where(inwards, Status.ABSORBED, Status.ESCAPED))
    assert np.abs(ends.direction - d).max() <= EPS
    assert ends.steps[4] == 0 and ends.position[4] == pytest.approx([2e6, 0, 0], rel=4 * EPS)
    moved = np.sum((ends.position - x) * d, axis=1)
    assert ends.parameter == pytest.approx(moved, rel=8 * EPS, abs=8 * EPS * 1e6)


@pytest.mark.parametrize("distance", [1e-3, 1.0, 1e4])
def test_without_a_mass_rays_are_straight(egl, distance):
    """The one through the centre, too. Sine and cosine of the angle around the centre are right to some roundings."""
    d = np.random.default_rng(3).normal(size=(300, 3))
    d[:2] = [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    ends = trace_rays(MODELS["schwarzschild"](mass=0.0), np.tile([0.0, -distance, 0.0], (300, 1)), d, Settings())
    assert (ends.status == Status.ESCAPED).all()
    assert np.abs(ends.direction - d).max() < 5 * EPS


def test_a_ray_that_begins_at_its_end_stays_there(egl):
    """Within the horizon, at the very centre, and outside the bounding sphere on the way out: to the bit, but for what
    bends the last one beyond, less than 2 M / b.
    """
    x = np.array([[0.0, 0.0, 0.0], [0.5, -1.0, 0.3], [3e5, 1e5, 0.0]], np.float32)
    d = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32)
    ends = trace_rays(scenes.HOLE, x, d, Settings())
    assert ends.status.tolist() == [Status.ABSORBED, Status.ABSORBED, Status.ESCAPED]
    assert np.array_equal(ends.position, x) and np.abs(ends.direction - d)[:2].max() < 2 * EPS
    assert np.abs(ends.direction - d)[2].max() < 2.0 / 3e5
    assert not ends.steps.any() and not ends.parameter.any() and np.isfinite(ends.invariant_drift).all()


def test_light_that_circles_for_ever_ends_in_a_named_status(egl):
    """At exactly 3 M, tangentially, nothing moves u off 1 / 3 M."""
    ends = trace_rays(scenes.HOLE, [[3.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], Settings(max_steps=50))
    assert ends.status[0] in (Status.STEP_LIMIT, Status.STEP_TOO_SMALL, Status.ESCAPED, Status.ABSORBED)
    assert np.isfinite(ends.position).all() and np.isfinite(ends.direction).all() and ends.steps[0] <= 50


def test_a_ray_goes_on_in_the_next_draw_to_the_bit(egl, monkeypatch):
    x, d = rays(10.0, n=500)
    whole = trace_rays(scenes.HOLE, x, d, Settings(tolerance=1e-5))
    monkeypatch.setattr(fused_pipeline, "STEPS_A_DRAW", 3)
    parts = trace_rays(scenes.HOLE, x, d, Settings(tolerance=1e-5))
    assert whole.steps.max() > 9
    for name, values in vars(whole).items():
        assert np.array_equal(values, getattr(parts, name)), name


@pytest.mark.parametrize("mass", [1e-4, 1e5])
def test_it_scales(egl, mass):
    """A hole of another mass, with all lengths times that: the same directions, both to within the tolerance."""
    x, d = rays(20.0, n=200)
    ends = trace_rays(scenes.HOLE, x, d, Settings(tolerance=1e-5))
    others = trace_rays(MODELS["schwarzschild"](mass=mass), *rays(20.0, n=200, mass=mass), Settings(tolerance=1e-5))
    assert np.array_equal(ends.status, others.status)
    escaped = ends.status == Status.ESCAPED
    apart = angles(ends.direction.astype(float), others.direction.astype(float))[escaped]
    assert escaped.sum() > 150 and np.percentile(apart, 99) < 2e-5


# In pictures


@pytest.mark.parametrize("observer", ["chart", "static", "moving"])
def test_the_picture_is_that_of_rays_in_space(egl, observer):
    """With a filtered sky and every pass, from 6 M: both within the tolerance of the truth, so within twice of each
    other, away from the shadow's edge, where a ray turns by more than its error.
    """
    passes = ("Combined", "Depth", "Direction", "Status", "Steps", "Error", "Drift", "Frequency Shift")
    faces = np.random.default_rng(4).uniform(0.0, 1.0, (6, 1, 1, 3)).astype(np.float32)
    view = scenes.camera(64, 48, (0.0, -6.0, 1.0), half=1.5)
    scene = scenes.Scene(view, scenes.HOLE, environment=Environment((0, 0, 0), np.tile(faces, (1, 16, 16, 1))))
    settings = Settings(tolerance=1e-4, observer=observer, observer_velocity=(0.3, 0.1, -0.2), passes=passes)
    orbits = render(scene, settings)
    space = render(scene, replace(settings, **IN_SPACE))
    orbit, other = orbits.passes, space.passes
    same = (orbit["Status"] == other["Status"])[..., 0]
    assert same.mean() > 0.999
    escaped = same & (orbit["Status"][..., 0] == Status.ESCAPED)
    turned = np.linalg.norm(orbit["Direction"] - other["Direction"], axis=-1)[escaped]
    assert np.percentile(turned, 99) < 2e-4
    assert np.array_equal(orbit["Frequency Shift"][escaped], other["Frequency Shift"][escaped])
    assert np.array_equal(orbit["Depth"], other["Depth"])
    assert np.percentile(np.abs(orbit["Combined"] - other["Combined"]), 99) < 0.02
    assert orbit["Drift"][escaped].max() < 1e-3 and (orbit["Error"][escaped] > 0.0).any()
    assert orbit["Steps"][escaped].mean() < 0.6 * other["Steps"][escaped].mean()
    assert all(np.isfinite(values).all() for values in orbit.values())
