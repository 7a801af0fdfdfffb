"""make report: error against run time of every model, into out/report.  make compare BASE=old.json: what got worse."""

from __future__ import annotations

import argparse
import json
import sys
import time
import tomllib
from importlib.metadata import version
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY))

from addon.core.report.compare import Summary, differences, summarise  # noqa: E402
from tools import bpy_extension  # noqa: E402


class Printed:
    """Progress on the terminal: a line where the text changes."""

    def __init__(self):
        self.begin, self.text = time.perf_counter(), ""

    def __call__(self, fraction: float, text: str) -> None:
        if text != self.text:
            self.text = text
            print(f"{time.perf_counter() - self.begin:6.0f} s {100 * fraction:4.0f} %  {text}", flush=True)


def versions() -> dict[str, str]:
    manifest = tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text(encoding="utf-8"))
    return {"Blender (bpy)": version("bpy"), "Nonlinear Rays": manifest["version"]}


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--quick", action="store_true", help="fewer rays, models and steps: below three minutes")
    arguments.add_argument("--output", type=Path, default=REPOSITORY / "out" / "report")
    arguments.add_argument("--base", type=Path, help="an older summary.json: compare with it and measure nothing")
    chosen = arguments.parse_args()
    if chosen.base:
        return compare(chosen.base, chosen.output / "summary.json")
    command = "make report QUICK=1" if chosen.quick else "make report"
    bpy_extension.link()
    extension = bpy_extension.enable()
    index = extension("addon.core.report.make_report").write(
        chosen.output,
        quick=chosen.quick,
        samples=samples(extension),
        versions=versions(),
        command=command,
        progress=Printed(),
    )
    extension("addon.core.device").shutdown()
    print(index)
    return 0


def samples(extension) -> dict:
    """Name -> scene and settings of every sample, as the panel would render it."""
    import bpy

    found = {}
    for path in sorted((REPOSITORY / "sample_blends").glob("*.blend")):
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
        scene = bpy.context.scene
        found[path.stem] = extension("addon.capture").capture(scene, scene.view_layers[0])
    return found


def compare(base: Path, new: Path) -> int:
    """Print what is worse; 1 where something is."""
    try:
        summaries = [summary_in(path) for path in (base, new)]
    except (OSError, ValueError) as error:
        print(f"Cannot compare: {error}. Run make report first, and give its summary.json as BASE.", file=sys.stderr)
        return 2
    found = differences(*summaries)
    print("\n".join(found) or f"Nothing is worse than in {base}.")
    return 1 if found else 0


def summary_in(path: Path) -> Summary:
    """Of a summary.json, or of a whole report.json."""
    content = json.loads(path.read_text(encoding="utf-8"))
    return summarise(content) if "work_precision" in content else content


if __name__ == "__main__":
    sys.exit(main())
