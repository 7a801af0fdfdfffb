"""Lorenz and Rössler, as force and as flow, against float64."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core import reference
from addon.core.models import MODELS
from addon.core.settings import Settings
from addon.core.status import FAILURES, Status
from addon.core.trace import trace_rays
from tests.shaders.model_checks import (
    EPS,
    HIGH,
    all_finite,
    derivatives,
    errors,
    on_gpu,
    parallel_rays,
    programs,
    states,
)
from tests.shaders.truth import integrate

SYSTEMS = ("lorenz", "roessler")
LORENZ_AT_1 = (-9.378570010925, -8.357033788427, 29.362325337363)  # physics.md, from (1, 1, 1)


def flow(name, **values):
    return MODELS[name](mode="flow", plane_distance=0.0, **values)


@pytest.mark.parametrize("mode", ["force", "flow"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_right_hand_side(glsl, name, mode):
    """At radii up to 200, through the rim of the reach. Each component is a sum of at most four products of three
    rounded numbers; in flow mode its derivative times it. 20 eps of the sum of their sizes; at the rim the fading
    factor adds |d fade / d r| r eps = 1.5 / 0.2 eps.
    """
    model, given = MODELS[name](mode=mode, strength=0.3), states(farthest=200.0)
    found, exact = derivatives(glsl, model, given)
    x = np.abs(given[:, :3].astype(float))
    largest = max(np.abs(model.field(np.eye(3))).max(), 1.0)
    size = largest * np.sum(x, axis=1) + np.sum(x, axis=1) ** 2 + 2.0  # of any component of the field
    change = largest + 2.0 * np.sum(x, axis=1)
    bound = 20 * EPS * np.stack([size, change * size], axis=1) if mode == "flow" else None
    if mode == "force":
        bound = np.stack([np.zeros(len(size)), 28 * EPS * 0.3 * size], axis=1)
    error = np.abs(found - exact).reshape(-1, 2, 3).max(axis=2)
    print(f"largest error, parts of its bound: {(error / np.maximum(bound, 1e-300)).max(axis=0)}")
    assert (error <= bound).all()


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_flows_derivative_is_that_of_the_field(name):
    """Central differences of a polynomial of degree two are exact but for rounding: eps64 |x|^2 / 1e-3."""
    model = flow(name)
    given = states(50).astype(float)
    x, along = given[:, :3], given[:, 3:]
    numerical = (model.field(x + 1e-3 * along) - model.field(x - 1e-3 * along)) / 2e-3
    assert model.field_change(x, along) == pytest.approx(numerical, abs=1e-8)


def rounding(model, start, length, steps):
    """What rounding the state once a step does to the end, as a random walk: eps |x| at each of them, carried to the
    end by the flow, whose derivative differences of float64 runs give; and three times that.
    """
    squares = 0.0
    times = np.linspace(0.0, length, 9)[:-1]
    for time in times:
        here = integrate(model, start[None], time)[0] if time else start
        starts = np.concatenate([here[None], here + 1e-5 * np.eye(6)[:3]])
        ends = integrate(model, starts, length - time)[:, :3]
        carried = (ends[1:] - ends[0]) / 1e-5
        squares += np.sum(carried**2) * (EPS * np.linalg.norm(here[:3])) ** 2
    return 3.0 * np.sqrt(squares / len(times) * steps)


@pytest.mark.parametrize(("integrator", "steps"), [("dormand_prince_54", 128), ("runge_kutta_4", 512)])
def test_lorenz_state(integrator, steps):
    """At t = 1 exactly: n steps of 1/n. Both methods' own error there is below 2e-6 (halving h shows it)."""
    model = flow("lorenz")
    settings = Settings(
        integrator=integrator, step_control="constant", step=1 / steps, segments=steps // 64, steps_per_segment=64
    )
    ends = trace_rays(model, [[1, 1, 1]], [[1, 0, 0]], settings)
    assert ends.parameter[0] == 1.0 and ends.status[0] == Status.STEP_LIMIT
    start = model.initial_states(np.ones((1, 3)), np.array([[1.0, 0, 0]]))[0]
    assert integrate(model, start[None], 1.0)[0, :3] == pytest.approx(LORENZ_AT_1, abs=1e-10)
    error = np.linalg.norm(ends.position[0] - LORENZ_AT_1)
    bound = rounding(model, start, 1.0, steps) + 2e-6
    f = model.field(np.array([LORENZ_AT_1]))[0]
    turn = np.linalg.norm(ends.direction[0] - f / np.linalg.norm(f))
    print(f"{integrator}: position {error:.2e} (bound {bound:.2e}), direction {turn:.2e} rad")
    assert error <= bound
    # v is carried along by its own equation; the field changes by up to |J| / |f| = 30 / 100 a length.
    assert turn <= bound


@pytest.mark.parametrize("length", [1.0, 10.0])
def test_roessler_state(length):
    model, steps = flow("roessler", duration=100.0), 1024
    settings = Settings(
        integrator="runge_kutta_4", step_control="constant", step=length / steps, segments=16, steps_per_segment=64
    )
    ends = trace_rays(model, [[1, 1, 1]], [[1, 0, 0]], settings)
    start = model.initial_states(np.ones((1, 3)), np.array([[1.0, 0, 0]]))[0]
    exact = integrate(model, start[None], length)[0]
    error, bound = np.linalg.norm(ends.position[0] - exact[:3]), rounding(model, start, length, steps)
    print(f"t = {length}: {error:.2e} (bound {bound:.2e})")
    assert ends.parameter[0] == length and error <= bound


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_flow_adapts_its_steps(name):
    """Embedded control, compared at the tau where it happens to end: three rays from around (1, 1, 1)."""
    generator = np.random.default_rng(4)
    positions = (1.0 + 0.3 * generator.normal(size=(3, 3))).astype(np.float32)
    directions = np.tile(np.float32((1, 0, 0)), (3, 1))
    settings = Settings(
        integrator="dormand_prince_54", step_control="embedded", tolerance=1e-5, segments=4, steps_per_segment=10
    )
    model = flow(name)
    ends = trace_rays(model, positions, directions, settings)
    for i in range(3):
        start = model.initial_states(positions[i : i + 1].astype(float), directions[i : i + 1].astype(float))[0]
        bound = rounding(model, start, float(ends.parameter[i]), 40)
        exact = integrate(model, start[None], float(ends.parameter[i]))[0]
        # The tolerance is an angle seen from the centre; the flow magnifies it as it does rounding.
        bound *= 1.0 + settings.tolerance / EPS
        assert np.linalg.norm(ends.position[i] - exact[:3]) <= bound
    assert (ends.parameter > 0.1).all() and all_finite(ends)


@pytest.mark.parametrize("name", SYSTEMS)
def test_force_against_float64(name):
    """Strength 1e-4 bends rays by up to a radian on their way through the reach."""
    model = MODELS[name](strength=1e-4)
    ends, found, allowed = errors(model, *parallel_rays(np.geomspace(0.2, 10.0, 8)))
    bent = np.linalg.norm(ends.direction - [1, 0, 0], axis=1)
    print(f"{name}: bent by up to {bent.max():.2f}, error max {found.max():.2e} median {np.median(found):.2e} rad")
    assert (ends.status == Status.ESCAPED).all() and bent.max() > 0.1
    assert (found <= allowed).all(), (found / allowed).max()


@pytest.mark.parametrize("name", SYSTEMS)
def test_straight_limit(name):
    positions, directions = parallel_rays(np.geomspace(0.2, 10.0, 16))
    assert np.array_equal(trace_rays(MODELS[name](strength=0.0), positions, directions, HIGH).direction, directions)
    # |f| is below 3e4 within the reach, which a ray needs 200 to cross: 200 * 3e4 * 1e-13 = 6e-7.
    weak = trace_rays(MODELS[name](strength=1e-13), positions, directions, HIGH)
    assert np.abs(weak.direction - directions).max() < 6e-7 + EPS


@pytest.mark.parametrize("pipeline", ["paper", "fused"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_directions_do_not_depend_on_where_a_ray_ends(name, pipeline):
    """Beyond the reach there is no force: farther out the same direction. In the fused pipeline the size of the first
    step depends on how far out that is, so that there both are compared with float64.
    """
    model = MODELS[name](strength=1e-3)
    rays = parallel_rays(np.geomspace(0.2, 10.0, 16))
    near, far = (
        errors(model, *rays, replace(HIGH, pipeline=pipeline, escape_radius=radius)) for radius in (100.0, 1000.0)
    )
    assert (np.linalg.norm(far[0].position, axis=1) > 1000).all()
    if pipeline == "paper":
        assert np.array_equal(near[0].direction, far[0].direction)
    for _, found, allowed in (near, far):
        print(f"{name}, {pipeline}: error max {found.max():.1e}, of the allowed {(found / allowed).max():.2f}")
        assert (found <= allowed).all()


@pytest.mark.parametrize("pipeline", ["paper", "fused"])
@pytest.mark.parametrize("control", ["constant", "doubling", "embedded"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_flow_ends_after_its_duration(name, control, pipeline):
    """At the same point of the flow, whatever the steps were; the bound as in test_a_flow_adapts_its_steps, and for
    constant steps, whose Dormand-Prince error is below 2e-6 (test_lorenz_state), that of rounding.
    """
    model = flow(name, duration=1.03)
    settings = Settings(
        pipeline=pipeline, integrator="dormand_prince_54", step_control=control, step=0.01, tolerance=1e-5, segments=50
    )
    ends = trace_rays(model, [[1, 1, 1]], [[1, 0, 0]], settings)
    start = model.initial_states(np.ones((1, 3)), np.array([[1.0, 0, 0]]))
    exact = integrate(model, start, 1.03)[0]
    bound = rounding(model, start[0], 1.03, 300) * (1.0 if control == "constant" else 1.0 + settings.tolerance / EPS)
    error = np.linalg.norm(ends.position[0] - exact[:3])
    print(f"{name}, {control}, {pipeline}: {error:.1e} (bound {bound:.1e}), {ends.steps[0]} steps")
    assert ends.status[0] == Status.LEFT_DOMAIN
    assert ends.parameter[0] == pytest.approx(1.03, rel=120 * EPS)  # the sum of some 100 steps
    assert error <= bound + 2e-6
    truth = reference.true_ends(model, np.ones((1, 3)), np.array([[1.0, 0, 0]]))
    assert truth.status[0] == Status.LEFT_DOMAIN
    assert truth.position[0] == pytest.approx(exact[:3], abs=1e-9)


def test_flows_begin_at_the_image_plane(glsl):
    model = MODELS["lorenz"](mode="flow", plane_distance=3.5)
    given = states(100)
    body = "RayState s = initial_state(x.xyz, v.xyz); out_x = vec4(s.x, 0.0); out_v = vec4(s.v, 0.0);"
    found = on_gpu(glsl, model, body, given, ("x", "v"))
    exact = model.initial_states(*np.split(given.astype(float), 2, axis=1))
    assert exact[:, :3] == pytest.approx(given[:, :3] + 3.5 * given[:, 3:].astype(float), rel=1e-15)
    size = np.linalg.norm(exact[:, :3], axis=1)
    assert (np.abs(found["x"][:, :3] - exact[:, :3]).max(axis=1) <= 2 * EPS * (size + 3.5)).all()
    # The rounding of x, times the field's derivative of at most 30 + 2 |x|, and the field's own.
    assert (np.abs(found["v"][:, :3] - exact[:, 3:]).max(axis=1) <= 8 * EPS * (30 + 2 * size) * (size + 3.5)).all()


def test_a_flow_that_rests_looks_along_the_camera():
    """The origin is a fixed point of Lorenz: nothing moves, and the direction is the one it was given."""
    direction = np.float32([[0.6, 0.0, 0.8]])
    ends = trace_rays(flow("lorenz"), [[0, 0, 0]], direction, Settings(segments=3))
    assert np.array_equal(ends.position, [[0, 0, 0]]) and np.abs(ends.direction - direction).max() < 2 * EPS
    assert ends.status[0] == Status.LEFT_DOMAIN and all_finite(ends)
    model = flow("lorenz")
    state = model.initial_states(np.zeros((1, 3)), direction.astype(float))
    assert model.ray_directions(state) == pytest.approx(direction, abs=1e-7)


@pytest.mark.parametrize("mode", ["force", "flow"])
@pytest.mark.parametrize(("name", "values"), [("roessler", {"gamma": 100.0}), ("lorenz", {"rho": 1000.0})])
@pytest.mark.parametrize("settings", [HIGH, Settings(), Settings(step_control="constant")], ids=["high", "paper", "h"])
def test_stiff_systems_end_in_a_named_status(name, values, mode, settings):
    ends = trace_rays(MODELS[name](mode=mode, **values), *parallel_rays(np.geomspace(0.1, 10, 8)), settings)
    assert all_finite(ends) and set(ends.status) <= {Status.ESCAPED, Status.LEFT_DOMAIN, *FAILURES}
    print(
        {
            Status(status).name: int(count)
            for status, count in zip(*np.unique(ends.status, return_counts=True), strict=True)
        }
    )


def test_values_compile_nothing_and_the_mode_does():
    rays = parallel_rays(np.array([1.0, 2.0]))
    trace_rays(MODELS["lorenz"](), *rays, Settings(segments=2))
    before = programs()
    trace_rays(
        MODELS["lorenz"](sigma=1.0, rho=2.0, beta=3.0, strength=0.1, reach=7.0, plane_distance=2.0, duration=3.0),
        *rays,
        Settings(segments=2),
    )
    assert programs() == before
    assert MODELS["lorenz"]().flags() != MODELS["lorenz"](mode="flow").flags()
