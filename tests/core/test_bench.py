"""The benchmark's pure parts: what is counted, what becomes a target, what goes into the file. No timing."""

import json
import math

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.nystrom import NYSTROM_64
from addon.core.tableaus import BOGACKI_SHAMPINE_32, DORMAND_PRINCE_54, RUNGE_KUTTA_4
from tools.bench import scenes
from tools.bench.__main__ import record
from tools.bench.limit import (
    SCHWARZSCHILD,
    multiply_add_operations,
    multiply_add_text,
    nystrom_operations,
    rounds,
    step_operations,
)
from tools.bench.report import Part, Table, Target


@pytest.mark.parametrize(
    ("tableau", "adaptive", "by_hand"),
    [
        # Sums s + (h a1 k1 + …) of six components: k2 to k4 from one derivative each, then four: 7 weights times h; and
        # of each component (1 + 1) + (1 + 1) + (1 + 1) + (7 + 1) = 14.
        (RUNGE_KUTTA_4, False, 4 * 28 + 7 + 6 * 14),
        # One, one, three weights: 5, and (1 + 1) + (1 + 1) + (5 + 1) = 10; the last is the result.
        (BOGACKI_SHAMPINE_32, False, 3 * 28 + 5 + 6 * 10),
        # And four differences b - b*: 4, and 7.
        (BOGACKI_SHAMPINE_32, True, 3 * 28 + 9 + 6 * 17),
        # 1, 2, 3, 4, 5 and 5 weights: 20, and 1 + 3 + 5 + 7 + 9 + 9 and once six = 40; six differences: 6, and 11.
        (DORMAND_PRINCE_54, True, 6 * 28 + 26 + 6 * (40 + 11)),
    ],
)
def test_operations_of_a_step_are_those_counted_by_hand(tableau, adaptive, by_hand):
    assert SCHWARZSCHILD == 28
    assert step_operations(tableau, SCHWARZSCHILD, adaptive) == by_hand


def test_operations_of_nystroms_step_are_those_counted_by_hand():
    """h^2, x cross v and its square; five positions, with 12 operations of their forces. Sums of 2, 3, 4, 5 and 5
    terms, h v among them: 19 numbers, 3 + 5 + 7 + 9 + 9 and once five = 38 of each component; two of 5: 10, 9 + 1 + 9.
    """
    assert nystrom_operations(NYSTROM_64) == 1 + 16 + 5 * 12 + 19 + 3 * 38 + 10 + 3 * 19


class Counted(float):
    """A number that counts what is done with it."""

    count = 0

    def __add__(self, other):
        Counted.count += 1
        return Counted(float(self) + float(other))

    __radd__ = __add__

    def __mul__(self, other):
        Counted.count += 1
        return Counted(float(self) * float(other))

    __rmul__ = __mul__

    def __sub__(self, other):
        Counted.count += 1
        return Counted(float(self) - float(other))


def test_operations_of_the_equation_are_those_that_a_run_of_it_does():
    """shaders/models/schwarzschild.glsl, line by line, on numbers that count."""
    x, v = ([Counted(value) for value in values] for values in ((3.0, -4.0, 5.0), (0.6, 0.7, -0.3)))
    Counted.count = 0
    h = [x[i - 2] * v[i - 1] - x[i - 1] * v[i - 2] for i in range(3)]
    r_squared = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    r = Counted(float(r_squared) ** 0.5)
    Counted.count += 1
    h_squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2]
    fifth_power = r_squared * r_squared * r
    factor = Counted(float(-3.0 * Counted(1.0) * h_squared) / float(fifth_power))
    Counted.count += 1
    f = [factor * component for component in x]
    assert Counted.count == SCHWARZSCHILD
    true = MODELS["schwarzschild"]().rhs(np.array([[*map(float, x), *map(float, v)]]))[0, 3:]
    np.testing.assert_allclose(np.array(f, float), true, rtol=1e-13)  # some thirty roundings of 1e-16


@pytest.mark.parametrize("chains", [2, 24])
def test_multiply_adds_of_the_shader_are_those_counted(chains):
    text = multiply_add_text(chains)
    loop = text[text.index("++i") :]
    pixels = 256 * 256
    assert multiply_add_operations(chains) == 2 * loop.count("* 0.999 +") * rounds(chains) * pixels


@pytest.mark.parametrize(
    ("value", "bound", "at_least", "holds"),
    [
        (20.0, 20.0, True, True),
        (19.9, 20.0, True, False),
        (1.6, 1.6, False, True),
        (1.7, 1.6, False, False),
        (math.nan, 1.0, False, False),
        (math.nan, 1.0, True, False),
    ],
)
def test_a_target_holds_on_its_side_of_the_bound(value, bound, at_least, holds):
    assert Target("Any", value, bound, at_least).holds is holds


def test_the_file_holds_all_targets_and_no_nan():
    parts = {
        "one": Part([], {"error": math.nan, "deep": {3: 1.5}}, [Target("A", 2.0, 1.0), Target("B", math.nan, 1.0)]),
        "two": Part([], {}, [Target("C", 2.0, 1.0, at_least=True)]),
    }
    content = record({"renderer": "any"}, parts, {"one": 1.0, "two": 2.0})
    read = json.loads(json.dumps(content, allow_nan=False))
    assert [set(target) for target in read["targets"]] == [{"name", "value", "bound", "at_least", "holds", "tried"}] * 3
    assert [(t["name"], t["value"], t["holds"]) for t in read["targets"]] == [
        ("A", 2.0, False),
        ("B", None, False),
        ("C", 2.0, True),
    ]
    assert read["one"] == {"error": None, "deep": {"3": 1.5}}
    assert read["about"] == {"renderer": "any"}


def test_a_table_has_a_line_for_each_row_and_its_columns_are_aligned():
    lines = str(Table("Title", ("", "ms", "gain"), [("short", 1.25, None), ("a longer name", 1234.5, "x")])).split("\n")
    assert lines[0] == "Title" and len(lines) == 4
    assert "1.25" in lines[2] and "1234" in lines[3]
    assert len(lines[1]) == len(lines[2]) == len(lines[3])


@pytest.mark.parametrize("rings", [8, 16])
def test_the_torus_is_closed_and_has_four_times_the_square_of_its_rings(rings):
    triangles = scenes.torus(rings)
    assert len(triangles) == 4 * rings**2
    # The area vectors of a closed surface cancel out; they are sums of some thousand roundings of float64.
    a, b, c = np.moveaxis(triangles.positions, 1, 0)
    areas = np.cross(b - a, c - a)
    assert np.linalg.norm(areas.sum(axis=0)) < 1e-10 * np.linalg.norm(areas, axis=1).sum()
    around, tube, _ = scenes.TORUS
    distances = np.linalg.norm(triangles.positions, axis=-1)
    assert distances.min() == pytest.approx(around - tube) and distances.max() == pytest.approx(around + tube)


@pytest.mark.parametrize("count", [1, 10, 1000])
def test_spheres_cover_the_same_area_within_the_bounding_sphere_and_outside_the_hole(count):
    spheres = scenes.spheres(count)
    assert np.sum(np.pi * spheres.radii**2) == pytest.approx(scenes.SPHERES_COVER)
    distances = np.linalg.norm(spheres.centres, axis=1)
    assert (distances - spheres.radii).min() > 4.0 and (distances + spheres.radii).max() < scenes.BOUNDS
