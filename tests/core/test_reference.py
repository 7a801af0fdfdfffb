"""The reference is held against SciPy's DOP853, mpmath and closed forms: nothing else stands above it."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from addon.core import dop853
from addon.core.models import MODELS
from addon.core.reference import CONVERGED, TOLERANCE, angles, true_ends
from addon.core.status import Status
from addon.core.tableaus import density, size, trees
from tests.shaders.truth import CRITICAL, darwin

HOLE = MODELS["schwarzschild"](mass=1.0)
# The steps of a ray, some 200, each wrong by the tolerance at most, and what the model makes of that on the way.
SUMMED = 200 * TOLERANCE


def beams(b, start):
    """Along +X from x = -start, b above the X axis."""
    b = np.asarray(b, float)
    return np.stack([np.full(len(b), -start), b, 0 * b], axis=1), np.tile((1.0, 0.0, 0.0), (len(b), 1))


def turned(directions):
    """Angle from +X towards -Y, in [0, 2 pi)."""
    return np.mod(-np.arctan2(directions[:, 1], directions[:, 0]), 2 * np.pi)


def elementary(tree):
    """(STAGES,): the left side of the tree's order condition, a value a stage."""
    values = np.ones(dop853.STAGES)
    for branch in tree:
        below = elementary(branch)
        values *= [np.dot(row, below[: len(row)]) for row in dop853.A]
    return values


def test_coefficients_meet_the_order_conditions():
    """b for all trees of up to 8 nodes, the estimates up to the orders they are zero to. Sums of twelve terms of up to
    43, the largest coefficient, in float64.
    """
    rounding = 12 * 43 * 2.0**-52
    for tree in trees(8):
        values = elementary(tree)
        assert abs(np.dot(dop853.B, values) - float(Fraction(1, density(tree)))) < rounding, tree
        if size(tree) <= 5:
            assert abs(np.dot(dop853.FIFTH, values)) < rounding, tree
        if size(tree) <= 3:
            assert abs(np.dot(dop853.THIRD, values)) < rounding, tree


def test_a_step_has_order_eight():
    """x'' = -x, a quarter turn in n steps: the error falls as n^-8."""

    def spring(states):
        return np.concatenate([states[:, 3:], -states[:, :3]], axis=1)

    found = []
    for n in (4, 8):
        state = np.array([[1.0, 0, 0, 0, 0, 0]])
        for _ in range(n):
            state, _ = dop853.step(spring, state, spring(state), np.array([4.0 / n]))
        found.append(abs(state[0, 0] - np.cos(4.0)))
    assert 7.5 < np.log2(found[0] / found[1]) < 9.5


def test_deflection_is_darwins():
    """From 1e7 M, where the way in and out leaves 2M/r of the angle in a camera's chart: 4e-7 b/r^2 of it, nothing."""
    b = np.array([5.2, 5.25, 5.5, 6.0, 8.0, 10.0, 30.0, 100.0])
    truth = true_ends(HOLE, *beams(b, 1e7))
    assert truth.converged.all() and (truth.status == Status.ESCAPED).all()
    exact = np.mod([darwin(value) for value in b], 2 * np.pi)
    # An error at the photon sphere grows as 1 / (b/b_c - 1).
    allowed = SUMMED * (1 + 1 / (b / CRITICAL - 1))
    error = np.abs(turned(truth.direction) - exact)
    print(error / allowed)
    assert (error <= allowed).all()


def test_capture_is_at_three_root_three():
    near = 1e-9
    truth = true_ends(HOLE, *beams([CRITICAL * (1 - near), CRITICAL * (1 + near)], 1e7))
    assert truth.status.tolist() == [Status.ABSORBED, Status.ESCAPED]


def test_near_critical_rays_say_that_they_are_unresolved():
    truth = true_ends(HOLE, *beams([CRITICAL * (1 + 1e-8), 8.0], 1e7))
    assert truth.converged.tolist() == [False, True]
    assert truth.uncertainty[0] > CONVERGED


def test_coulomb_is_a_hyperbola():
    """theta = 2 arctan(k / b) with v = 1 at infinity. At 1e9 the potential has 1e-9 of the energy still to give."""
    k, b = 1.0, np.array([0.3, 1.0, 3.0, 10.0])
    positions, directions = beams(b, 1e9)
    truth = true_ends(MODELS["radial_potential"](xi="coulomb", k=k), positions, directions)
    assert np.abs(turned(truth.direction) - 2 * np.arctan(k / b)).max() < 2e-9 + SUMMED


def test_parabola_at_a_given_parameter():
    """n^2 = n0^2 + g z: x'' = g/2 upwards."""
    linear = MODELS["refraction"](medium="linear", index=1.2, gradient=0.05)
    n = 1.2
    d = np.array([[0.8, 0.0, 0.6], [0.6, 0.0, -0.8]])
    tau = np.array([3.0, 7.0])
    truth = true_ends(linear, np.zeros((2, 3)), d, parameters=tau)
    exact = n * d * tau[:, None] + np.array([0, 0, 0.25 * 0.05]) * tau[:, None] ** 2
    assert (truth.status == Status.RUNNING).all() and (truth.parameter == tau).all()
    assert np.abs(truth.position - exact).max() < SUMMED * np.abs(exact).max()


@pytest.mark.parametrize("name", MODELS)
def test_every_model_is_scipys(name):
    """The same equation by another DOP853, at tau = 20."""
    model = MODELS[name](**{"lorenz": {"strength": 1e-4}, "roessler": {"strength": 1e-3}}.get(name, {}))
    positions, directions = beams([4.0, 7.0, -9.0], 10.0)
    positions += (0.1, 0.2, 0.3)
    truth = true_ends(model, positions, directions, parameters=np.full(3, 20.0))
    for i, start in enumerate(model.initial_states(positions, directions)):
        solved = solve_ivp(lambda _, y: model.rhs(y[None])[0], (0, 20.0), start, "DOP853", rtol=1e-12, atol=1e-13)
        if truth.status[i] == Status.ABSORBED:
            continue
        end = solved.y[:, -1][None]
        # Both are wrong by their tolerances, times what these gentle rays magnify: at most some ten.
        assert angles(truth.direction[[i]], model.ray_directions(end))[0] < 2 * 10 * SUMMED
        assert np.linalg.norm(truth.position[i] - end[0, :3]) < 2 * 10 * SUMMED * np.linalg.norm(end[0, :3])


def test_rays_escape_exactly_on_the_radius():
    truth = true_ends(HOLE, *beams([6.0, 9.0, 20.0], 30.0), radius=50.0)
    assert np.abs(np.linalg.norm(truth.position, axis=1) - 50.0).max() < 50 * SUMMED


def test_wormhole_is_elliss():
    """Past a throat of radius 1 a ray is deflected by 2 K(m = 1 / b^2) - pi; one with b < 1 goes through."""
    hole = MODELS["wormhole"](throat_radius=1.0)
    b = np.array([1.1, 3.0, 30.0, 0.3])
    truth = true_ends(hole, *beams(b, 1e7))
    assert np.linalg.norm(truth.position[3]) < 0.5 < np.linalg.norm(truth.position[:3], axis=1).min()
    exact = [float(2 * mpmath.ellipk(1 / h**2) - mpmath.pi) for h in b[:3]]
    assert np.abs(turned(truth.direction[:3]) - exact).max() < 10 * SUMMED


def test_no_rays_have_no_ends():
    truth = true_ends(HOLE, np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(truth.status) == 0 and truth.converged.shape == (0,)


def test_a_ray_that_is_no_number_is_no_reference():
    custom = MODELS["custom"](fx="1 / (x - x)", fy="0", fz="0")
    truth = true_ends(custom, *beams([1.0], 5.0))
    assert not truth.converged.any()
