"""Diagrams as pictures: letters, lines and circles are where they are said to be, in pixels as in SVG."""

import math
import re

import numpy as np
import pytest

from addon.core.report import precision_diagram
from addon.core.report.canvas import SCALE, Raster, Svg
from addon.core.report.lettering import written
from addon.core.report.plots import HEIGHT, LEFT, RIGHT, WIDTH, Curve, Diagram


def ink(raster):
    """How much each pixel differs from white, (rows, columns)."""
    return 1.0 - raster.pixels.mean(axis=2)


def test_letters_are_as_wide_as_their_sum_and_unlike_each_other():
    assert written("abc").shape[1] == sum(written(letter).shape[1] for letter in "abc")
    assert written("").shape == (written("a").shape[0], 0)
    shapes = {written(letter).tobytes() for letter in "abcdefghijklmnopqrstuvwxyz0123456789⁻⁵τö"}
    assert len(shapes) == 40
    assert not written(" ").any() and np.array_equal(written("☃"), written("?"))


def test_a_line_has_its_length_and_width():
    """Ink is length times width, and half a disc at either end, in pixels."""
    raster = Raster(40, 20)
    raster.line([(10.0, 5.0), (30.0, 15.0)], "#000000", 2.0)
    length = math.hypot(20.0, 10.0)
    assert ink(raster).sum() == pytest.approx(SCALE**2 * (2.0 * length + math.pi), rel=0.01)
    rows, columns = np.nonzero(ink(raster) > 0.5)
    assert columns.min() == pytest.approx(SCALE * 10, abs=SCALE) and rows.max() == pytest.approx(SCALE * 15, abs=SCALE)


def test_dashes_cover_their_share_around_a_corner():
    """6 of 12 lengths, and half a disc at each end of each."""
    raster = Raster(100, 100)
    raster.line([(8.0, 8.0), (68.0, 8.0), (68.0, 68.0)], "#000000", 2.0, (6.0, 6.0))
    assert ink(raster).sum() == pytest.approx(SCALE**2 * 10 * (6.0 * 2.0 + math.pi), rel=0.01)


def test_circles_are_filled_or_not():
    full, hollow = Raster(20, 20), Raster(20, 20)
    full.circle((10.0, 10.0), 5.0, "#000000", "#000000")
    hollow.circle((10.0, 10.0), 5.0, "#000000")
    assert ink(full).sum() == pytest.approx(SCALE**2 * math.pi * 5.5**2, rel=0.01)
    assert ink(hollow).sum() == pytest.approx(SCALE**2 * 2.0 * math.pi * 5.0, rel=0.01)
    assert ink(hollow)[SCALE * 10, SCALE * 10] == 0.0


@pytest.mark.parametrize(("anchor", "sides"), [("start", (1, 0)), ("middle", (1, 1)), ("end", (0, 1))])
def test_text_stands_where_it_is_anchored(anchor, sides):
    raster = Raster(60, 20)
    raster.text((30.0, 12.0), "HHHH", anchor)
    right, left = ink(raster)[:, SCALE * 30 :].sum() > 0.0, ink(raster)[:, : SCALE * 30].sum() > 0.0
    assert (right, left) == tuple(map(bool, sides))
    lowest = np.nonzero(ink(raster).any(axis=1))[0].max()
    assert lowest == pytest.approx(SCALE * 12, abs=SCALE)  # H stands on the base line


def test_text_is_cut_at_the_edges_and_turned():
    raster = Raster(20, 60)
    raster.text((10.0, 30.0), "HHHH", "middle", upwards=True)
    rows, columns = np.nonzero(ink(raster))
    assert np.ptp(rows) > np.ptp(columns) and rows.mean() == pytest.approx(SCALE * 30, abs=SCALE)
    small = Raster(5, 5)
    small.text((-10.0, 4.0), "much too long for it")
    small.text((2.0, 200.0), "below")
    assert ink(small).any()


def test_png_and_svg_have_their_points_at_the_same_places():
    """A filled point's middle has the curve's colour in the picture, at twice the SVG's coordinates."""
    diagram = Diagram("a", "error", "time", [Curve("b", [(1e-2, 1e1), (1e-1, 3e2), (1.0, 1e3)])])
    places = re.findall(r'<circle cx="([0-9.]+)" cy="([0-9.]+)" r="3"', diagram.as_svg())
    raster = Raster(WIDTH, HEIGHT)
    diagram._draw(raster)
    assert len(places) == 5  # two in the legend
    for x, y in places:
        pixel = raster.pixels[int(SCALE * float(y)), int(SCALE * float(x))]
        assert np.abs(255.0 * pixel - (0x3B, 0x6F, 0xB6)).max() < 1.0
    assert diagram.as_png().startswith(b"\x89PNG") and Diagram("a", "x", "y", []).as_png().startswith(b"\x89PNG")


def test_verticals_are_within_the_axes_and_their_texts_beside_them():
    diagram = Diagram("a", "error", "time", [Curve("b", [(1e-2, 1e1)])], verticals=[(1e-5, "floor"), (1.0, "goal")])
    texts = {}
    for x, anchor, text in re.findall(r'<text x="([0-9.]+)" y="[0-9.]+" text-anchor="(\w+)">(\w+)<', diagram.as_svg()):
        texts[text] = float(x), anchor
    assert texts["floor"] == (LEFT + 3, "start") and texts["goal"] == (WIDTH - RIGHT - 3, "end")


def test_text_in_svg_is_escaped():
    canvas = Svg(10, 10, "a < b")
    canvas.text((0.0, 0.0), "<script>")
    assert "<script>" not in canvas.content() and "a < b" not in canvas.content()


def row(integrator, value, error, time, **more):
    return {
        "pipeline": "fused",
        "integrator": integrator,
        "step_control": "constant",
        "value": value,
        "papers_default": False,
        "front": False,
        "error_median_px": error,
        "error_p99_px_outside_band": 3.0 * error,
        "ns_per_ray": time,
        "rounding_px": 1e-3,
    } | more


def test_orders_are_measured_between_coarse_steps_and_the_floor():
    """Errors of h and h^4 with a floor of 1e-4 pixel: the steps that reach it do not count."""
    steps = [2.0**-n for n in range(8)]
    rows = [row("euler", h, 10.0 * h, 1.0 / h) for h in steps]
    rows += [row("runge_kutta_4", h, 90.0 * h**4 + 1e-4, 4.0 / h) for h in steps]
    rows.append(row("euler", 1.0, 500.0, 1.0, papers_default=True))
    found = precision_diagram.orders(rows)
    assert found["euler"] == pytest.approx(1.0)
    assert found["runge_kutta_4"] == pytest.approx(4.0, abs=0.2)  # a tenth of the floor is left in the error


def test_the_floor_is_drawn_and_named():
    rows = [row("euler", h, h, 1.0 / h, front=True) for h in (1.0, 0.1, 1e-2, 1e-3)]
    drawn = precision_diagram.diagram("a", rows)
    assert (1e-3, "float32's floor") in list(drawn.verticals)
    assert "float32&#x27;s floor" in drawn.as_svg()
    assert [curve.label for curve in drawn.legend] == ["Euler", "constant step", "fused pipeline"]
    without = precision_diagram.diagram("a", [each | {"rounding_px": float("nan")} for each in rows])
    assert len(without.verticals) == len(drawn.verticals) - 1
