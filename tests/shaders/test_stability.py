"""The extreme cases of physics.md, Section 3, in quick form: the report's own cases, each with its expectation."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.report.cases import of_scene
from addon.core.report.dangers import sentences
from addon.core.report.page import Page
from addon.core.report.stability import CASES, write
from addon.core.report.stability.kerr_outline import outline
from addon.core.report.stability.record import record
from addon.core.report.stability.section import MEANING
from addon.core.scene import Scene
from addon.core.settings import Settings
from tests.shaders import scenes

RECORDS = {}  # of the cases that have been run


@pytest.mark.parametrize("name", CASES)
def test_the_expectation_holds(name):
    records = RECORDS[name] = CASES[name](True)
    assert records
    for row in records:
        bound = "" if row["bound"] is None else f"; bound {row['bound']:.1e}"
        print(f"{row['model']}, {row['value']}: {row['measure']} {row['figure']:.2e}{bound}; {row['statuses']}")
    assert [row for row in records if row["holds"] is False] == []


def test_every_sweep_has_a_diagram(egl):
    swept = ("near-critical rays", "thin front", "stiff damping", "long run")
    records = [{"case": name} | row for name in swept for row in RECORDS.get(name) or CASES[name](True)]
    page = Page("")
    drawn = write(page, records)
    assert len(drawn) == len(swept) + 1  # two of the thin front
    for diagram in drawn:
        assert all(len(curve.shown) >= 2 for curve in diagram.curves), diagram.title
    html = page.html()
    assert html.count("<svg") == len(drawn) and all(name[0].upper() + name[1:] in html for name in swept)
    assert "0 of" not in html and "NO" not in html


def test_every_case_of_the_page_is_explained():
    assert list(MEANING) == list(CASES)


def test_what_does_not_hold_is_said_first():
    rows = [
        record("a model", value, "stays small", "error, rad", value, 1.0) | {"case": "scale"} for value in (0.5, 2.0)
    ]
    page = Page("")
    write(page, rows)
    html = page.html()
    assert "1 of 2 expectations hold." in html and "Does not hold: scale, a model, 2.0: stays small." in html
    assert ">NO<" in html and ">200<" in html  # percent of the bound
    assert html.count("stays small") == 2  # once for the case, not in every row of its table


def test_the_drift_of_a_symplectic_method_is_bounded(egl):
    """Verlet's energy error swings and does not grow; Euler's and Runge and Kutta's grow with the steps."""
    rows = {(row["integrator"], row["value"]): row["figure"] for row in CASES["long run"](True)}
    growth = {name: rows[name, 100_000] / rows[name, 1_000] for name in ("euler", "verlet", "runge_kutta_4")}
    print(f"growth of the drift from 1e3 to 1e5 steps: {growth}")
    assert growth["euler"] > 50 and growth["runge_kutta_4"] > 50
    assert growth["verlet"] < 10


def test_the_explicit_method_comes_to_rest_whatever_the_damping(egl):
    """Its steps are as short as stability wants them; it pays, and is right."""
    rows = [row for row in CASES["stiff damping"](True) if row["integrator"] == "dormand_prince_54"]
    assert len(rows) == 7 and all(row["off"] == 0 for row in rows)


def test_bardeens_outline_has_its_known_points():
    """b+ and b- of physics.md for a = 0.9 in the equator, to a hundredth of a pixel of 16 M / 1024; a circle of radius
    3 sqrt 3 M, moved by 2 a, for a slow hole.
    """
    left_and_right = outline(0.9, np.pi / 2, np.array([np.pi, 0.0]))
    assert np.sort(left_and_right) == pytest.approx([2.844421, 6.832319], abs=1.5e-4)
    assert outline(1e-3, np.pi / 3, np.linspace(0, 2 * np.pi, 9)) == pytest.approx(np.sqrt(27), abs=3e-3)


@pytest.mark.parametrize(
    ("name", "values", "options", "sentence"),
    [
        ("kerr", {"spin": 0.9999}, {}, "turns at 0.9999 of the fastest"),
        ("kerr", {"spin": 0.9}, {}, None),
        ("refraction", {"medium": "shell", "thickness": 5e-4}, {}, "front is 0.0005 radii thick"),
        ("refraction", {"medium": "shell", "thickness": 5e-4, "stepping": "snell"}, {}, None),
        ("schwarzschild", {}, {"ray_bits": 16, "pipeline": "paper"}, "kept in 16 bit"),
    ],
)
def test_a_users_scene_is_told_what_it_is_near(egl, name, values, options, sentence):
    scene = Scene(scenes.camera(8, 8, position=(0.0, -20.0, 0.0), half=0.1), MODELS[name](**values))
    told = " ".join(sentences(of_scene(scene), Settings(**options)))
    known = ("of the fastest", "radii thick", "16 bit")
    assert sentence in told if sentence else not any(part in told for part in known)
