"""A frame of 16,384 x 8,192 in tiles, in a process of its own: what it takes in memory, beside what is stated of it."""

from __future__ import annotations

import json
import re
import resource
import subprocess
import sys
import time
from pathlib import Path

from addon.core import trace
from addon.core.memory import frame_bytes, picture_bytes

from . import scenes, settings
from .mode import Mode
from .report import Part, Table, Target

REPOSITORY = Path(__file__).resolve().parents[2]
SPHERES = 10
SMALL = (256, 128)  # a first frame, which brings the driver and the program: they are there for any size
TOLERANCE = 1e-3  # radians; the light is straight, and has no error
MEBIBYTE = 2**20


def measure(mode: Mode) -> Part:
    columns, rows = mode.large_size
    command = [sys.executable, "-m", __spec__.name, str(columns), str(rows)]
    done = subprocess.run(command, cwd=REPOSITORY, check=True, stdout=subprocess.PIPE, text=True)
    figures = json.loads(done.stdout.splitlines()[-1])
    size = f"{columns:,} x {rows:,}"
    row = [figures[name] / MEBIBYTE for name in ("stated", "taken", "picture", "beside", "device")]
    head = ("", "stated", "taken", "the picture", "beside it", "textures", "seconds")
    note = "Taken is the peak of the resident memory over that of a small frame; textures are in it on llvmpipe."
    table = Table("A large frame in tiles: MiB", head, [(size, *row, figures["seconds"])], note)
    return Part([table], figures, [Target(f"{size} in tiles: memory, of what is stated", row[1] / row[0], 1.0)])


def main(size: tuple[int, int]) -> dict[str, float]:
    """Bytes, and seconds. device : textures of the tile and of the scene, at their largest"""
    chosen = settings.fused(TOLERANCE, TOLERANCE, escape_radius=None)
    trace.render(scenes.sphere_scene(scenes.STRAIGHT, SMALL, SPHERES), chosen)
    pipelines = []
    make_pipeline = trace.make_pipeline
    trace.make_pipeline = lambda *given: pipelines.append(make_pipeline(*given)) or pipelines[0]
    scene = scenes.sphere_scene(scenes.STRAIGHT, size, SPHERES)
    before, begin = peak_bytes(), time.perf_counter()
    trace.render(scene, chosen)
    taken, seconds = peak_bytes() - before, time.perf_counter() - begin
    picture = picture_bytes(size, chosen)
    textures = pipelines[0].target.framebuffer.color_attachments
    return {
        "stated": frame_bytes(scene, chosen, trace.pack_for(scene, chosen)),
        "taken": taken,
        "picture": picture,
        "beside": taken - picture,
        "device": pipelines[0].uploaded_bytes + sum(4 * t.width * t.height * t.components for t in textures),
        "seconds": seconds,
    }


def peak_bytes() -> int:
    """Of this process's resident memory. On Linux getrusage's begins with that of the process that started it."""
    status = Path("/proc/self/status")
    if status.exists():
        return 1024 * int(re.search(r"VmHWM:\s*(\d+) kB", status.read_text(encoding="ascii"))[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # bytes on macOS


if __name__ == "__main__":
    print(json.dumps(main((int(sys.argv[1]), int(sys.argv[2])))))
