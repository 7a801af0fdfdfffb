"""Given rays around a black hole against closed forms and float64 integrations."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.scene import Scene
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.shaders import scenes, truth

EPS = 2.0**-24
START = 50.0  # M: the rays begin and end at this radius


def constant(step, length=2.5 * START, **options):
    """Euler steps of `step`, as many as a ray of this length needs."""
    options = {"steps_per_segment": 100, "max_steps": 10_000_000, "escape_radius": START} | options
    return scenes.papers(step_control="constant", step=step, segments=int(length / step / 100) + 1, **options)


def from_afar(b):
    """A ray at START whose impact parameter at infinity is b: h / E = b, with E^2 = 1 - 2 h^2 / r^3 and h = y."""
    y = b
    for _ in range(50):
        y = b * np.sqrt(1 - 2 * y * y / np.hypot(START, y) ** 3)
    return [-START, y, 0.0], [1.0, 0.0, 0.0]


def angle(direction):
    """Radians that rays which began along +x were turned by, towards -y."""
    return -np.arctan2(direction[:, 1].astype(float), direction[:, 0].astype(float))


def deflection(b, settings):
    """The turn before START, 3/4 b^3 / START^4 to first order, is added: 3e-5 at b = 6."""
    ends = trace_rays(scenes.HOLE, *np.array([from_afar(b)]).swapaxes(0, 1), settings)
    assert ends.status[0] == Status.ESCAPED
    return angle(ends.direction)[0] + 0.75 * b**3 / START**4


@pytest.mark.parametrize(("b", "expected"), [(6, 1.71938831023017), (10, 0.590395787605827)])
def test_the_closed_form_is_the_one_of_physics_md(b, expected):
    """And DOP853 agrees with it: from 1e4 M what is missing is below 1e-8."""
    assert truth.darwin(b) == pytest.approx(expected, abs=1e-13)
    end = truth.integrate(scenes.HOLE, [[-1e4, b, 0, 1, 0, 0]], 2e4)[0]
    assert angle(end[None, 3:])[0] == pytest.approx(expected, abs=2e-8)


@pytest.mark.parametrize("b", [6.0, 10.0])
def test_euler_meets_darwins_deflection_at_first_order(b):
    """Errors at three steps; each halving halves them, and their extrapolation to h = 0 meets the closed form.

    The ratio differs from 2 by the next order, c h: up to 5 % at h = 0.08, b = 6. A state that is rounded at each of
    N steps has a b that is wrong by up to N eps relative, which turns the ray by N eps |d alpha / d ln b|.
    """
    exact = truth.darwin(b)
    steps = np.array([0.08, 0.04, 0.02])
    found = np.array([deflection(b, constant(h)) for h in steps])
    error = found - exact
    ratios = error[:-1] / error[1:]
    once = 2 * found[1:] - found[:-1]
    twice = (4 * once[1] - once[0]) / 3
    print(f"\nb = {b} M: error {error} rad at h = {steps} M, ratios {ratios}, extrapolated {twice - exact:.1e} rad")
    assert (np.abs(ratios - 2.0) < 0.1).all()
    condition = b * abs(truth.darwin(b + 0.01) - truth.darwin(b - 0.01)) / 0.02
    rounding = 2 * START / steps[-1] * EPS * condition
    assert abs(twice - exact) < rounding


@pytest.mark.parametrize("b", [50.0, 99.0, 150.0])
def test_rays_of_a_far_camera_bend_outside_100_m_too(b):
    """From 1000 M, nothing chosen by hand: within 1e-3 rad, about a pixel of a common lens."""
    ends = trace_rays(
        scenes.HOLE, [[-1000.0, b, 0.0]], [[1.0, 0.0, 0.0]], scenes.papers(tolerance=1e-5, segments=20_000)
    )
    assert angle(ends.direction)[0] == pytest.approx(truth.darwin(b), abs=1e-3)


@pytest.mark.parametrize("control", ["constant", "doubling"])
def test_capture(control):
    """b = 5.0 M falls in, b = 5.4 M escapes: on either side of 3 sqrt 3 = 5.196."""
    settings = constant(0.02) if control == "constant" else scenes.papers(tolerance=1e-4, segments=5000)
    rays = np.array([from_afar(b) for b in (5.0, 5.4, -5.0, -5.4)])
    ends = trace_rays(scenes.HOLE, rays[:, 0], rays[:, 1], settings)
    assert ends.status.tolist() == [Status.ABSORBED, Status.ESCAPED] * 2


def test_whole_orbits_agree_with_float64():
    """The directions in which random rays escape: DOP853 far out. Euler's error is of first order; extrapolated
    from h and h/2 the second order is left.
    """
    generator = np.random.default_rng(6)
    x = generator.normal(size=(60, 3))
    x *= generator.uniform(8, 30, 60)[:, None] / np.linalg.norm(x, axis=1, keepdims=True)
    v = generator.normal(size=(60, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    b = np.linalg.norm(np.cross(x, v), axis=1)
    clear = (b > 7.5) | (np.sum(x * v, axis=1) > 0)
    x, v = x[clear].astype(np.float32), v[clear].astype(np.float32)
    coarse = trace_rays(scenes.HOLE, x, v, constant(0.02))
    fine = trace_rays(scenes.HOLE, x, v, constant(0.01))
    escaped = (coarse.status == Status.ESCAPED) & (fine.status == Status.ESCAPED)
    assert escaped.all()
    errors = []
    for i in range(len(x)):
        unit = v[i].astype(float) / np.linalg.norm(v[i].astype(float))
        exact = truth.at_infinity(scenes.HOLE, x[i][None], unit[None])[0]
        wrong = [ends.direction[i] - exact for ends in (coarse, fine)]
        errors.append([np.linalg.norm(wrong[0]), np.linalg.norm(wrong[1]), np.linalg.norm(2 * wrong[1] - wrong[0])])
    errors = np.array(errors)
    assert errors[:, 1].max() < 0.01
    assert np.median(errors[:, 0] / errors[:, 1]) == pytest.approx(2.0, abs=0.15)
    # Second order of the steps, (h / pericentre)^2 * pi < 1e-4, and 1e4 roundings.
    assert errors[:, 2].max() < 1e-4 + 1e4 * EPS


def test_without_a_model_rays_are_straight():
    """Without objects a straight ray ends behind the centre, on the line that it began on."""
    generator = np.random.default_rng(1)
    x, v = generator.normal(size=(2, 600, 3)).astype(np.float32)
    ends = trace_rays(scenes.STRAIGHT, x, v, scenes.papers())
    unit = v / np.linalg.norm(v.astype(float), axis=1, keepdims=True)
    assert (ends.status == Status.ESCAPED).all()
    assert np.abs(ends.direction - unit).max() < 3 * EPS
    assert np.abs(np.cross(ends.position - x, unit)).max() < 20 * EPS * np.abs(ends.position).max()
    assert (ends.parameter > 0).all()


def test_massless_schwarzschild_is_straight():
    x, v = np.array([[-30.0, 1.0, 0.0], [-30.0, 0.0, 0.1]]), np.array([[1.0, 0.0, 0.0], [0.9, 0.1, 0.2]])
    ends = trace_rays(MODELS["schwarzschild"](mass=0.0), x, v, constant(0.5))
    assert np.abs(ends.direction - v / np.linalg.norm(v, axis=1, keepdims=True)).max() < 4 * EPS


def test_step_doubling_gains_by_a_smaller_tolerance():
    """The error of the deflection at b = 6 and 10 M falls with the tolerance, by at least half for each tenth, until it
    meets the rounding of float32.
    """
    for b in (6.0, 10.0):
        exact = truth.darwin(b)
        settings = [scenes.papers(tolerance=t, segments=100_000, escape_radius=START) for t in (1e-2, 1e-3, 1e-4)]
        errors = np.abs([deflection(b, each) - exact for each in settings])
        print(f"\nb = {b} M, step doubling at 1e-2, 1e-3, 1e-4: errors {errors} rad")
        assert errors[1] < 0.5 * errors[0] and errors[2] < 0.5 * errors[1]


def test_step_doublings_own_estimate_grows_with_its_error():
    """RayEnds.error, the sum of the accepted differences: above a tenth of the true error, below a hundred times it."""
    ends = [
        trace_rays(
            scenes.HOLE,
            *np.array([from_afar(6.0)]).swapaxes(0, 1),
            scenes.papers(tolerance=t, segments=100_000, escape_radius=START),
        )
        for t in (1e-2, 1e-3)
    ]
    for end in ends:
        true = abs(angle(end.direction)[0] + 0.75 * 6.0**3 / START**4 - truth.darwin(6.0))
        assert 0.1 * true < end.error[0] < 100 * true
    assert ends[1].error[0] < ends[0].error[0]


def test_invariants_drift_is_what_the_end_says():
    """Drift, from the end itself in float64: h and E^2 = v^2 - 2 h^2 / r^3; and it falls with the step."""
    drifts = []
    for h in (0.04, 0.02):
        start, direction = np.array([from_afar(6.0)]).swapaxes(0, 1)
        ends = trace_rays(scenes.HOLE, start, direction, constant(h))
        drifts.append(ends.invariant_drift[0])
        assert ends.invariant_drift.dtype == np.float32
    # Euler gains h = |x cross v| steadily: the exact momentum of 6 grows by the first-order error.
    assert 0 < drifts[1] < drifts[0] < 0.1
    assert drifts[0] / drifts[1] == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_objects_end_rays(model):
    """A ball of radius 1 at 20 M beside the hole: hit where the sphere is, tau the length to it."""
    ball = scenes.spheres([[0.0, 20.0, 0.0]], 1.0)
    scene = Scene(scenes.camera(), scenes.STRAIGHT, spheres=ball)
    ends = trace_rays(
        MODELS[model](), [[0.0, 30.0, 0.0], [0.0, 30.0, 3.0]], [[0, -1, 0], [0, 0, 1]], constant(0.02), scene=scene
    )
    assert ends.status.tolist() == [Status.HIT, Status.ESCAPED]
    # Radial rays are straight in the chart. The depth is segment index + fraction: 5 segments of 2 M, eps * 8 * 2 M.
    assert ends.position[0] == pytest.approx([0, 21, 0], abs=30 * EPS * 30)
    # x is the sum of 450 steps that are rounded to its own ulp, tau is not.
    assert ends.parameter[0] == pytest.approx(9.0, abs=450 * EPS * 32)


# How rays end


def ray(b=6.0):
    return np.array([from_afar(b)]).swapaxes(0, 1)


def test_step_limit():
    ends = trace_rays(scenes.HOLE, *ray(), scenes.papers(segments=3))
    assert ends.status[0] == Status.STEP_LIMIT
    assert np.linalg.norm(ends.position[0]) < START + 1


@pytest.mark.parametrize("max_steps", [1, 7, 25, 100])
@pytest.mark.parametrize("control", ["constant", "doubling"])
def test_no_ray_takes_more_steps_than_allowed(max_steps, control):
    ends = trace_rays(scenes.HOLE, *ray(), scenes.papers(step_control=control, max_steps=max_steps))
    assert ends.status[0] == Status.STEP_LIMIT
    # A segment of step doubling is three steps at least: h, and twice h / 2.
    assert 0 < ends.steps[0] <= max(max_steps, 3 if control == "doubling" else 1)


def test_a_tolerance_below_float32_ends_in_a_named_status():
    """No step of float32 meets 1e-9 rad next to the hole; rays say so, and in finite time. What the first one says is
    known all the same: light that goes inwards within the photon sphere is absorbed.
    """
    x = np.array([[2.05, 0, 0], [3.0, 0, 0], [-START, 5.2, 0]])
    ends = trace_rays(scenes.HOLE, x, [[0, 1, 0], [0, 1, 0], [1, 0, 0]], scenes.papers(tolerance=1e-9, segments=1000))
    assert ends.status[0] == Status.ABSORBED
    assert set(ends.status[1:]) <= {Status.STEP_TOO_SMALL, Status.STEP_LIMIT}
    assert np.isfinite(ends.position).all() and np.isfinite(ends.direction).all()


@pytest.mark.parametrize("step", [1e-6, 1e3, 1e6])
def test_the_first_step_does_not_matter_where_steps_adapt(step):
    """A first step that is far too large is taken back until it fits, and is no reason to call a step too small."""
    ends = trace_rays(scenes.HOLE, *ray(10.0), scenes.papers(step=step, segments=5000, tolerance=1e-4))
    assert ends.status[0] == Status.ESCAPED
    assert angle(ends.direction)[0] == pytest.approx(truth.darwin(10.0), abs=0.01)


def test_not_finite():
    """A step of 1e11 M gives a speed of 7e10, and h^2 = 5e39 overflows; the end is the last point that was a number."""
    settings = scenes.papers(step_control="constant", step=1e9, segments=5)
    ends = trace_rays(MODELS["schwarzschild"](mass=0.01), [[0.021, 0.0, 0.0]], [[0.0, 1.0, 0.0]], settings)
    assert ends.status[0] == Status.NOT_FINITE
    for name, values in vars(ends).items():
        assert np.isfinite(values).all(), name


def test_escaped_and_absorbed():
    rays = np.array([from_afar(b) for b in (0.0, 1.0, 20.0)])
    ends = trace_rays(scenes.HOLE, rays[:, 0], rays[:, 1], scenes.papers(segments=5000))
    assert ends.status.tolist() == [Status.ABSORBED, Status.ABSORBED, Status.ESCAPED]
    assert np.linalg.norm(ends.position[:2], axis=1) == pytest.approx(2.0, rel=3e-5)  # on the horizon
    assert np.linalg.norm(ends.position[2]) >= 100.0  # the flat radius


def test_no_step_jumps_over_the_hole():
    """Rays that fall in from anywhere with b from 0 to 4 M, where the field hardly bends them until they are there."""
    radius = np.geomspace(10.0, 5000.0, 400)
    b = np.tile([0.0, 0.01, 0.3, 1.0, 4.0], 80)
    x = np.stack([-np.sqrt(radius**2 - b**2), b, 0 * b], axis=1)
    ends = trace_rays(scenes.HOLE, x, np.tile([1.0, 0, 0], (400, 1)), scenes.papers(segments=5000))
    lost = ends.status != Status.ABSORBED
    assert not lost.any(), f"{lost.sum()} of 400 went through, b = {np.unique(b[lost])}, r = {radius[lost][:5]}"


# What is refused


def test_rays_of_wrong_shapes_or_values():
    good = np.ones((2, 3))
    with pytest.raises(ValueError, match=r"'positions' has the shape \(2, 2\), but needs \(n, 3\)"):
        trace_rays(scenes.HOLE, good[:, :2], good, scenes.papers())
    with pytest.raises(ValueError, match="2 positions but 1 directions"):
        trace_rays(scenes.HOLE, good, good[:1], scenes.papers())
    with pytest.raises(ValueError, match="'directions' holds values that are not finite"):
        trace_rays(scenes.HOLE, good, good * np.nan, scenes.papers())
    with pytest.raises(ValueError, match="A direction is zero"):
        trace_rays(scenes.HOLE, good, [[1, 0, 0], [0, 0, 0]], scenes.papers())


def test_no_rays():
    ends = trace_rays(scenes.HOLE, np.zeros((0, 3)), np.zeros((0, 3)), scenes.papers())
    assert ends.position.shape == (0, 3) and ends.status.shape == (0,)


@pytest.mark.parametrize("n", [1, 255, 256, 257, 600])
def test_any_number_of_rays(n):
    """Rays are folded into rows of 256; each keeps its place."""
    x = np.tile([[0.0, 30.0, 0.0]], (n, 1)) + np.arange(n)[:, None] * [[1e-3, 0, 0]]
    ends = trace_rays(scenes.STRAIGHT, x, np.tile([[0.0, 1.0, 0.0]], (n, 1)), scenes.papers())
    assert ends.position.shape == (n, 3)
    assert ends.position[:, 0] == pytest.approx(x[:, 0], abs=1e-7)
