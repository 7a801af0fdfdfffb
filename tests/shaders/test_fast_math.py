"""Compilers that take it that no number is NaN, as drivers may, change nothing: every comparison of a program is turned
round (fast_math.py), and what NaN and infinity come about in ends as before. llvmpipe itself keeps to IEEE 754.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from addon.core import device as gpu
from addon.core.compose import SHADERS
from addon.core.models import MODELS
from addon.core.scene import Light, Material, Scene
from addon.core.settings import PIPELINES, Settings
from addon.core.trace import render
from tests.core.compositions import covering
from tests.shaders import scenes
from tests.shaders.fast_math import turned_round
from tests.shaders.test_hostile import OBJECTS

EVERY_SHADER = sorted(SHADERS.rglob("*.glsl"))
PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Drift")
ALLOWED = 1e-4
PLANE = OBJECTS["coincident triangles"]
HOLE = MODELS["schwarzschild"](mass=0.3)


def index(formula):
    return MODELS["refraction"](medium="expression", formula=formula)


CASES = {name: (HOLE, OBJECTS[name], {}) for name in OBJECTS} | {
    # Dark from a plane on, where n is no number, infinite, or below 0.
    "n: a root": (index("sqrt(1 - y)"), PLANE, {}),
    "n: a pole": (index("1/(1 - y)"), PLANE, {}),
    "n: a power": (index("(1 - y)^0.5"), PLANE, {}),
    "force: a root": (MODELS["custom"](fx="sqrt(-x)"), PLANE, {}),
    "force: 1 / 0": (MODELS["custom"](fx="1/(x - x)"), PLANE, {}),
    "force: a logarithm": (MODELS["custom"](fx="log(x)"), PLANE, {}),
    "force: too large": (MODELS["custom"](fx="1e30*x"), PLANE, {}),
    "grid": (MODELS["refraction"](medium="grid", grid=np.ones((3, 3, 3), np.float32)), PLANE, {}),
    "flow": (MODELS["roessler"](mode="flow"), PLANE, {"integrator": "euler", "step_control": "constant"}),
}


@pytest.fixture
def fast_math(egl, monkeypatch):
    """fast_math(job): what it returns where programs are compiled anew, with their comparisons turned round."""

    def run(job, original=gpu.compose):
        def compose(choice):
            source = original(choice)
            return replace(source, text=turned_round(source.text))

        try:
            with monkeypatch.context() as patch:
                patch.setattr(gpu, "compose", compose)
                gpu.run(lambda device: device._programs.clear())
                return job()
        finally:
            gpu.run(lambda device: device._programs.clear())

    return run


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("case", CASES)
def test_no_ray_ends_otherwise(case, pipeline, fast_math):
    """On the drivers at hand, to the last bit. Others may round otherwise in a text that is another one."""
    model, objects, options = CASES[case]
    light = Light("POINT", (500.0, 500.0, 500.0), (2.0, -5.0, 4.0))
    scene = Scene(scenes.camera(16, 12), model, materials=(Material(specular=1.0),), lights=(light,), **objects)
    settings = Settings(pipeline=pipeline, passes=PASSES, segments=100, tolerance=1e-2, **options)
    usual, turned = render(scene, settings), fast_math(lambda: render(scene, settings))
    assert turned.statistics.rays == usual.statistics.rays
    for name, pixels in turned.passes.items():
        assert np.isfinite(pixels).all(), name
        allowed = 0.0 if name in ("Status", "Object Index") else ALLOWED * np.maximum(np.abs(pixels), 1.0)
        assert (np.abs(pixels - usual.passes[name]) <= allowed).all(), name


@pytest.mark.parametrize(
    ("line", "turned"),
    [
        ("if (a < b) return c;", "if (!(a >= b)) return c;"),
        ("return f(a, b < c) > d + 1.0;  // e < f", "return !(f(a, !(b >= c)) <= d + 1.0);  // e < f"),
        ("x = y && -u <= v(w) || !z ? p : q >= r;", "x = y && !(-u > v(w)) || !z ? p : !(q < r);"),
        ("for (int i = 0; i < n; ++i) j >>= 1;", "for (int i = 0; !(i >= n); ++i) j >>= 1;"),
    ],
)
def test_comparisons_are_turned_round(line, turned):
    assert turned_round(line) == turned


def check_nan_tests(text):
    """common/finite.glsl does them, on bits. Not isnan(), and no negation of a comparison, nor x != x."""
    text = re.sub(r"//.*", "", text)
    assert not re.search(r"\bis(nan|inf)\b", text)
    assert not re.search(r"!\([^;&|]*?( [<>]=? |\b(less|greater)Than)", text)
    assert not re.search(r"(?<![\w.])([\w.]+) [!=]= \1(?![\w.(\[])", text)


@pytest.mark.parametrize("path", EVERY_SHADER, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_shader_tests_for_nan_by_a_comparison(path):
    check_nan_tests(path.read_text(encoding="utf-8"))


def test_no_printed_function_does():
    printed = {part for pipeline in PIPELINES for choice in covering(pipeline) for part in choice.generated}
    assert len(printed) > 10
    for _, text in printed:
        check_nan_tests(text)


@pytest.mark.parametrize("path", EVERY_SHADER, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_comparison_is_turned_round(path):
    text = path.read_text(encoding="utf-8")
    code = re.sub(r"//.*", "", text)
    assert turned_round(text).count("!(") - text.count("!(") == len(re.findall(r" [<>]=? ", code))


NUMBERS = [0.0, -0.0, 1e-37, -1e-37, 0.5, 1.0, 1.5, -1.0, 2.9e38, 3.1e38, -2.9e38, np.inf, -np.inf, np.nan, -np.nan]


def test_what_is_finite(glsl):
    given = np.array(NUMBERS, np.float32)
    found = glsl(
        ["common/vacuum"],
        "out_result = vec4(finite(a.x), lies_before(a.x, 1.0), lies_before(a.x, 0.0), finite(vec3(a.x, 0.0, 1.0)));",
        {"a": given[:, None]},
    )["result"].astype(bool)
    with np.errstate(over="ignore"):
        squares = given * given
    assert np.array_equal(found[:, 0], np.abs(given) < 3e38)
    assert np.array_equal(found[:, 1], (given >= 0.0) & (given < 1.0))
    assert not found[:, 2].any()
    assert np.array_equal(found[:, 3], squares < 3e38)
