"""A torus around the hole, of 256 to 1,048,576 triangles: build, upload and trace apart, and bytes a triangle."""

from __future__ import annotations

from functools import cache

from addon.core.settings import Settings

from . import scenes, settings
from .errors import Rays
from .measure import KeptFrame, Timings, interleaved
from .mode import Mode
from .report import Part, Table, Target

BUILDS = 2  # of each scene, the quicker one counts
PIXELS = 0.1  # the error that is allowed, at the 99th percentile
MOST_GROWTH, MOST_BYTES = 1.6, 160.0
TRUTH = 3000.0  # τ to which the truth is known: as far as rays go in the bounding sphere that the model chooses


def measure(mode: Mode) -> Part:
    chosen, error = within_pixels(mode.scaling_size, mode.rays, PIXELS, "nystrom_64")
    counts = [4 * rings**2 for rings in mode.triangle_rings]
    frames, prepared = {}, {}
    for count, rings in zip(counts, mode.triangle_rings, strict=True):
        scene = scenes.torus_scene(scenes.HOLE, mode.scaling_size, rings)
        made = [KeptFrame(scene, chosen) for _ in range(BUILDS)]
        frames[count] = made[-1]
        prepared[count] = Timings([frame.preparing for frame in made])
    timings = interleaved(frames, mode.repeats)
    rows, figures = [], {}
    for count, frame in frames.items():
        build, upload = (prepared[count].best(stage) for stage in ("pack", "upload"))
        trace, median, read = timings[count].best("trace"), timings[count].median("trace"), timings[count].best("read")
        rows.append((f"{count:,}", build, upload, trace, median, read, frame.bytes / count))
        stages = prepared[count].as_json() | timings[count].as_json()
        figures[str(count)] = {"milliseconds": stages, "bytes": frame.bytes}
    growth = timings[counts[-1]].best("trace") / timings[counts[0]].best("trace")
    columns, lines = mode.scaling_size
    title = f"Scaling: a torus around the hole; milliseconds at {columns} x {lines}"
    head = ("triangles", "build", "upload", "trace", "(median)", "read back", "bytes a triangle")
    note = f"{PIXELS} pixel or less at the 99th percentile: {error:.2g} rad, tolerance {chosen.tolerance:.2g} rad."
    targets = [
        Target("Scaling: 256 to 1,048,576 triangles, times slower", growth, MOST_GROWTH),
        Target("Scaling: bytes of texture a triangle, 1,048,576", frames[counts[-1]].bytes / counts[-1], MOST_BYTES),
    ]
    figures["error, radians"], figures["tolerance, radians"] = error, chosen.tolerance
    return Part([Table(title, head, rows, note)], figures, targets)


@cache
def within_pixels(size: tuple[int, int], rays: int, pixels: float, integrator: str) -> tuple[Settings, float]:
    """The fused pipeline's loosest settings for a picture of the hole, and their error, radians.

    integrator : "automatic" for the sky alone, which it takes by Binet's equation; where there are objects it takes
    "nystrom_64"
    """
    camera = scenes.camera(size)
    bound = pixels * scenes.pixel_angle(camera)
    sample = Rays(scenes.HOLE, camera, rays, TRUTH)

    def fused(tolerance: float) -> Settings:
        return settings.fused(tolerance, bound, escape_radius=None, integrator=integrator)

    return sample.loosest(fused, bound)
