"""What the report makes of its figures: pictures, tables, recommendations, comparison. No GPU."""

import struct
import xml.etree.ElementTree as ElementTree
import zlib

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.reference import Truth
from addon.core.report import errors, estimates, png, stiff
from addon.core.report.cases import built_in, of_scene
from addon.core.report.compare import differences, summarise
from addon.core.report.methods import METHODS, integrator_label, papers_default, too_many_steps
from addon.core.report.page import Page
from addon.core.report.plots import HEIGHT, LEFT, RIGHT, WIDTH, Curve, Diagram
from addon.core.report.recommend import recommendation
from addon.core.report.work_precision import FULL, mark_front
from addon.core.settings import INTEGRATORS, PIPELINES, WITH_ERROR_ESTIMATE, Settings
from addon.core.status import Status
from addon.core.trace import RayEnds

CASES = {case.title: case for case in built_in()}


def row(error, time, **more):
    return {
        "case": "a",
        "pipeline": "fused",
        "integrator": "euler",
        "step_control": "constant",
        "value": time,
        "papers_default": False,
        "error_p99_px": error,
        "error_p99_px_outside_band": error,
        "misclassified_percent": 0.0,
        "misclassified_percent_outside_band": 0.0,
        "failed_percent": 0.0,
        "ns_per_ray": time,
    } | more


def test_every_model_has_a_case():
    assert {case.name for case in CASES.values()} == set(MODELS)


def test_every_method_has_six_settings():
    model = MODELS["schwarzschild"]()
    names, estimating = {*INTEGRATORS} - {"automatic"}, {*WITH_ERROR_ESTIMATE} - {"automatic"}
    assert len(METHODS) == len(PIPELINES) * (2 * len(names) + len(estimating))
    for method in METHODS:
        tried = list(method.settings(model, 1000))
        assert len({value for value, _ in tried}) >= 6
        assert all(
            (s.pipeline, s.integrator, s.step_control) == (method.pipeline, method.integrator, method.step_control)
            for _, s in tried
        )
    default = papers_default(1000)
    assert (default.pipeline, default.integrator, default.steps_per_segment) == ("paper", "euler", 10)


def test_a_law_is_tried_with_the_methods_that_suit_it():
    """Nyström's only where the force depends on the position alone; straight rays with nothing but their pipelines."""
    tried = {name: {each.integrator for each in FULL.methods(MODELS[name]())} for name in MODELS}
    assert "nystrom_64" in tried["schwarzschild"] and "nystrom_64" not in tried["kerr"]
    assert tried["kerr"] == {*INTEGRATORS} - {"automatic", "nystrom_64"}
    assert len(FULL.methods(MODELS["straight"]())) == len(PIPELINES)


def test_automatic_is_named_with_what_it_takes():
    names = {name: integrator_label(MODELS[name](), Settings()) for name in ("schwarzschild", "kerr")}
    assert names == {"schwarzschild": "Automatic (Nyström 6(4))", "kerr": "Automatic (Dormand–Prince 5(4))"}
    assert integrator_label(MODELS["kerr"](), Settings(integrator="runge_kutta_4")) == "RK4"
    assert integrator_label(MODELS["refraction"](stepping="snell"), Settings()) == "Automatic"


def test_too_many_steps():
    """100 M with steps of 0.05 M are 2000."""
    model = MODELS["schwarzschild"]()
    chosen = {"integrator": "euler", "step_control": "constant", "step": 0.05}
    assert too_many_steps(model, Settings(max_steps=1999, **chosen))
    assert not too_many_steps(model, Settings(max_steps=2001, **chosen))


def test_rays_are_stratified_and_always_the_same():
    case = CASES["Schwarzschild, camera at 20 M"]
    positions, directions = case.rays(8)
    again, _ = case.rays(8)
    assert np.array_equal(positions, again) and len(positions) == 64
    assert np.allclose(positions, case.scene.camera.world_from_camera[:3, 3])
    # One in each of 8 x 8 parts of the picture.
    local = directions @ case.scene.camera.world_from_camera[:3, :3]
    left, right, bottom, top = case.scene.camera.window
    column = np.floor(8 * (-local[:, 0] / local[:, 2] - left) / (right - left))
    line = np.floor(8 * (-local[:, 1] / local[:, 2] - bottom) / (top - bottom))
    assert len(set(zip(line, column, strict=True))) == 64


def test_pixel_of_a_scene():
    case = of_scene(CASES["Luneburg lens"].scene)
    assert case.pixel == pytest.approx(0.8 / 1024)


def test_near_critical_is_the_photon_spheres_impact_parameter():
    """From 1000 M, |d x x| = b up to M b^2 / r^3."""
    b = 3 * np.sqrt(3) * np.array([1 - 2e-3, 1 - 5e-4, 1 + 5e-4, 1 + 2e-3])
    positions = np.stack([np.full(4, -1000.0), b, 0 * b], axis=1)
    directions = np.tile((1.0, 0.0, 0.0), (4, 1))
    found = errors.near_critical(MODELS["schwarzschild"](), positions, directions)
    assert found.tolist() == [False, True, True, False]
    assert not errors.near_critical(MODELS["kerr"](), positions, directions).any()


def test_an_estimate_is_exceeded_only_beyond_float32s_rounding():
    """Three rays that end 1e-9, 1e-5 and 1e-5 rad beside the truth, with estimates of 0, 0 and 2e-5 rad."""
    turned = np.array([1e-9, 1e-5, 1e-5])
    directions = np.stack([np.cos(turned), np.sin(turned), 0.0 * turned], axis=1)
    none = np.zeros(3)
    escaped = np.full(3, int(Status.ESCAPED))
    ends = RayEnds(np.zeros((3, 3)), directions, none, escaped, none, none, none, np.array([0.0, 0.0, 2e-5]))
    truth = Truth(np.zeros((3, 3)), np.tile((1.0, 0.0, 0.0), (3, 1)), none, escaped, none, none)
    found = errors.compare(MODELS["straight"](), ends, truth)
    assert found.exceeds.tolist() == [False, True, False]
    assert found.factor[2] == pytest.approx(0.5, rel=0.01)


def test_estimates_are_those_of_the_products_own_method():
    """At the tolerances next to the default and to 1e-5, records of each case; the magnification is a rounding's."""
    kind = {"model": "lorenz", "pipeline": "fused", "integrator": "dormand_prince_54", "step_control": "embedded"}
    figures = {
        "estimate_exceeded_percent": 5.0,
        "estimate_factor_p99": 2.0,
        "estimate_over_median": 9.0,
        "rounding_px": 3.0,
    }
    rows = [row(1.0, 1.0, **(kind | figures | {"case": case, "value": v})) for case in "ab" for v in (1e-3, 3e-5, 1e-5)]
    rows.append(row(1.0, 1.0, case="a", pipeline="paper"))
    found = estimates.of_every_case(rows, {"a": 1e-3, "b": 2e-3})
    assert [(each["case"], each["tolerance"]) for each in found] == [(case, t) for case in "ab" for t in (3e-5, 1e-5)]
    better = row(1.0, 1.0, **(kind | figures | {"integrator": "nystrom_64", "case": "a", "value": 1e-4}))
    assert estimates.of_every_case([*rows, better], {"a": 1e-3, "b": 2e-3})[0]["integrator"] == "nystrom_64"
    assert found[2]["magnification_p99"] == pytest.approx(3.0 * 2e-3 * 2.0**24 / 0.425)


def test_front_and_recommendation():
    rows = [row(5.0, 1.0), row(0.2, 10.0), row(0.3, 20.0), row(0.02, 100.0), row(float("nan"), float("nan"))]
    rows.append(row(0.01, 5.0, failed_percent=3.0))
    mark_front(rows)
    assert [r["front"] for r in rows] == [True, True, False, True, False, False]
    assert recommendation(rows, 1.0)["ns_per_ray"] == 10.0
    assert recommendation(rows, 0.1)["ns_per_ray"] == 100.0
    assert recommendation(rows, 0.001) is None
    assert recommendation(rows, 0.07) is None  # 0.02 is not safely below


def test_noise_of_times_does_not_change_the_recommendation():
    """Times of many reports of one scene, each up to 7 % off, which is half of what counts as a tie: whichever is the
    fastest by then, the most precise of those that are as fast is recommended.
    """
    true_times = {0.20: 100.0, 0.15: 101.0, 0.02: 103.0, 0.01: 200.0}
    generator = np.random.default_rng(7)
    found, fastest = set(), set()
    for _ in range(200):
        rows = [row(error, time * generator.uniform(0.93, 1.0)) for error, time in true_times.items()]
        found.add(recommendation(rows, 1.0)["error_p99_px"])
        fastest.add(min(rows, key=lambda each: each["ns_per_ray"])["error_p99_px"])
    assert found == {0.02} and fastest == {0.20, 0.15, 0.02}


def test_comparison_finds_what_is_worse():
    older = [row(0.1, 10.0), row(0.2, 20.0), row(0.3, 30.0), row(1.0, 100.0, papers_default=True)]
    same = summarise({"work_precision": older})
    assert differences(same, same) == []
    assert len(same) == 3
    newer = [row(0.1, 10.0), row(0.9, 20.0), row(0.3, 90.0, value=30.0), row(1.0, 100.0, papers_default=True)]
    found = differences(same, summarise({"work_precision": newer}))
    assert [sentence.split(":")[0] for sentence in found] == ["Less accurate", "Slower"]
    # A faster machine is not a difference: times are parts of the default's.
    faster = [r | {"ns_per_ray": 0.5 * r["ns_per_ray"]} for r in older]
    assert differences(same, summarise({"work_precision": faster})) == []
    assert differences(same, {}) == [f"Gone: {key}" for key in sorted(same)]
    failed = [r | {"error_p99_px": None} for r in older]
    assert len(differences(same, summarise({"work_precision": failed}))) == 3


@pytest.mark.parametrize(
    ("gain", "said"),
    [
        (2.0, "is 2 times as fast as"),
        (1.1, "is about as fast as"),
        (0.9, "is about as fast as"),
        (0.5, "takes 2 times as long as"),
    ],
)
def test_stiff_cases_are_said_with_their_factor(gain, said):
    of_all = {"case": "a", "value": "b", "reached": True}
    records = [of_all | {"integrator": "dormand_prince_54"}, of_all | {"integrator": stiff.IMPLICIT, "gain": gain}]
    (sentence,) = stiff.sentences(records)
    assert sentence.startswith(f"a, b: Rosenbrock 3(2) {said}") and sentence.endswith(" the best explicit method.")


def test_png_holds_the_pixels():
    pixels = np.random.default_rng(1).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    content = png.encoded(pixels)
    assert content.startswith(b"\x89PNG\r\n\x1a\n")
    at, chunks = 8, {}
    while at < len(content):
        (length,) = struct.unpack(">I", content[at : at + 4])
        kind, body = content[at + 4 : at + 8], content[at + 8 : at + 8 + length]
        assert struct.unpack(">I", content[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        chunks[kind], at = body, at + 12 + length
    assert struct.unpack(">IIBB", chunks[b"IHDR"][:10]) == (7, 5, 8, 2)
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(5, 22)
    assert (lines[:, 0] == 0).all() and np.array_equal(lines[::-1, 1:].reshape(5, 7, 3), pixels)


def test_diagram_is_xml_with_points_at_their_logarithms():
    curve = Curve("a & b", [(1e-2, 1e1), (1.0, 1e3), (float("nan"), 1.0), (0.0, 1.0)])
    text = Diagram("<title>", "error", "time", [curve], marks=[(1e-2, 1e1, "mark")], verticals=[(0.1, "goal")]).as_svg()
    root = ElementTree.fromstring(text)
    dots = [e for e in root.iter() if e.tag.endswith("circle") and e.get("r") == "3"]
    assert len(dots) == 4  # two points, and two in the legend
    assert float(dots[0].get("cx")) == LEFT and float(dots[1].get("cx")) == WIDTH - RIGHT
    assert 0 < float(dots[1].get("cy")) < float(dots[0].get("cy")) < HEIGHT
    assert "nothing could be measured" in Diagram("a", "x", "y", [Curve("b", [])]).as_svg()


def test_page_escapes_and_folds():
    page = Page("a < b")
    page.section("one")
    page.table([{"a": "<x>", "b": float("nan"), "front": True}], {"a": "A", "b": "B"}, folded="more")
    html = page.html()
    assert "&lt;x&gt;" in html and "<x>" not in html and "NaN" in html and "a &lt; b" in html
    assert "<details>" in html and 'href="#section1"' in html
