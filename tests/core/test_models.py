"""The float64 right-hand sides against independent physics: the geodesic equation with all Christoffel symbols."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from addon.core.compose import SHADERS, read
from addon.core.models import MODELS, ParameterError
from addon.core.scene import Placement

ALL = [MODELS[name]() for name in MODELS]


def metric(x, mass):
    """g_mn of Schwarzschild in pseudo-Cartesian coordinates (t, x, y, z), signature (-+++); x : (3,)."""
    r = np.linalg.norm(x)
    g = np.zeros((4, 4))
    g[0, 0] = -(1.0 - 2.0 * mass / r)
    # dr^2 / (1 - 2M/r) + r^2 dOmega^2 = dx.dx + (2M / (r - 2M)) dr^2, and dr = x.dx / r
    g[1:, 1:] = np.eye(3) + 2.0 * mass / (r - 2.0 * mass) * np.outer(x, x) / r**2
    return g


def metric_derivative(x, mass):
    """(4, 4, 4): axis 0 is the coordinate that g is differentiated by."""
    r = np.linalg.norm(x)
    a = 2.0 * mass / (r**3 - 2.0 * mass * r**2)  # g_ij = delta_ij + a x_i x_j
    a_prime = -2.0 * mass * (3.0 * r**2 - 4.0 * mass * r) / (r**3 - 2.0 * mass * r**2) ** 2
    d = np.zeros((4, 4, 4))
    unit = np.eye(3)
    for k in range(3):
        d[k + 1, 0, 0] = -2.0 * mass * x[k] / r**3
        d[k + 1, 1:, 1:] = a_prime * x[k] / r * np.outer(x, x) + a * (np.outer(unit[k], x) + np.outer(x, unit[k]))
    return d


def christoffel(x, mass):
    """Gamma^m_nr of Appendix A, all 64 of them, from the metric and its derivatives."""
    d = metric_derivative(x, mass)
    lowered = 0.5 * (np.einsum("rmn->mnr", d) + np.einsum("nmr->mnr", d) - np.einsum("mnr->mnr", d))
    return np.einsum("ma,anr->mnr", np.linalg.inv(metric(x, mass)), lowered)


def geodesic(state, mass):
    """d/dtau of (t, x, y, z, t', x', y', z')."""
    velocity = state[4:]
    return np.concatenate([velocity, -np.einsum("mnr,n,r->m", christoffel(state[1:4], mass), velocity, velocity)])


def test_metric_derivative_agrees_with_differences():
    """Central differences of step 1e-5: their error is h^2 g''' / 6 + eps / h, both below 1e-9 here."""
    x = np.array([3.0, -4.0, 5.0])
    for k in range(3):
        shift = np.zeros(3)
        shift[k] = 1e-5
        numerical = (metric(x + shift, 1.3) - metric(x - shift, 1.3)) / 2e-5
        assert np.abs(numerical - metric_derivative(x, 1.3)[k + 1]).max() < 1e-9


@pytest.mark.parametrize("mass", [0.5, 1.0])
@pytest.mark.parametrize(
    ("b", "length"), [(10.0, 60.0), (6.0, 60.0), (5.3, 60.0), (-7.0, 60.0), (4.0, 27.0), (1.0, 26.5)]
)
def test_schwarzschild_orbits_are_null_geodesics(mass, b, length):
    """x(tau) of both, from (-30, b, 3)M and the same dx/dtau: scattered, nearly captured, and captured rays.

    Two DOP853 runs at rtol 1e-12 differ by their error of about 1e-11 a length, which the photon sphere of b = 5.3
    magnifies by e^(pi * turns) < 1e3; the geodesic form is singular at r = 2M, so that captured rays stop at r > 2.1M.
    """
    model = MODELS["schwarzschild"](mass=mass)
    x = mass * np.array([-30.0, b, 3.0])
    v = np.array([1.0, 0.0, -0.1])
    v /= np.linalg.norm(v)
    null = np.sqrt(v @ metric(x, mass)[1:, 1:] @ v / (1.0 - 2.0 * mass / np.linalg.norm(x)))

    def near_horizon(tau, state):
        return np.linalg.norm(state[1:4]) - 2.1 * mass

    near_horizon.terminal = True
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    truth = solve_ivp(
        lambda tau, state: geodesic(state, mass),
        (0.0, length * mass),
        np.concatenate([[0.0], x, [null], v]),
        events=near_horizon,
        dense_output=True,
        **options,
    )
    ours = solve_ivp(
        lambda tau, state: model.rhs(state[None])[0],
        (0.0, truth.t[-1]),
        np.concatenate([x, v]),
        dense_output=True,
        **options,
    )
    tau = np.linspace(0.0, truth.t[-1], 200)
    difference = np.linalg.norm(truth.sol(tau)[1:4] - ours.sol(tau)[:3], axis=0)
    assert difference.max() < 1e-8 * mass
    # The geodesic stayed null, so that the truth is one.
    end = truth.y[:, -1]
    assert abs(end[4:] @ metric(end[1:4], mass) @ end[4:]) < 1e-8


def test_schwarzschild_is_regular_at_the_horizon():
    states = np.array([[2.0, 0.0, 0.0, -1.0, 0.5, 0.0], [0.0, 2.0 - 1e-9, 0.0, 0.3, -1.0, 0.0]])
    assert np.isfinite(MODELS["schwarzschild"]().rhs(states)).all()


def test_without_mass_schwarzschild_is_straight():
    states = np.random.default_rng(3).normal(size=(50, 6))
    assert np.array_equal(MODELS["schwarzschild"](mass=0.0).rhs(states), MODELS["straight"]().rhs(states))


@pytest.mark.parametrize("model", ALL, ids=lambda model: model.name)
def test_every_model_is_complete(model):
    states = np.random.default_rng(2).normal(size=(7, 6)) + 5.0
    derivative = model.rhs(states)
    assert derivative.shape == (7, 6) and derivative.dtype == np.float64
    assert model.default_step() > 0 and math.isfinite(model.default_step())
    assert model.flat_radius() >= 0 and math.isfinite(model.flat_radius())
    assert all((SHADERS / f"{file}.glsl").is_file() for file in model.shader_files())
    text = "".join(read(file) for file in model.shader_files()) + "".join(text for _, text in model.generated())
    assert model.label and model.description and model.observers
    for parameter in model.parameters:
        if f"u_{parameter.name}" in model.uniforms() and not model.options:  # an option may leave a parameter out
            assert f"u_{parameter.name}" in text
        assert parameter.check(parameter.default) == parameter.default


@pytest.mark.parametrize(
    "model,parameter",
    [(model, parameter) for model in ALL for parameter in model.parameters],
    ids=lambda value: value.name,
)
@given(data=st.data())
def test_parameters_out_of_range_are_refused_by_name(model, parameter, data):
    bad = st.sampled_from([math.nan, math.inf, -math.inf, None, "much", [1.0]])
    if math.isfinite(parameter.minimum):
        bad |= st.floats(max_value=parameter.minimum, exclude_max=True)
    if math.isfinite(parameter.maximum):
        bad |= st.floats(min_value=parameter.maximum, exclude_min=True)
    value = data.draw(bad)
    with pytest.raises(ParameterError, match=rf"Model '{model.name}': .*'{parameter.name}'"):
        type(model)(**{parameter.name: value})


def test_unknown_parameters_are_refused_with_the_known_ones():
    with pytest.raises(ParameterError, match=r"'schwarzschild' has no parameter 'spin'\. It has: \['mass'\]"):
        MODELS["schwarzschild"](spin=0.5)


def test_parameters_are_attributes_and_nothing_else_is():
    assert MODELS["schwarzschild"](mass=2).mass == 2.0
    with pytest.raises(AttributeError):
        _ = MODELS["schwarzschild"]().charge


@pytest.mark.parametrize(("r", "problem"), [(0.0, True), (1.9, True), (2.0, True), (2.001, False), (30.0, False)])
def test_no_observer_inside_the_horizon(r, problem):
    position = r * np.array([0.6, 0.0, 0.8])
    found = MODELS["schwarzschild"]().observer_problem("static", position)
    assert (found is not None) == problem
    if problem:
        assert "horizon" in found and "Move the camera" in found


def test_placement_takes_points_into_the_models_space_and_keeps_lengths_of_directions():
    angle = 0.3
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    placement = Placement(np.array([1.0, 2.0, 3.0]), rotation, 4.0)
    model_points = np.random.default_rng(1).normal(size=(9, 3))
    world = np.array([placement.position + 4.0 * rotation @ point for point in model_points])
    assert placement.points_to_model(world) == pytest.approx(model_points, abs=1e-12)
    assert placement.directions_to_model(rotation[:, 0]) == pytest.approx([1, 0, 0], abs=1e-12)
