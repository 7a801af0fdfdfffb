"""The report: measures everything and writes index.html, report.json, CSV tables, diagrams and a summary to compare."""

from __future__ import annotations

import csv
import json
import math
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .. import device as gpu
from ..reference import true_ends
from ..scene import Scene
from ..settings import Settings
from ..trace import render
from . import ablation, error_map, estimates, png, precision_diagram, stability, stiff
from .cases import QUICK as LEFT_OUT_IF_QUICK
from .cases import Case, built_in, of_scene
from .compare import summarise
from .dangers import sentences
from .page import Page
from .plots import Diagram
from .recommend import GOALS, recommendation, sentence, settings_of
from .work_precision import FULL, QUICK, Effort, Progress, precision, run_case

MAPPED = Settings(pipeline="fused", integrator="dormand_prince_54", step_control="embedded", tolerance=1e-4)
MAP_SIDE = {True: 32, False: 96}  # quick or not: pixels of the error map


@dataclass
class Report:
    """Records by list: each has its `model`."""

    environment: dict[str, str]
    work_precision: list[dict] = field(default_factory=list)
    stability: list[dict] = field(default_factory=list)
    stiff: list[dict] = field(default_factory=list)
    error_maps: list[dict] = field(default_factory=list)
    estimates: list[dict] = field(default_factory=list)
    ablation: list[dict] = field(default_factory=list)
    half_floats: list[dict] = field(default_factory=list)
    recommended: list[dict] = field(default_factory=list)

    def lists(self) -> dict[str, list[dict]]:
        return {name: value for name, value in vars(self).items() if isinstance(value, list)}


def write(
    folder: str | os.PathLike,
    *,
    quick: bool = False,
    scene: Scene | None = None,
    settings: Settings | None = None,
    versions: Mapping[str, str] | None = None,
    command: str = "make report",
    progress: Progress = lambda fraction, text: None,
) -> Path:
    """Measure and write; the path of index.html. What progress() raises ends the work before anything is written.

    scene, settings : the user's; None for all built-in models
    versions : name -> version, of what the caller runs in;  command : what repeats the report
    """
    folder = Path(folder)
    effort = QUICK if quick else FULL
    cases = (
        [of_scene(scene)] if scene else [case for case in built_in() if not (quick and case.title in LEFT_OUT_IF_QUICK)]
    )
    report = Report(_environment(versions or {}, command, effort))
    page = Page("Nonlinear Rays: error, time and stability")
    page.text(*(f"{name}: {value}" for name, value in report.environment.items()))
    diagrams = _work_precision(report, page, cases, effort, _part(progress, 0.0, 0.6))
    _error_maps(report, page, cases, quick, settings, _part(progress, 0.6, 0.7))
    _estimates(report, page, cases)
    if scene:
        _users(report, page, scene, cases[0], settings, effort, _part(progress, 0.7, 1.0))
    else:
        _ablation(report, page, effort, _part(progress, 0.7, 0.8))
        diagrams |= _stability(report, page, quick, _part(progress, 0.8, 0.95))
        _stiff(report, page, quick, _part(progress, 0.95, 1.0))
    progress(1.0, "Writing")
    folder.mkdir(parents=True, exist_ok=True)
    for name, diagram in diagrams.items():
        (folder / f"{name}.svg").write_text(diagram.as_svg(), encoding="utf-8")
        (folder / f"{name}.png").write_bytes(diagram.as_png())
    for name, rows in report.lists().items():
        if not rows:
            continue
        _write_csv(folder / f"{name}.csv", rows)
    content = {"environment": report.environment} | report.lists()
    _write_json(folder / "report.json", content)
    _write_json(folder / "summary.json", summarise(content))
    index = folder / "index.html"
    index.write_text(page.html(), encoding="utf-8")
    return index


# The parts of the page


def _work_precision(
    report: Report, page: Page, cases: Sequence[Case], effort: Effort, progress: Progress
) -> dict[str, Diagram]:
    page.section("Work and precision")
    page.text(
        f"{effort.side**2} rays of each picture, one at random in each of as many equal parts, are held against DOP853 "
        "in float64 (tolerance 1e-12, and again with 1e-10: a ray on which the two differ by more than 1e-7 rad counts "
        "as unresolved and is left out). The error is the angle between the directions in which rays leave, in pixels "
        f"(the first picture's are {1e3 * cases[0].pixel:.3g} mrad). The time is that of tracing {effort.picture}² "
        "pixels: the least of up to "
        f"{effort.repeats} runs after a warm-up.",
        "Grey: the Pareto front. A ring marks the paper's default: Euler, n_integration 10, step doubling.",
        "The curves fall with the order of the method until they meet a floor: float32's rounding, which grows again "
        "with the number of steps, or, with constant steps, what the bounding sphere cuts off.",
    )
    diagrams = {}
    for index, case in enumerate(cases):
        rows = run_case(case, effort, _part(progress, index / len(cases), (index + 1) / len(cases)))
        report.work_precision += rows
        diagram = precision_diagram.diagram(case.title, rows)
        diagrams[f"work_precision_{_file_name(case.title)}"] = diagram
        page.heading(case.title)
        page.text(*(sentence(rows, goal) for goal in GOALS), advice=True)
        page.text(
            f"{rows[0]['unresolved']} of {rows[0]['rays']} rays have no converged reference.",
            f"Constant steps end at the bounding sphere, where rays have still to turn by "
            f"{rows[0]['bounding_sphere_px']:.2g} pixel (99th percentile): their curves fall to this.",
        )
        page.raw(diagram.as_svg())
        page.table(rows, WORK_COLUMNS, folded=f"All {len(rows)} settings")
    return diagrams


def _error_maps(
    report: Report, page: Page, cases: Sequence[Case], quick: bool, settings: Settings | None, progress: Progress
) -> None:
    page.section("Where the error is")
    chosen = settings if settings and settings.step_control != "constant" else MAPPED
    case = next((case for case in cases if case.name == "schwarzschild"), cases[0])
    if not case.model.curved:
        page.text("Rays are straight: there is nothing to integrate.")
        return
    side = MAP_SIDE[quick]
    parts = {"The whole picture": error_map.WHOLE}
    edge = error_map.shadows_edge(case)
    if edge:
        parts[f"The shadow's edge, {error_map.CLOSE_UP:g} of the picture across"] = edge
    for index, (title, part) in enumerate(parts.items()):
        told = _part(progress, index / len(parts), (index + 1) / len(parts))
        found = error_map.measure(
            case, chosen, side, side, lambda done, told=told: told(done, f"{case.title}: the error map"), part
        )
        report.error_maps.append(found.figures)
        page.heading(title)
        pictures = (error_map.enlarged(picture, 480 // side) for picture in (found.true, found.estimated))
        page.pictures(
            [png.as_data(png.encoded(picture)) for picture in pictures],
            f"{case.title}, {chosen.integrator}, {chosen.step_control}, tolerance {chosen.tolerance:g}. Left: the true "
            "error; right: the integrator's own estimate (the Error pass). Black: absorbed; grey: no converged "
            "reference; cyan: ends elsewhere than the truth.",
        )
    page.pictures(
        [png.as_data(png.encoded(error_map.legend(480, 14)))],
        f"From 10^{error_map.LOW:g} to 10^{error_map.HIGH:g} pixels.",
    )
    figures = report.error_maps[0]
    page.text(
        f"The truth exceeds the estimate at {figures['truth_exceeds_estimate_percent']:.2g} % of the pixels, and the "
        f"tolerance at {figures['truth_exceeds_tolerance_percent']:.2g} %; at the median pixel the estimate is "
        f"{figures['estimate_over_truth_median']:.2g} times the true error.",
        advice=True,
    )
    page.table(report.error_maps, {key: key.replace("_", " ") for key in figures if key not in ("model", "case")})


def _estimates(report: Report, page: Page, cases: Sequence[Case]) -> None:
    report.estimates = estimates.of_every_case(report.work_precision, {case.title: case.pixel for case in cases})
    if not report.estimates:
        return
    page.section("How well the Error pass tracks the truth")
    page.text(estimates.WHY)
    page.table(report.estimates, ESTIMATE_COLUMNS)


def _users(
    report: Report,
    page: Page,
    scene: Scene,
    case: Case,
    settings: Settings | None,
    effort: Effort,
    progress: Progress,
) -> None:
    """What the scene is near to; whether each recommended setting keeps its promise on other rays of the picture."""
    positions, directions = case.rays(effort.side + 5)
    truth = true_ends(case.model, positions, directions)
    for index, goal in enumerate(GOALS):
        row = recommendation(report.work_precision, goal)
        if row is None:
            continue
        chosen = settings_of(row, effort.most_steps)
        told = _part(progress, index / len(GOALS), (index + 1) / len(GOALS))
        frame = render(scene, chosen, progress=lambda done, text, told=told: told(done, "The recommended setting"))
        found = precision(case, chosen, positions, directions, truth)
        kept = {key: row[key] for key in ("model", "pipeline", "integrator", "step_control", "value")}
        kept |= {"goal_px": goal, "promised_px": row["error_p99_px_outside_band"]}
        kept |= {"rendered_px": found["error_p99_px_outside_band"]}
        kept |= {f"{stage}_ms": value for stage, value in frame.statistics.milliseconds.items()}
        report.recommended.append(kept)
    page.section("Dangers")
    page.text(*sentences(case, settings or MAPPED))
    page.section("Recommended, rendered")
    page.text(
        "Each recommended setting on other rays of the picture, beside what was promised, and the time of each stage "
        f"of rendering this scene with its objects at {scene.camera.size[0]} x {scene.camera.size[1]}."
    )
    keys = dict.fromkeys(key for row in report.recommended for key in row)
    page.table(report.recommended, {key: key.replace("_", " ") for key in keys if key != "model"})


def _ablation(report: Report, page: Page, effort: Effort, progress: Progress) -> None:
    report.ablation = ablation.run(effort, _part(progress, 0.0, 0.8))
    page.section("Left out and accelerated")
    page.text(
        "With each thing and without it, in milliseconds of tracing, and how far the pictures differ (NaN where the "
        "scene has to be another one)."
    )
    page.table(report.ablation, ABLATION_COLUMNS)
    progress(0.8, "16-bit rays")
    report.half_floats = ablation.half_floats(effort)
    page.section("Rays in 16 bit")
    page.text(
        "The paper's finding: half floats are too coarse for the positions and directions of rays. The same settings, "
        "rays in textures of 32 and of 16 bit. Euler's own error is as large as what they lose."
    )
    page.table(report.half_floats, HALF_COLUMNS)


def _stability(report: Report, page: Page, quick: bool, progress: Progress) -> dict[str, Diagram]:
    report.stability = stability.run(quick, progress)
    judged = [row for row in report.stability if row["holds"] is not None]
    failed = [row for row in judged if not row["holds"]]
    page.section("Stability")
    page.text(
        f"{len(judged) - len(failed)} of {len(judged)} expectations hold.",
        *(f"Does not hold: {row['case']}, {row['model']}, {row['value']}: {row['expectation']}." for row in failed),
        advice=True,
    )
    drawn = stability.diagrams(report.stability)
    for diagram in drawn:
        page.raw(diagram.as_svg())
    page.table([row | {"holds": VERDICTS[row["holds"]]} for row in report.stability], STABILITY_COLUMNS)
    return {f"stability_{_file_name(diagram.title)}": diagram for diagram in drawn}


def _stiff(report: Report, page: Page, quick: bool, progress: Progress) -> None:
    report.stiff = stiff.run(quick, progress)
    page.section("Stiff laws: where the Rosenbrock method wins")
    page.text(
        "At equal error: the cheapest setting of each method whose 99th percentile is within "
        f"{stiff.GOAL:g} rad (at rest: of the way). A gain above 1 is faster than the best explicit method."
    )
    page.text(*stiff.sentences(report.stiff), advice=True)
    page.table(report.stiff, STIFF_COLUMNS)


VERDICTS = {True: "yes", False: "NO", None: "reported"}
STABILITY_COLUMNS = {
    "case": "case",
    "model": "model",
    "value": "value",
    "expectation": "expectation",
    "measure": "measured",
    "figure": "figure",
    "bound": "bound",
    "holds": "holds",
    "statuses": "rays",
    "steps_max": "most steps",
    "mean_step": "mean step, τ",
}
STIFF_COLUMNS = {
    "case": "case",
    "value": "value",
    "integrator": "integrator",
    "tolerance": "tolerance",
    "error_p99_rad": "99 %, rad",
    "steps_mean": "steps",
    "steps_max": "most steps",
    "time_min_ms": "ms",
    "gain": "gain",
}
ERROR_COLUMNS = {
    "error_max_px": "max, px",
    "error_rms_px": "RMS, px",
    "error_median_px": "median, px",
    "error_p99_px": "99 %, px",
    "error_p99_px_outside_band": "99 %, px, without band",
    "misclassified_percent": "ends elsewhere, %",
    "failed_percent": "failed, %",
    "drift_max": "drift",
    "steps_mean": "steps",
    "steps_max": "most steps",
    "rejected_mean": "rejected",
}
WORK_COLUMNS = {
    "pipeline": "pipeline",
    "integrator": "integrator",
    "step_control": "control",
    "value": "step or tolerance",
    **ERROR_COLUMNS,
    "estimate_exceeded_percent": "truth > estimate, %",
    "estimate_factor_p99": "truth / estimate, 99 %",
    "time_min_ms": "ms",
    "time_median_ms": "median ms",
    "ns_per_ray": "ns a ray",
    "ns_per_ray_step": "ns a ray and step",
    "front": "front",
    "papers_default": "paper's default",
}
ESTIMATE_COLUMNS = {
    "case": "case",
    "tolerance": "tolerance, rad",
    "estimate_exceeded_percent": "truth > estimate, %",
    "estimate_factor_p99": "truth / estimate, 99 %",
    "magnification_p99": "the law magnifies small errors, times, 99 %",
}
ABLATION_COLUMNS = {
    "what": "with",
    "without": "without",
    "with_ms": "ms with",
    "without_ms": "ms without",
    "saves_percent": "saves, %",
    "difference_max": "largest difference",
    "pixels_that_differ_percent": "pixels that differ, %",
}
HALF_COLUMNS = {"integrator": "integrator", "ray_bits": "bits", **ERROR_COLUMNS, "time_min_ms": "ms"}


# Files


def _environment(versions: Mapping[str, str], command: str, effort: Effort) -> dict[str, str]:
    renderer, driver, moderngl = gpu.run(
        lambda device: (device.ctx.info["GL_RENDERER"], device.ctx.info["GL_VERSION"], _version_of("moderngl"))
    )
    return {
        "Renderer": renderer,
        "Driver": driver,
        "Processor": f"{platform.machine()}, {os.cpu_count()} cores",
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "moderngl": moderngl,
        **versions,
        "Picture": f"{effort.picture} x {effort.picture} pixels timed, {effort.side**2} rays against the reference",
        "Command": command,
    }


def _version_of(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def _write_csv(path: Path, rows: Sequence[dict]) -> None:
    keys = list(dict.fromkeys(key for row in rows for key in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, keys)
        writer.writeheader()
        writer.writerows(rows)


def _write_json(path: Path, content: object) -> None:
    """NaN becomes null: JSON has no other word for it."""
    path.write_text(json.dumps(_without_nan(content), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _without_nan(content: object) -> object:
    if isinstance(content, dict):
        return {key: _without_nan(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_without_nan(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def _file_name(title: str) -> str:
    return "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in title.lower()).strip("_")


def _part(progress: Progress, begin: float, end: float) -> Progress:
    return lambda fraction, text: progress(begin + (end - begin) * fraction, text)
