"""Table 1 of the paper: four models, 10 spheres, 30 segments, 300 steps.

The paper's pipeline runs without and with the paper's accelerations; the fused one runs without more
error (matched.py).
"""

from __future__ import annotations

from addon.core.trace import render

from . import scenes
from .matched import Chosen, matched
from .measure import Timings, frame_job, interleaved
from .mode import Mode
from .report import Part, Table, Target
from .tried import STEPS as TRIED_STEPS

PAPER_SECONDS = {  # Table 1, ATI Radeon 9700, 800 x 600: without and with the acceleration methods
    "Lorenz System": (3.87, 3.13),
    "Potential Field": (4.22, 1.16),
    "Varying Index of Refraction": (3.35, 2.42),
    "Schwarzschild": (4.91, 3.79),
}
STEPS, SEGMENTS, SPHERES = 300, 30, 10
TIMES_FASTER = 20.0


def measure(mode: Mode) -> Part:
    rows, figures, targets = [], {}, []
    for name, model in scenes.TABLE_1.items():
        chosen = matched(model, mode, mode.table_size, STEPS, SEGMENTS, SPHERES)
        scene, small = (scenes.sphere_scene(model, size, SPHERES) for size in (mode.table_size, (64, 48)))
        for one in chosen.values():  # compiles
            render(small, one.settings)
        jobs = {label: frame_job(scene, one.settings) for label, one in chosen.items()}
        timings = interleaved(jobs, mode.slow_repeats, warm=False)
        more = interleaved(
            {"fused": jobs["fused"]}, mode.repeats, warm=False
        )  # short: two runs would be left to chance
        timings["fused"].runs += more["fused"].runs
        plain, gained, fused = (1e-3 * timings[label].best("trace") for label in chosen)
        without, with_ = PAPER_SECONDS[name]
        rows.append((name, without, with_, without / with_, plain, gained, plain / gained, fused, plain / fused))
        figures[name] = as_json(chosen, timings)
        targets += [
            Target(
                f"Table 1, {name}: fused, times faster than unaccelerated",
                plain / fused,
                TIMES_FASTER,
                True,
                TRIED_STEPS,
            ),
            Target(f"Table 1, {name}: gain of the paper's accelerations", plain / gained, 1.0, True),
        ]
    columns, lines = mode.table_size
    title = f"Table 1: {SPHERES} spheres, {SEGMENTS} segments, {STEPS} steps; seconds at {columns} x {lines}"
    head = ("", "paper: off", "on", "gain", "off", "on", "gain", "fused", "gain")
    return Part([Table(title, head, rows, "paper: 800 x 600."), choice_table(figures)], figures, targets)


def choice_table(figures: dict[str, dict]) -> Table:
    title = "Direction's error against DOP853, 99th percentile, radians; tolerances"
    rows = [
        (name, *(f"{one['error']:.2g}" for one in figure.values()), *(figure[label]["chosen"] for label in ADAPTIVE))
        for name, figure in figures.items()
    ]
    return Table(title, ("", "off", "on", "fused", "on", "fused"), rows)


ADAPTIVE = ("accelerated", "fused")


def as_json(chosen: dict[str, Chosen], timings: dict[str, Timings]) -> dict[str, dict]:
    return {
        label: {"error": one.error, "chosen": one.label, "milliseconds": timings[label].as_json()}
        for label, one in chosen.items()
    }
