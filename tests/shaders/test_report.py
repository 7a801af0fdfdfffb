"""The report measures what it says: errors come again to the last digit, methods have their order, maps show it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.reference import true_ends
from addon.core.report import ablation, error_map, work_precision
from addon.core.report.cases import built_in, of_scene
from addon.core.report.clock import Clock, run_in_turns
from addon.core.report.dangers import sentences
from addon.core.report.make_report import MAPPED, write
from addon.core.report.methods import Method
from addon.core.report.work_precision import Effort, bounding_sphere_floor, precision, run_case
from addon.core.scene import Scene, SceneError
from addon.core.settings import WITH_ERROR_ESTIMATE, Settings, SettingsError
from addon.core.trace import Cancelled, render, trace_rays
from tests.shaders.scenes import HOLE, camera, mixed

CASES = {case.title: case for case in built_in()}
HOLE_CASE = CASES["Schwarzschild, camera at 20 M"]
EFFORT = Effort(side=8, picture=8, repeats=2, patience=0.02, again=2, most_steps=2000)
TIMES = {"time_min_ms", "time_median_ms", "compile_ms", "rays_per_second", "ns_per_ray", "ns_per_ray_step", "repeats"}


def nothing(fraction, text):
    pass


@pytest.fixture
def few_methods(monkeypatch):
    """Four curves, of both pipelines and all step controls: all their settings, and the paper's default."""
    chosen = (
        Method("paper", "euler", "constant"),
        Method("paper", "runge_kutta_4", "doubling"),
        Method("fused", "verlet", "doubling"),
        Method("fused", "dormand_prince_54", "embedded"),
    )
    monkeypatch.setattr(work_precision, "METHODS", chosen)
    return 3 * 6 + 7 + 1


@pytest.mark.parametrize("title", ["Luneburg lens", "Schwarzschild, camera at 20 M", "Lorenz as a force of 1e-4"])
def test_errors_come_again_to_the_last_digit(egl, few_methods, title):
    """All figures of two reports but times, and what depends on the order of times; in both pipelines."""
    first, second = (run_case(CASES[title], EFFORT, nothing) for _ in range(2))
    assert len(first) == few_methods and sum(row["papers_default"] for row in first) == 1
    assert {row["pipeline"] for row in first if row["error_p99_px"] > 0.0} == {"paper", "fused"}
    for one, other in zip(first, second, strict=True):
        assert one.keys() == other.keys()
        for key in one.keys() - TIMES - {"front"}:
            assert one[key] == other[key] or (one[key] != one[key] and other[key] != other[key]), key
        assert np.isnan(one["ns_per_ray"]) or one["time_min_ms"] <= one["time_median_ms"]


def test_no_two_settings_of_a_curve_are_the_same(egl):
    """A tolerance below float32's rounding of a step would be another name for the one above it: each that is tried
    takes more steps than the one before.
    """
    positions, directions = HOLE_CASE.rays(8)
    for method in (Method("fused", name, "embedded") for name in WITH_ERROR_ESTIMATE):
        settings = [settings for _, settings in method.settings(HOLE_CASE.model, 20_000)]
        steps = [int(trace_rays(HOLE_CASE.model, positions, directions, each).steps.sum()) for each in settings]
        assert len(settings) >= 6 and (np.diff(steps) > 0).all(), method.label


def test_runs_of_several_take_turns(egl):
    """None has its second run before all had their first; one that is slow has two."""
    order = []

    class Listed(Clock):
        def run(self):
            super().run()
            order.append(self)

    clocks = [Listed(HOLE_CASE, MAPPED, 8) for _ in range(3)]
    run_in_turns(clocks, 3, patience=1e9)
    assert [clocks.index(clock) for clock in order] == [0, 1, 2] * 3
    slow = Listed(HOLE_CASE, MAPPED, 8)
    run_in_turns([slow], 9, patience=0.0)
    assert len(slow.times) == 2


@pytest.mark.parametrize(
    ("integrator", "order", "step"), [("euler", 1, 0.1), ("verlet", 2, 0.2), ("runge_kutta_4", 4, 3.2)]
)
def test_measured_errors_fall_with_the_methods_order(egl, integrator, order, step):
    """Of the median ray, far from critical; from h to h / 2, above float32's floor. Half an order is how far these
    steps are from the limit of small ones.
    """
    case = HOLE_CASE
    positions, directions = case.rays(8)
    truth = true_ends(case.model, positions, directions)
    settings = Settings(pipeline="fused", integrator=integrator, step_control="constant", step=step, segments=5000)
    found = [
        precision(case, replace(settings, step=h), positions, directions, truth)["error_median_px"]
        for h in (step, step / 2)
    ]
    assert abs(np.log2(found[0] / found[1]) - order) < 0.5


def test_the_promised_error_is_the_rendered_one(egl):
    """A setting measured on one sample of a picture has that error on other rays of it: its 99th percentile over 1024
    others within a factor of two, which is how far two samples' 99th percentiles of this picture may differ where the
    method's own error is far above rounding, as here.
    """
    case = HOLE_CASE
    loose = Settings(integrator="dormand_prince_54", tolerance=1e-4)
    found = []
    for side in (24, 32):
        positions, directions = case.rays(side)
        truth = true_ends(case.model, positions, directions)
        found.append(precision(case, loose, positions, directions, truth)["error_p99_px_outside_band"])
    assert 0.5 < found[0] / found[1] < 2.0


def test_floor_of_the_bounding_sphere(egl):
    """Where a force of a long range is cut at 1000 lengths, a ray has still to turn by about b / 2 r^2, with b up to
    some 14. There is none where the far field is known.
    """
    positions, directions = HOLE_CASE.rays(8)
    long = MODELS["radial_potential"](xi="yukawa", zeta=-1.0, mu=0.0)
    case = replace(HOLE_CASE, scene=replace(HOLE_CASE.scene, model=long))
    floor = bounding_sphere_floor(case, positions, directions, true_ends(case.model, positions, directions))
    assert 3 / 2e6 < floor < 1.2 * 14 / 2e6
    assert bounding_sphere_floor(HOLE_CASE, positions, directions, HOLE_CASE.truth(positions, directions)) == 0.0
    lens = CASES["Luneburg lens"]
    assert bounding_sphere_floor(lens, *lens.rays(8), true_ends(lens.model, *lens.rays(8))) < 1e-9


def test_error_map_shows_shadow_and_band(egl):
    found = error_map.measure(HOLE_CASE, MAPPED, 24, 24, lambda fraction: None)
    assert (found.true[12, 12] == error_map.ABSORBED).all() and found.true[0, 0].any()
    assert found.figures["rays"] == 576 and found.figures["misclassified_percent"] < 1.0
    part = error_map.shadows_edge(HOLE_CASE)
    assert 0.2 < part[0] < part[1] < 0.3  # arcsin(sqrt(27 (1 - 2/20)) / 20) from the middle, the half being 0.5
    close = error_map.measure(HOLE_CASE, MAPPED, 24, 24, lambda fraction: None, part)
    assert close.figures["near_critical"] > 24 and found.figures["near_critical"] == 0
    assert close.figures["error_max_px"] > found.figures["error_max_px"]
    legend = error_map.legend(100, 4)
    assert legend.shape == (4, 100, 3) and legend[0, 0].sum() < legend[0, -1].sum()


def test_half_floats_are_the_papers_finding(egl):
    """16 bit has 11 digits: each of some fifty textures of a ray rounds its direction by up to 2^-12, a quarter of a
    pixel. 32 bit has less than a thousandth of that, and RK4 hardly an error of its own.
    """
    full, half = ablation.half_floats(EFFORT)[:2]
    assert (full["ray_bits"], half["ray_bits"], full["integrator"]) == (32, 16, "runge_kutta_4")
    assert full["error_median_px"] < 0.01 and half["error_median_px"] > 0.25


def test_what_is_left_out_does_not_change_the_picture(egl):
    scene = ablation.busy_scene(32)
    for name, settings, _, other in ablation.alternatives()[:5]:
        pictures = [ablation.timed(scene, chosen, EFFORT)[1] for chosen in (settings, other)]
        assert np.abs(pictures[0] - pictures[1]).max() < 1e-5, name


def test_a_users_scene(egl, few_methods, tmp_path):
    """Its camera and law without its objects; files of all kinds, and a report without NaN in its JSON."""
    scene = mixed(HOLE, camera(16, 12, position=(0.0, -20.0, 3.0)), count=4)
    index = write(tmp_path / "report", quick=True, scene=scene, versions={"us": "1"})
    page = index.read_text(encoding="utf-8")
    assert "<svg" in page and "data:image/png" in page and "http://" not in page.replace("http://www.w3.org", "")
    content = json.loads((index.parent / "report.json").read_text(encoding="utf-8"))
    assert {row["model"] for row in content["work_precision"]} == {"schwarzschild"}
    assert [row["rendered_px"] < row["goal_px"] for row in content["recommended"]] == [True, True]
    assert content["stability"] == [] and content["environment"]["us"] == "1"
    drawn = sorted(path.name for path in index.parent.glob("*.png"))
    assert drawn == ["error_map_0.png", "error_map_1.png", "work_precision_schwarzschild.png"]
    assert len(list(index.parent.glob("*.svg"))) == 1
    assert (index.parent / "work_precision.csv").read_text(encoding="utf-8").count("\n") == few_methods + 1


@pytest.mark.parametrize(
    ("model", "distance", "options", "sentence"),
    [
        (HOLE, 1.5, {"observer": "static"}, "horizon"),
        (MODELS["kerr"](), 20.0, {"integrator": "nystrom_64"}, "position alone"),
    ],
)
def test_a_scene_that_cannot_be_rendered_has_no_report(tmp_path, model, distance, options, sentence):
    """It is refused before anything is measured, with the sentence that a render has."""
    scene = Scene(camera(16, 12, position=(0.0, -distance, 0.0)), model)
    with pytest.raises((SceneError, SettingsError), match=sentence):
        write(tmp_path, quick=True, scene=scene, settings=Settings(**options), progress=pytest.fail)


def test_dangers_are_named(egl):
    def near(position, half, **options):
        scene = Scene(camera(64, 64, position=position, half=half), HOLE)
        return " ".join(sentences(of_scene(scene), replace(MAPPED, **options)))

    assert near((0.0, -20.0, 0.0), 0.5) == "None of the extreme cases that the report knows is near."
    assert "at 2.5 M from the centre" in near((0.0, -2.5, 0.0), 0.5)
    # The shadow's edge is at 0.25 of the distance: a picture that ends there has the band in it.
    assert "% of the rays are within 0.001 of the critical" in near((0.0, -20.0, 0.0), 0.27)
    assert "reached the step limit (5)" in near((0.0, -20.0, 0.0), 0.5, max_steps=5)


def test_a_stopped_report_writes_nothing(egl, tmp_path):
    def stop(fraction, text):
        if fraction > 0.1:
            raise Cancelled

    with pytest.raises(Cancelled):
        write(tmp_path / "report", quick=True, progress=stop)
    assert not (tmp_path / "report").exists()


def test_time_is_of_the_rays_that_were_asked_for(egl):
    clock = Clock(HOLE_CASE, MAPPED, 8)
    clock.run()
    figures = clock.figures()
    assert figures["ns_per_ray"] == pytest.approx(1e6 * figures["time_min_ms"] / 64)


def test_rays_of_a_case_are_the_pictures(egl):
    """A pixel's ray in float64 is the one that the shader's camera makes: both end in the same direction."""
    positions, directions = HOLE_CASE.pixel_rays(8, 8)
    picture = render(HOLE_CASE.small(8, 8), replace(MAPPED, passes=("Direction", "Status")))
    ends = trace_rays(HOLE_CASE.model, positions, directions, MAPPED)
    assert (picture.passes["Status"].ravel() == ends.status).all()
    # A camera ray is rounded in float32 in two ways; a ray of this picture magnifies that some thirty times.
    escaped = ends.status == 2
    apart = np.abs(picture.passes["Direction"].reshape(-1, 3) - ends.direction)[escaped]
    assert apart.max() < 30 * 8 * 2.0**-24 + 2 * MAPPED.tolerance
