"""What models conserve, in both pipelines: the drift that rays report, and closed forms where nothing is reported."""

import numpy as np
import pytest

from tests.shaders.model_checks import EPS, on_gpu
from tests.shaders.smooth_rays import PARABOLA, PIPELINES, WAYS, Way, flow, in_float64, traced

INTEGRATOR, STEPS = "dormand_prince_54", 32
PARTS = (slice(0, 3), slice(3, 6))  # of a state: x, v
UNCONSERVING = ("lorenz", "roessler", "custom")
WITH_INVARIANTS = {name: way for name, way in (WAYS | {"linear": PARABOLA}).items() if way.model not in UNCONSERVING}


@pytest.mark.parametrize("name", WITH_INVARIANTS)
def test_drift(glsl, name):
    """Of energies, and of momenta, where there are any, as a part of the largest. Four roundings of x and v a step, as
    a random walk, in invariants as large as themselves or as |x||v|; and what the same steps are off by in float64.
    """
    way = WITH_INVARIANTS[name]
    model, _, _, states = way.start()
    first = np.abs(on_gpu(glsl, model, "out_result = invariants(RayState(x.xyz, v.xyz));", states)["result"])
    largest, momenta = first.max(axis=1), first[:, 1:].any()
    x, v = (np.maximum(*(np.linalg.norm(s[:, part], axis=1) for s in (states, way.exact))) for part in PARTS)
    method = np.abs(in_float64(way, INTEGRATOR, STEPS)[0] - way.exact).max(axis=1)
    change = (x + v if momenta else v / largest) * method
    bound = (4.0 * EPS * np.sqrt(STEPS) * (largest + (x * v if momenta else 0.0)) + 2.0 * change) / largest
    for pipeline in PIPELINES:
        drift = traced(way, pipeline, INTEGRATOR, STEPS).invariant_drift
        print(f"{name}, {pipeline}: drift {drift.max():.1e}, {(drift / bound).max():.2f} of its bound")
        assert (drift <= bound).all()


# Flows with a closed form


def rounding(way):
    """How far the end may be off, model lengths: twelve times what rounding does to the same steps in float64, and what
    they are off by there.
    """
    twin, rounded = (states[:, :3] for states in in_float64(way, INTEGRATOR, STEPS))
    moved, off = (np.linalg.norm(gap, axis=1).max() for gap in (rounded - twin, twin - way.exact[:, :3]))
    return 12.0 * moved + off


def lorenz(length, **values):
    way = flow("lorenz", (3.0, 2.0, 4.0), length)
    way.values |= values
    return way


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_a_surface_that_lorenz_flow_shrinks(pipeline):
    """With beta = 2 sigma, (x^2 - 2 sigma z)' = -2 sigma (x^2 - 2 sigma z): it falls as e^(-2 sigma tau)."""
    way = lorenz(0.25, sigma=2.0, beta=4.0, rho=10.0)
    start, end = way.start()[3], traced(way, pipeline, INTEGRATOR, STEPS).position.astype(float)
    found, first = (x[:, 0] ** 2 - 4.0 * x[:, 2] for x in (end, start))
    error = np.abs(found - first * np.exp(-4.0 * way.length)).max()
    bound = rounding(way) * (2.0 * np.abs(end[:, 0]).max() + 4.0)
    print(f"{pipeline}: {error:.1e}, bound {bound:.1e}")
    assert error <= bound and np.abs(first).min() > 1.0


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_a_circle_that_lorenz_flow_shrinks(pipeline):
    """With rho = 0 and beta = 1, (y^2 + z^2)' = -2 (y^2 + z^2)."""
    way = lorenz(0.5, sigma=1.0, beta=1.0, rho=0.0)
    start, end = way.start()[3], traced(way, pipeline, INTEGRATOR, STEPS).position.astype(float)
    found, first = (np.sqrt(x[:, 1] ** 2 + x[:, 2] ** 2) for x in (end, start))
    error = np.abs(found - first * np.exp(-way.length)).max()
    bound = rounding(way)
    print(f"{pipeline}: {error:.1e}, bound {bound:.1e}")
    assert error <= bound


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_roessler_flow_in_its_plane(pipeline):
    """With beta = 0 the plane z = 0 is kept, where x' = -x and y' = x + alpha y have the solution
    x = x0 e^-tau,  y = (y0 + x0 / (1 + alpha)) e^(alpha tau) - x0 / (1 + alpha) e^-tau.
    """
    alpha = 0.375
    values = {"mode": "flow", "plane_distance": 0.0, "alpha": alpha, "beta": 0.0}
    way = Way("roessler", (1.0, 1.0, 0.0), (1, 0, 0), 2.0, values, flat=True)
    start, end = way.start()[3], traced(way, pipeline, INTEGRATOR, STEPS).position.astype(float)
    x, y = start[:, 0], start[:, 1]
    shrunk = np.exp(-way.length) / (1.0 + alpha)
    exact = np.stack(
        [x * np.exp(-way.length), (y + x / (1.0 + alpha)) * np.exp(alpha * way.length) - x * shrunk, 0.0 * x], axis=1
    )
    error, bound = np.linalg.norm(end - exact, axis=1).max(), rounding(way)
    print(f"{pipeline}: {error:.1e}, bound {bound:.1e}")
    assert error <= bound and (end[:, 2] == 0.0).all()


# A typed force


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_a_typed_central_force_keeps_energy_and_angular_momentum(pipeline):
    """V = -1 / sqrt(r^2 + 1). |x cross v| gives |v| at the end, the direction of x cross v must stay, and so must
    v^2 / 2 + V.
    """
    newton = {f"f{axis}": f"-{axis} / (r^2 + 1)^1.5" for axis in "xyz"}
    way = Way("custom", (-2.0, 1.0, 0.5), (1, 0, 0), 4.0, newton)
    _, _, _, states = way.start()
    ends = traced(way, pipeline, INTEGRATOR, STEPS)
    x, d = ends.position.astype(float), ends.direction.astype(float)
    before, after = np.cross(states[:, :3], states[:, 3:]), np.cross(x, d)
    speed = np.linalg.norm(before, axis=1) / np.linalg.norm(after, axis=1)
    turned = np.linalg.norm(np.cross(before, after), axis=1) / np.linalg.norm(before, axis=1)
    energies = [
        0.5 * v**2 - 1.0 / np.sqrt(np.sum(place**2, axis=1) + 1.0) for v, place in ((1.0, states[:, :3]), (speed, x))
    ]
    gained = np.abs(energies[1] - energies[0])
    # An end that is off by an angle has a speed that is off by it over the angle between x and v.
    slant = np.linalg.norm(x, axis=1) / np.linalg.norm(after, axis=1)
    bound = rounding(way)
    print(f"{pipeline}: energy {gained.max():.1e}, plane {turned.max():.1e}, bound {bound:.1e}")
    assert (gained <= bound * (1.0 + speed**2 * slant)).all()
    assert (turned <= bound * (1.0 + np.linalg.norm(x, axis=1))).all()
