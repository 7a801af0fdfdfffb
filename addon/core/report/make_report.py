"""The report: measures everything, and puts it together as a page with its tables, diagrams and pictures."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .. import device as gpu
from ..scene import Scene
from ..settings import Settings
from ..trace import check, integrator_for
from . import ablation, error_map_section, estimates, pictures, precision_section, stability, stiff, users_scene
from .cases import QUICK as LEFT_OUT_IF_QUICK
from .cases import Case, built_in, of_scene
from .columns import ABLATION_COLUMNS, ESTIMATE_COLUMNS, HALF_COLUMNS, RECOMMENDED_COLUMNS, STIFF_COLUMNS
from .dangers import sentences
from .files import file_name, save
from .methods import LABELS
from .page import Page
from .plots import Diagram
from .recommend import GOALS
from .work_precision import FULL, QUICK, Effort, Progress, run_case

MAPPED = Settings()  # the product's own


@dataclass
class Report:
    """Records by list: each has its `model`."""

    environment: dict[str, str]
    work_precision: list[dict] = field(default_factory=list)
    stability: list[dict] = field(default_factory=list)
    stiff: list[dict] = field(default_factory=list)
    error_maps: list[dict] = field(default_factory=list)
    estimates: list[dict] = field(default_factory=list)
    pictures: list[dict] = field(default_factory=list)
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
    samples: Mapping[str, tuple[Scene, Settings]] | None = None,
    versions: Mapping[str, str] | None = None,
    command: str = "make report",
    progress: Progress = lambda fraction, text: None,
) -> Path:
    """Measure and write; the path of index.html. What progress() raises ends the work before anything is written.
    Raises SceneError, SettingsError at once where the user's scene cannot be rendered.

    scene, settings : the user's; None for all built-in models
    samples : by name, scenes whose pictures are looked at beside the built-in models
    versions : name -> version, of what the caller runs in;  command : what repeats the report
    """
    effort = QUICK if quick else FULL
    if scene and settings:
        check(scene, settings)
        integrator_for(scene.model, settings)
    cases = (
        [of_scene(scene, settings)]
        if scene
        else [case for case in built_in() if not (quick and case.title in LEFT_OUT_IF_QUICK)]
    )
    report = Report(_environment(versions or {}, command, effort))
    page = Page("Nonlinear Rays: error, time and stability")
    page.text(" · ".join(f"{name}: {value}" for name, value in report.environment.items()))
    if not scene and len(cases) < len(built_in()):
        page.text(f"Left out to save time: {', '.join(LEFT_OUT_IF_QUICK)}. make report has everything.")
    measured = _measured(report, cases, effort, _part(progress, 0.0, 0.6))
    if scene:
        _users(report, page, scene, cases[0], settings, effort, _part(progress, 0.6, 0.9))
    else:
        precision_section.in_short(page, measured)
    diagrams = {
        f"work_precision_{file_name(diagram.title)}": diagram
        for diagram in precision_section.write(page, effort, measured, objects=bool(scene))
    }
    told = _part(progress, 0.9, 1.0) if scene else _part(progress, 0.6, 0.7)
    maps = _error_maps(report, page, cases, quick, settings, told)
    _estimates(report, page, cases)
    seen = {cases[0].title: (scene, settings or MAPPED)} if scene else samples or {}
    _pictures(report, page, seen, quick, told)
    if not scene:
        _ablation(report, page, effort, _part(progress, 0.7, 0.8))
        diagrams |= _stability(report, page, quick, _part(progress, 0.8, 0.95))
        _stiff(report, page, quick, _part(progress, 0.95, 1.0))
    progress(1.0, "Writing")
    return save(Path(folder), page, report.environment, report.lists(), diagrams, maps)


# The parts of the page


def _measured(report: Report, cases: Sequence[Case], effort: Effort, progress: Progress) -> precision_section.Measured:
    measured = []
    for index, case in enumerate(cases):
        told = _part(progress, index / len(cases), (index + 1) / len(cases))
        measured.append((case, run_case(case, effort, told)))
        report.work_precision += measured[-1][1]
    return measured


def _error_maps(
    report: Report, page: Page, cases: Sequence[Case], quick: bool, settings: Settings | None, progress: Progress
) -> dict[str, bytes]:
    chosen = settings if settings and settings.step_control != "constant" else MAPPED
    case = next((case for case in cases if case.name == "schwarzschild"), cases[0])
    if not case.model.curved:  # nothing is integrated
        return {}
    maps = error_map_section.measured(case, chosen, quick, progress)
    report.error_maps = [found.figures for _, found in maps]
    return error_map_section.write(page, case, chosen, maps)


def _estimates(report: Report, page: Page, cases: Sequence[Case]) -> None:
    report.estimates = estimates.of_every_case(report.work_precision, {case.title: case.pixel for case in cases})
    if not report.estimates:
        return
    page.section("How well the Error pass tracks the truth")
    page.text(estimates.WHY)
    page.table(_labelled(report.estimates), ESTIMATE_COLUMNS)


def _pictures(
    report: Report, page: Page, seen: Mapping[str, tuple[Scene, Settings]], quick: bool, progress: Progress
) -> None:
    curved = {name: pair for name, pair in seen.items() if pair[0].model.curved}
    report.pictures = pictures.wrong_pixels(curved, quick, progress)
    if report.pictures:
        pictures.write(page, report.pictures)


def _users(
    report: Report,
    page: Page,
    scene: Scene,
    case: Case,
    settings: Settings | None,
    effort: Effort,
    progress: Progress,
) -> None:
    report.recommended = users_scene.recommended(scene, case, report.work_precision, effort, progress)
    page.section("What to choose for this scene")
    chosen = {row["goal_px"]: row for row in report.recommended}
    page.text(*(precision_section.choice(goal, chosen.get(goal)) for goal in GOALS), advice=True)
    page.text(
        "Measured on other rays of the picture than those of the diagram, with the scene's objects: the error that 99 "
        "of 100 rays stay below (a ray that sees something else than the reference does counts as infinitely wrong), "
        "beside what was promised of the sky alone. Cheaper settings that do not keep below half of the goal here are "
        "passed over. Use This Setting in the panel sets all of it; Tolerance is in pixels there."
    )
    page.table(_labelled(report.recommended), RECOMMENDED_COLUMNS)
    page.text(
        f"The time of each stage of rendering this scene at {scene.camera.size[0]} x {scene.camera.size[1]}. Compiling "
        "includes a first draw of a few pixels, and is next to nothing where the setting above has the same program."
    )
    stages = dict.fromkeys(key for row in report.recommended for key in row if key.endswith("_ms"))
    columns = {key: f"{key.removesuffix('_ms').replace('_', ' ')}, ms" for key in stages}
    page.table(report.recommended, {"goal_px": RECOMMENDED_COLUMNS["goal_px"]} | columns)
    page.section("Dangers")
    page.text(*sentences(case, settings or MAPPED))


def _ablation(report: Report, page: Page, effort: Effort, progress: Progress) -> None:
    report.ablation = ablation.run(effort, _part(progress, 0.0, 0.8))
    page.section("Left out and accelerated")
    page.text(
        "What each thing that is accelerated or left out saves: milliseconds of tracing with and without it, and how "
        "far the pictures differ (NaN where the scene has to be another one). Fused: "
        f"{LABELS[ablation.FUSED.integrator]}, embedded, tolerance {ablation.FUSED.tolerance:g} rad; paper: "
        f"{LABELS[ablation.PAPER.integrator]}, step doubling, tolerance {ablation.PAPER.tolerance:g} rad."
    )
    page.table(report.ablation, ABLATION_COLUMNS)
    progress(0.8, "16-bit rays")
    report.half_floats = ablation.half_floats(effort)
    page.section("Rays in 16 bit")
    page.text(
        "The paper's finding: half floats are too coarse for the positions and directions of rays. The same settings, "
        "rays in textures of 32 and of 16 bit. Euler's own error is as large as what they lose."
    )
    page.table(_labelled(report.half_floats), HALF_COLUMNS)


def _stability(report: Report, page: Page, quick: bool, progress: Progress) -> dict[str, Diagram]:
    report.stability = stability.run(quick, progress)
    drawn = stability.write(page, report.stability)
    return {f"stability_{file_name(diagram.title)}": diagram for diagram in drawn}


def _stiff(report: Report, page: Page, quick: bool, progress: Progress) -> None:
    report.stiff = stiff.run(quick, progress)
    page.section("Stiff laws: where the Rosenbrock method wins")
    page.text(
        "Stiff is a law in which something decays much faster than a ray bends, such as strong friction: an explicit "
        "method must follow the decay with short steps even when it is over, an L-stable one need not. Choose "
        "Rosenbrock where a case like yours says that it is faster, an explicit method elsewhere.",
        "At equal error: the cheapest setting of each method whose 99th percentile is within "
        f"{stiff.GOAL:g} rad (at rest: of the way); inf: rays did not end. Gain: the best explicit method's time as a "
        "multiple of its own.",
    )
    page.text(*stiff.sentences(report.stiff), advice=True)
    page.table(_labelled(report.stiff), STIFF_COLUMNS)


def _labelled(rows: Sequence[dict]) -> list[dict]:
    """With the integrators' names as the page's reader knows them."""
    return [row | {"integrator": LABELS[row["integrator"]]} for row in rows]


# What it was measured with


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


def _part(progress: Progress, begin: float, end: float) -> Progress:
    return lambda fraction, text: progress(begin + (end - begin) * fraction, text)
