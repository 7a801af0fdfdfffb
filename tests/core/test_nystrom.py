"""Nystrom methods refuse coefficients that lack the order that they claim; models say whether they may use them."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.nystrom import NYSTROM_64, density, nystrom_trees
from addon.core.settings import Settings, SettingsError
from addon.core.tableaus import TableauError
from addon.core.trace import integrator_for


def changed(row, index, by=Fraction(1, 10**6)):
    return tuple(value + by * (i == index) for i, value in enumerate(row))


@pytest.mark.parametrize(("i", "j"), [(1, 0), (2, 1), (3, 2), (4, 0)])
def test_a_wrong_coefficient_is_refused(i, j):
    rows = list(NYSTROM_64.a)
    rows[i] = changed(rows[i], j)
    with pytest.raises(TableauError, match="order condition"):
        replace(NYSTROM_64, a=tuple(rows))


@pytest.mark.parametrize(("part", "index"), [("d", 0), ("d", 5), ("embedded", 2), ("c", 3)])
def test_a_wrong_weight_is_refused(part, index):
    with pytest.raises(TableauError, match="order condition"):
        replace(NYSTROM_64, **{part: changed(getattr(NYSTROM_64, part), index)})


def test_the_last_stage_ends_the_step():
    with pytest.raises(TableauError, match="end of the step"):
        replace(NYSTROM_64, b=changed(NYSTROM_64.b, 0))


@pytest.mark.parametrize(("part", "order"), [("order", 7), ("embedded_order", 5)])
def test_a_higher_order_is_refused(part, order):
    with pytest.raises(TableauError, match=f"not of order {order}"):
        replace(NYSTROM_64, **{part: order})


def test_trees():
    """As many of each size as Hairer, Norsett and Wanner count, Section II.14; densities of f(x), f'v and f''(v, v)."""
    counts = [len(nystrom_trees(nodes)) for nodes in range(8)]
    assert np.diff(counts).tolist() == [1, 1, 2, 3, 6, 10, 20]
    assert [density(tree) for tree in ((), (None,), (None, None))] == [1, Fraction(1, 2), Fraction(1, 3)]
    assert density(((),)) == Fraction(1, 6)  # x''''= f' f: of v, t^3 / 6


@pytest.mark.parametrize("name", MODELS)
def test_who_may_use_it(name):
    """A force of the position alone does not change with the velocity, but for what the ray conserves: x cross v."""
    model = MODELS[name]()
    generator = np.random.default_rng(3)
    positions = np.array([3.0, 0.0, 3.0]) + generator.normal(size=(50, 3))
    states = model.initial_states(positions, generator.normal(size=(50, 3)))
    x, v = states[:, :3], states[:, 3:]
    other = np.concatenate([x, v + generator.normal(size=(50, 1)) * x], axis=1)  # with the same x cross v
    before, after = model.rhs(states), model.rhs(other)
    same = np.allclose(before[:, 3:], after[:, 3:], rtol=1e-9, atol=0.0) and np.array_equal(before[:, :3], v)
    assert model.force_of_position() <= same
    if model.curved and not model.own_integrator():
        assert integrator_for(model, Settings()) == ("nystrom_64" if model.force_of_position() else "dormand_prince_54")


def test_a_law_without_such_a_force_is_refused():
    with pytest.raises(SettingsError, match=r"'nystrom_64' needs a force of the position alone.*'kerr'.*'automatic'"):
        integrator_for(MODELS["kerr"](), Settings(integrator="nystrom_64"))


@pytest.mark.parametrize(("force", "alone"), [("-x / r^3", True), ("-vx", False)])
def test_typed_forces(force, alone):
    assert MODELS["custom"](fx=force).force_of_position() is alone
