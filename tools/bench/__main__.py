"""Measure, print the tables, write out/bench.json and the plots: `make bench`, `make bench QUICK=1`."""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import json
import math
import os
import platform
import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

from addon.core import device as gpu

from .mode import FULL, QUICK, Mode
from .report import Part, Target, target_table

REPOSITORY = Path(__file__).resolve().parents[2]
PARTS = ("table_1", "figure_5", "scaling", "limit", "left_out", "large_frame", "cycles")  # Blender comes last
NOT_QUICK = {"large_frame"}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tools.bench", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller pictures, fewer runs: below three minutes")
    parser.add_argument("--only", nargs="+", choices=PARTS, help="measure these parts")
    parser.add_argument("--output", type=Path, default=REPOSITORY / "out", help="folder of bench.json and bench/")
    arguments = parser.parse_args()
    mode = QUICK if arguments.quick else FULL
    chosen = arguments.only or [name for name in PARTS if mode is FULL or name not in NOT_QUICK]
    about = environment(mode)
    print(*(f"{name}: {value}" for name, value in about.items()), sep="\n", flush=True)
    parts: dict[str, Part] = {}
    seconds: dict[str, float] = {}
    for name in PARTS:
        if name not in chosen:
            continue
        begin = time.perf_counter()
        parts[name] = importlib.import_module(f".{name}", __package__).measure(mode)
        seconds[name] = time.perf_counter() - begin
        print("", *parts[name].tables, f"  ({seconds[name]:.0f} s)", sep="\n", flush=True)
        write(arguments.output / "bench.json", record(about, parts, seconds))
    print("", target_table([target for part in parts.values() for target in part.targets]), sep="\n")

    from .plots import draw

    drawn = draw({name: part.figures for name, part in parts.items()}, arguments.output / "bench")
    print("", f"Wrote {arguments.output / 'bench.json'}", *(f"Wrote {path}" for path in drawn), sep="\n")
    return 0


def environment(mode: Mode) -> dict[str, object]:
    """What was measured, on what, and the command that repeats it."""
    info = gpu.run(lambda device: dict(device.ctx.info))
    manifest = tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text(encoding="utf-8"))
    return {
        "renderer": info["GL_RENDERER"],
        "driver": info["GL_VERSION"],
        "processors": os.cpu_count(),
        "load before": os.getloadavg()[0],
        "python": platform.python_version(),
        "bpy": importlib.metadata.version("bpy"),
        "moderngl": importlib.metadata.version("moderngl"),
        "nonlinear_rays": manifest["version"],
        "mode": mode.name,
        "command": " ".join(["python -m tools.bench", *sys.argv[1:]]),
    }


def record(about: dict[str, object], parts: dict[str, Part], seconds: dict[str, float]) -> dict[str, object]:
    """What goes into the file: `targets`, and each part's raw figures by its name."""
    targets: Sequence[Target] = [target for part in parts.values() for target in part.targets]
    return {
        "about": about,
        "targets": [target.as_json() for target in targets],
        "seconds": seconds,
        **{name: without_nan(part.figures) for name, part in parts.items()},
    }


def without_nan(value: object) -> object:
    """JSON has no NaN: None stands for it."""
    if isinstance(value, dict):
        return {str(key): without_nan(entry) for key, entry in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write(path: Path, content: dict[str, object]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
