"""Rosenbrock methods refuse coefficients that lack the order or the stability that they claim."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from addon.core.rosenbrock import RODAS_3, ROSENBROCK_METHODS
from addon.core.tableaus import TableauError, fractions


def changed(row, index, by=Fraction(1, 1000)):
    return tuple(value + by * (i == index) for i, value in enumerate(row))


@pytest.mark.parametrize("part", ["a", "c"])
@pytest.mark.parametrize(("i", "j"), [(2, 0), (3, 0), (3, 2)])
def test_a_wrong_coefficient_is_refused(part, i, j):
    rows = list(getattr(RODAS_3, part))
    rows[i] = changed(rows[i], j)
    with pytest.raises(TableauError):
        replace(RODAS_3, **{part: tuple(rows)})


@pytest.mark.parametrize(("part", "index"), [*(("m", i) for i in range(4)), ("embedded", 0), ("embedded", 1)])
def test_a_wrong_weight_is_refused(part, index):
    """The embedded method's last two stages are free: they begin with h^3."""
    with pytest.raises(TableauError, match="order condition"):
        replace(RODAS_3, **{part: changed(getattr(RODAS_3, part), index)})


@pytest.mark.parametrize(("part", "order"), [("order", 4), ("embedded_order", 3)])
def test_a_higher_order_is_refused(part, order):
    with pytest.raises(TableauError, match=f"not of order {order}"):
        replace(RODAS_3, **{part: order})


def test_a_method_that_does_not_damp_is_refused():
    """The implicit midpoint rule as a Rosenbrock method has order 2 and R(infinity) = -1."""
    midpoint = {"a": ((),), "c": ((),), "m": fractions("2"), "embedded": fractions("2")}
    with pytest.raises(TableauError, match="not L-stable"):
        replace(RODAS_3, gamma=Fraction(1, 2), order=2, embedded_order=2, **midpoint)


def growth(method, z):
    """R(z): what becomes of 1 in a step of h for y' = z y / h, stage by stage."""
    gamma, stages = float(method.gamma), []
    for a, c in zip(method.a, method.c, strict=True):
        y = 1.0 + sum(float(a_ij) * k for a_ij, k in zip(a, stages, strict=True))
        right = z * y + sum(float(c_ij) * k for c_ij, k in zip(c, stages, strict=True))
        stages.append(gamma * right / (1.0 - gamma * z))
    return 1.0 + sum(float(m_i) * k for m_i, k in zip(method.m, stages, strict=True))


@pytest.mark.parametrize("name", ROSENBROCK_METHODS)
def test_stability(name):
    """A-stable: |R| <= 1 on the imaginary axis, and no pole left of it, as 1 / gamma > 0. L-stable: R goes to 0."""
    method = ROSENBROCK_METHODS[name]
    axis = 1j * np.geomspace(1e-3, 1e6, 2001)
    assert np.abs(growth(method, axis)).max() <= 1.0 + 1e-14
    assert method.gamma > 0 and method.far_damping() == 0
    assert abs(growth(method, -1e6)) < 1e-5
    for z in (-0.1, -0.05):  # and R is e^z but for a term of z^4
        assert abs(growth(method, z) - np.exp(z)) < z**4
