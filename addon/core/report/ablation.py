"""What each thing that is left out or accelerated saves, and what it does to the picture."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ..models import MODELS
from ..reference import true_ends
from ..scene import Camera, Environment, Material, Scene, Spheres, Triangles
from ..settings import PASSES, Settings
from ..trace import render
from .cases import built_in, look_at_centre
from .clock import WARM_UP, Clock, run_in_turns
from .work_precision import Effort, Progress, precision

FUSED = Settings(pipeline="fused", integrator="dormand_prince_54", step_control="embedded", tolerance=1e-4)
PAPER = Settings(pipeline="paper", integrator="euler", step_control="doubling", tolerance=1e-3)
EVERY_PASS = tuple(name for name in PASSES if name != "Error")


def alternatives() -> list[tuple[str, Settings, str, Settings]]:
    """(what it is, with it, how it is without it, without it)."""
    return [
        ("paper: early termination", PAPER, "off", replace(PAPER, early_termination="off")),
        ("paper: rays that hit end early", PAPER, "only rays that left do", replace(PAPER, early_termination="bounds")),
        ("paper: objects in batches", PAPER, "one a draw, as in the paper", replace(PAPER, batch_size=1)),
        ("paper: batches are culled", PAPER, "off", replace(PAPER, cull_batches=False)),
        ("fused: only Combined is asked for", FUSED, "all passes", replace(FUSED, passes=EVERY_PASS)),
        (
            "fused: steps from an error estimate",
            FUSED,
            "step doubling",
            replace(FUSED, step_control="doubling"),
        ),
        ("one program (fused)", FUSED, "pass by pass (paper)", replace(FUSED, pipeline="paper")),
    ]


def run(effort: Effort, progress: Progress) -> list[dict]:
    """A record for each thing: milliseconds with and without it, and how far the pictures differ."""
    scene = busy_scene(2 * effort.picture)
    rows = []
    for index, (name, settings, other_name, other) in enumerate(choices := alternatives()):
        progress(index / len(choices), f"Left out and accelerated: {name}")
        (with_it, picture), (without, plain) = (timed(scene, chosen, effort) for chosen in (settings, other))
        difference = np.abs(picture - plain).max(axis=2)  # of a channel
        rows.append(
            {
                "model": scene.model.name,
                "what": name,
                "without": other_name,
                "with_ms": with_it,
                "without_ms": without,
                "saves_percent": 100.0 * (1.0 - with_it / without),
                "difference_max": float(difference.max()),
                "pixels_that_differ_percent": 100.0 * float((difference > 1e-3).mean()),
            }
        )
    rows.append(_geometry_left_out(scene, effort))
    rows.append(_integration_left_out(scene, effort))
    return rows


def half_floats(effort: Effort) -> list[dict]:
    """Rays in textures of 16 bit beside 32, everything else the same: a method that is right in 32 bit, and Euler's,
    whose own error hides the digits that are missing.
    """
    case = next(case for case in built_in() if case.name == "schwarzschild")
    positions, directions = case.rays(effort.side)
    truth = true_ends(case.model, positions, directions)
    step = 4.0 * case.model.default_step()
    precise = replace(PAPER, integrator="runge_kutta_4", step_control="constant", step=step, segments=2000)
    several = [replace(each, ray_bits=bits) for each in (precise, replace(PAPER, segments=2000)) for bits in (32, 16)]
    clocks = [Clock(case, settings, effort.picture) for settings in several]
    run_in_turns(clocks, effort.repeats, effort.patience)
    return [
        {"model": case.name, "case": case.title, "integrator": settings.integrator, "ray_bits": settings.ray_bits}
        | precision(case, settings, positions, directions, truth)
        | clock.figures()
        for settings, clock in zip(several, clocks, strict=True)
    ]


def busy_scene(columns: int) -> Scene:
    """A torus of 256 triangles and four spheres around a hole, before a sky of one colour; columns x 3/4 columns."""
    window = (-0.45, 0.45, -0.3375, 0.3375)
    camera = Camera(look_at_centre((0.0, -24.0, 4.5)), window, columns, 3 * columns // 4)
    materials = tuple(Material(emission=color) for color in ((1.0, 0.5, 0.1), (0.2, 0.4, 1.0)))
    return Scene(
        camera,
        MODELS["schwarzschild"](),
        triangles=torus(8.0, 1.0, 16, 8),
        spheres=_balls(),
        materials=materials,
        environment=Environment(color=(0.05, 0.05, 0.1)),
    )


def torus(radius: float, thickness: float, around: int, across: int) -> Triangles:
    """In the XY plane; 2 · around · across triangles."""
    u, v = np.meshgrid(np.arange(around + 1) / around, np.arange(across + 1) / across, indexing="ij")
    u, v = 2.0 * np.pi * u, 2.0 * np.pi * v
    normal = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    points = radius * np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=-1) + thickness * normal

    def corners(grid: np.ndarray) -> np.ndarray:
        a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        return np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2).reshape(-1, 3, 3)

    positions = corners(points)
    n = len(positions)
    return Triangles(
        positions,
        corners(normal).astype(np.float32),
        np.zeros((n, 3, 2), np.float32),
        np.zeros(n, np.int32),
        np.ones(n, np.int32),
    )


def _balls() -> Spheres:
    centres = np.array([[0.0, 5.0, 3.0], [5.0, -3.0, 2.0], [-5.0, -3.0, 2.0], [0.0, 0.0, -5.0]])
    n = len(centres)
    ones = np.ones(n, np.int32)
    return Spheres(centres, np.full(n, 0.8), np.tile(np.eye(3), (n, 1, 1)), ones, 2 * ones)


def timed(scene: Scene, settings: Settings, effort: Effort) -> tuple[float, np.ndarray]:
    """Milliseconds of tracing, the least of several after a warm-up of a few pixels, and the picture."""
    few = replace(scene.camera, width=WARM_UP, height=WARM_UP)
    render(replace(scene, camera=few), settings)
    frames, begin = [], time.perf_counter()
    while len(frames) < effort.repeats and (not frames or time.perf_counter() - begin < effort.patience):
        frames.append(render(scene, settings))
    return min(frame.statistics.milliseconds["trace"] for frame in frames), frames[0].passes["Combined"]


def _geometry_left_out(scene: Scene, effort: Effort) -> dict:
    """Nothing in it to meet: the program has no intersection."""
    empty = replace(scene, triangles=Triangles.empty(), spheres=Spheres.empty())
    return _left_out("objects, where there are none", empty, scene, effort)


def _integration_left_out(scene: Scene, effort: Effort) -> dict:
    """The straight law against a hole with hardly a mass, which is integrated and bends nothing."""
    straight = replace(scene, model=MODELS["straight"]())
    weightless = replace(scene, model=MODELS["schwarzschild"](mass=1e-6))
    return _left_out("integration, where rays are straight", straight, weightless, effort)


def _left_out(what: str, lean: Scene, full: Scene, effort: Effort) -> dict:
    (with_it, _), (without, _) = timed(lean, FUSED, effort), timed(full, FUSED, effort)
    return {
        "model": lean.model.name,
        "what": f"fused: left out: {what}",
        "without": "kept",
        "with_ms": with_it,
        "without_ms": without,
        "saves_percent": 100.0 * (1.0 - with_it / without),
        "difference_max": float("nan"),  # another scene
        "pixels_that_differ_percent": float("nan"),
    }
