"""Figure 5 of the paper: Schwarzschild, 500 steps, 50 segments, 1 to 1000 spheres.

The paper has two curves, without and with its accelerations. Here is a third with several spheres a quad, and a fourth
for the fused pipeline; none has more error than the first (matched.py).
"""

from __future__ import annotations

from dataclasses import replace

from addon.core.trace import render

from . import scenes, tried
from .matched import Chosen, matched
from .measure import frame_job, interleaved
from .mode import Mode
from .report import Part, Table, Target

STEPS, SEGMENTS = 500, 50
CROSSBAR = ("unaccelerated", "accelerated")  # a quad for every sphere and segment
LABELS = (*CROSSBAR, "batches", "fused")
SLOW = 100  # spheres, from which on their frames are timed once
MOST_GROWTH = 2.0


def measure(mode: Mode) -> Part:
    chosen = matched(scenes.HOLE, mode, mode.figure_size, STEPS, SEGMENTS, 10)
    adaptive = chosen["accelerated"]
    chosen["batches"] = Chosen(replace(adaptive.settings, batch_size=None, cull_batches=True), adaptive.error)
    for one in chosen.values():  # compiles
        render(scenes.sphere_scene(scenes.HOLE, (64, 48), 1), one.settings)
    seconds: dict[str, dict[int, float]] = {label: {} for label in LABELS}
    for count in mode.spheres:
        scene = scenes.sphere_scene(scenes.HOLE, mode.figure_size, count)
        jobs = {label: frame_job(scene, chosen[label].settings) for label in LABELS}
        crossbar = {label: jobs.pop(label) for label in CROSSBAR}
        timings = interleaved(jobs, mode.repeats)
        if count in mode.crossbar_spheres:
            timings |= interleaved(crossbar, 1 if count >= SLOW else mode.slow_repeats, warm=False)
        for label, timing in timings.items():
            seconds[label][count] = 1e-3 * timing.best("trace")
    rows = [(count, *(seconds[label].get(count) for label in LABELS)) for count in mode.spheres]
    growth = seconds["fused"][mode.spheres[-1]] / seconds["fused"][mode.spheres[0]]
    columns, lines = mode.figure_size
    title = f"Figure 5: Schwarzschild, {SEGMENTS} segments, {STEPS} steps; seconds at {columns} x {lines}"
    note = "Errors, radians: " + ", ".join(f"{label} {chosen[label].error:.2g}" for label in LABELS)
    figures = {
        "seconds": {label: {str(count): value for count, value in row.items()} for label, row in seconds.items()},
        "errors": {label: one.error for label, one in chosen.items()},
        "chosen": {label: one.label for label, one in chosen.items()},
    }
    target = Target("Figure 5: fused, 1 to 1000 spheres, times slower", growth, MOST_GROWTH, tried=tried.WALKS)
    return Part([Table(title, ("spheres", *LABELS), rows, note)], figures, [target])
