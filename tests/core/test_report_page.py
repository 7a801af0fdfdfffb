"""What the page says of given figures: numbers that can be read, what to choose, maps with their colours explained."""

import struct
import zlib

import numpy as np
import pytest

from addon.core.report import error_map, error_map_section, precision_section
from addon.core.report.canvas import SCALE, Raster
from addon.core.report.cases import built_in
from addon.core.report.page import Page, shown
from addon.core.report.work_precision import NO_PRECISION, NO_WORK, QUICK

CASES = {case.title: case for case in built_in()}
HOLE, KERR, STRAIGHT = "Schwarzschild, camera at 20 M", "Kerr, a = 0.9, camera at 20 M", "Straight"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.001, "2.001"),
        (1637.2, "1637"),
        (0.0, "0"),
        (31.71, "31.7"),
        (1.8e-6, "1.8e-6"),
        (-1e-7, "-1e-7"),
        (9.29e8, "9.29e8"),
        (float("nan"), "NaN"),
        (float("inf"), "inf"),
        (None, ""),
        (True, "yes"),
        ("a", "a"),
    ],
)
def test_numbers_can_be_read(value, text):
    assert shown(value) == text


def row(case, error, time, value=1e-4, integrator="dormand_prince_54", **more):
    return (
        NO_PRECISION
        | NO_WORK
        | {
            "case": case,
            "model": CASES[case].name,
            "pipeline": "fused",
            "integrator": integrator,
            "step_control": "embedded",
            "value": value,
            "papers_default": False,
            "front": False,
            "rays": 144,
            "unresolved": 0,
            "error_median_px": error,
            "error_p99_px_outside_band": error,
            "misclassified_percent_outside_band": 0.0,
            "failed_percent": 0.0,
            "ns_per_ray": time,
            "bounding_sphere_px": 0.0,
            "rounding_px": 1e-3,
        }
        | more
    )


def written(measured):
    page = Page("")
    precision_section.in_short(page, [(CASES[case], rows) for case, rows in measured.items()])
    drawn = precision_section.write(page, QUICK, [(CASES[case], rows) for case, rows in measured.items()])
    return page.html(), drawn


def test_the_page_says_what_to_choose():
    """The method that is cheapest most often, with the tightest tolerance that it needs in any of these pictures."""
    default = {"papers_default": True, "step_control": "doubling"}
    html, drawn = written(
        {
            STRAIGHT: [row(STRAIGHT, 1e-5, 10.0, integrator="euler")],
            HOLE: [row(HOLE, 0.02, 100.0, value=1e-5), row(HOLE, 5.0, 2000.0, integrator="euler", **default)],
            KERR: [row(KERR, 0.02, 100.0, value=1e-3), row(KERR, 0.02, 300.0, integrator="euler")],
        }
    )
    choice = "choose Dormand–Prince 5(4), embedded, fused, with a tolerance of 1e-05 radians"
    assert f"For errors below 0.1 pixel {choice}: the cheapest in 2 of 2 pictures." in html
    assert "<td>20</td>" in html  # times as fast as the paper's default
    assert [diagram.title for diagram in drawn] == [STRAIGHT, HOLE, KERR]


def test_a_goal_that_nothing_reaches_is_said():
    html, _ = written({HOLE: [row(HOLE, 0.2, 100.0)]})
    assert "none of the settings tried" in html and "No setting tried keeps safely below 0.1 pixel." in html
    assert precision_section.choice(0.1, None) == "No setting tried keeps safely below 0.1 pixel in this scene."
    of_scene = row(HOLE, 0.02, 1.0, value=0.25, step_control="constant")
    assert precision_section.choice(1.0, of_scene).endswith("constant, fused, with a step of 0.25 model lengths.")


def test_a_floor_and_orders_are_said():
    steps = [2.0**-n for n in range(8)]
    rows = [row(HOLE, 10.0 * h, 1.0 / h, value=h, integrator="euler", step_control="constant") for h in steps]
    html, _ = written({HOLE: rows})
    assert "float32&#x27;s floor: 0.001 pixel." in html and "between coarse steps and the floor: Euler 1.0." in html
    assert "bounding sphere, where it has still" not in html
    html, _ = written({HOLE: [each | {"bounding_sphere_px": 0.01} for each in rows]})
    assert "it has still to turn by 0.01 pixel" in html


def test_ticks_of_the_legend_are_its_colours():
    """A tick's label is the error whose colour the legend has there."""
    legend = error_map.legend(1001, 1)[0].astype(int)
    for label, place in error_map.ticks().items():
        expected = error_map._colors(np.array([float(label.split()[0])]))[0].astype(int)
        assert np.abs(legend[round(1000 * place)] - expected).max() <= 2


def test_a_picture_keeps_its_pixels_and_its_rows():
    pixels = np.random.default_rng(1).integers(0, 256, (3, 4, 3), dtype=np.uint8)
    raster = Raster(40, 40)
    raster.pixels_at((10.0, 5.0), 20.0, 15.0, pixels)
    place = (slice(SCALE * 5, SCALE * 20, SCALE * 5), slice(SCALE * 10, SCALE * 30, SCALE * 5))
    assert np.array_equal(np.round(255.0 * raster.pixels[place]), pixels[::-1])
    assert (raster.pixels[:, : SCALE * 10] == 1.0).all() and (raster.pixels[SCALE * 20 :] == 1.0).all()


def test_error_maps_stand_side_by_side():
    """In the picture's own proportions, here 2 : 1."""
    true, estimated = (np.full((4, 8, 3), color, np.uint8) for color in ((200, 0, 0), (0, 0, 200)))
    content = error_map_section.picture(error_map.ErrorMap(true, estimated, {}))
    columns, rows = struct.unpack(">II", content[16:24])
    assert columns == SCALE * error_map_section.WIDTH
    pixels = np.frombuffer(zlib.decompress(content[content.index(b"IDAT") + 4 : -16]), np.uint8)
    pixels = pixels.reshape(rows, 1 + 3 * columns)[:, 1:].reshape(rows, columns, 3)
    for side, color in enumerate(((200, 0, 0), (0, 0, 200))):
        there = (pixels == color).all(axis=2)
        assert there.any(axis=0).sum() == 2 * there.any(axis=1).sum() == SCALE * error_map_section.PANEL
        assert there[:, columns // 2 :].any() == (side == 1)
