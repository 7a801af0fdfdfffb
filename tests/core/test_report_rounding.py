"""The floor under every method: what float32 does to the beginning of a ray."""

import numpy as np
import pytest

from addon.core.report import rounding
from addon.core.report.cases import built_in

CASES = {case.title: case for case in built_in()}


def floor(title, side=8):
    case = CASES[title]
    return rounding.reference_and_floor(case, *case.rays(side), lambda fraction: None)


def test_numbers_move_as_float32_rounds():
    numbers = 2.0 ** np.random.default_rng(2).uniform(-9.0, 9.0, (100_000, 3))
    moved = (rounding._rounded(numbers, np.random.default_rng(3)) - numbers) / numbers
    assert np.abs(moved).max() <= 1.01 * 2.0**-24
    assert np.sqrt(np.mean(moved**2)) == pytest.approx(rounding.TYPICAL, rel=0.01)


def test_straight_rays_turn_by_no_more_than_their_directions_were_rounded():
    """At most 2^-24 for each of three numbers; those across, which turn a ray, are up to half of the one along."""
    _, found = floor("Straight")
    radians = found * CASES["Straight"].pixel
    assert 0.25 * rounding.TYPICAL < radians < np.sqrt(3.0) * 2.0**-24


def test_a_hole_magnifies_roundings():
    """Its deflection's derivative by ln b is some 1 / |b / b_c - 1|: tens for the nearest of 64 rays."""
    _, found = floor("Schwarzschild, camera at 20 M")
    assert 3.0 < found * CASES["Schwarzschild, camera at 20 M"].pixel / rounding.TYPICAL < 1e3


def test_the_reference_is_that_of_the_rays_that_were_asked_for():
    case = CASES["Luneburg lens"]
    positions, directions = case.rays(8)
    truth, _ = rounding.reference_and_floor(case, positions, directions, lambda fraction: None)
    alone = case.truth(positions, directions)
    assert len(truth.status) == 64 and (truth.status == alone.status).all()
    assert np.abs(truth.direction - alone.direction).max() < 1e-9
