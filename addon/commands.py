"""For scripts and farms: blender -b file.blend --command nonlinear_rays render --frames 1-10 --output DIR;
report --output DIR [--quick].
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from pathlib import Path

import bpy

from . import capture, image, report
from .core import trace
from .core.frame import Frame
from .core.status import MEANINGS, advice, patience
from .job import Clock, duration
from .terminal import INTERRUPTED, Interrupt, Progress

NAME = "nonlinear_rays"
MOST_FRAMES = 1_000_000

FRAME_RANGE = re.compile(r"(-?\d+)(?:-(-?\d+)(?:x(\d+))?)?")


class UsageError(ValueError):
    """The command line cannot be followed; one line says why."""


class _Parser(argparse.ArgumentParser):
    """Says what is wrong without leaving the process."""

    def error(self, message):
        raise UsageError(f"{message}. See: {self.prog} --help")

    def exit(self, status=0, message=None):
        raise _HelpShown


class _HelpShown(Exception):
    pass


def parse_frames(text: str) -> list[int]:
    """ "1", "1-10", "1-10x2", "1,3,7-9", "-5--1" -> frame numbers, in order, none twice. Raises UsageError."""
    frames: dict[int, None] = {}
    for part in text.split(","):
        match = FRAME_RANGE.fullmatch(part.strip())
        if match is None:
            raise UsageError(f"'{part.strip()}' is no frame or range. Write frames as 1 or 1-10 or 1-10x2 or 1,3,7-9.")
        first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
        if last < first or step < 1:
            raise UsageError(f"'{part.strip()}' holds no frame. Write the smaller frame first and a step of 1 or more.")
        if (last - first) // step >= MOST_FRAMES:
            raise UsageError(f"'{part.strip()}' holds more than {MOST_FRAMES} frames. Ask for fewer.")
        frames.update(dict.fromkeys(range(first, last + 1, step)))
    return list(frames)


def make_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog=f"blender -b FILE --command {NAME}", description="Render along curved light rays, or measure."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="render|report")
    render = commands.add_parser("render", help="write a PNG and a multi-layer EXR for each frame")
    render.add_argument(
        "--frames", default=None, help="1 or 1-10 or 1-10x2 or 1,3,7-9; default: the file's current frame"
    )
    render.add_argument(
        "--output", default=".", metavar="DIR", help="folder for the pictures; it is made where missing"
    )
    measure = commands.add_parser("report", help="measure error against time for the scene and its camera")
    measure.add_argument(
        "--output", default="nonlinear_rays_report", metavar="DIR", help="folder for index.html and its tables"
    )
    measure.add_argument("--quick", action="store_true", help="fewer rays, methods and repetitions")
    for command in (render, measure):
        command.add_argument(
            "--layer", default=None, help="name of the view layer; default: the first that is used for rendering"
        )
    return parser


def view_layer(scene: bpy.types.Scene, name: str | None) -> bpy.types.ViewLayer:
    """The view layer of that name; without one the first that is used for rendering. Raises UsageError."""
    if name is None:
        return next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    if name not in scene.view_layers:
        raise UsageError(f"There is no view layer '{name}'. Choose of: {', '.join(scene.view_layers.keys())}.")
    return scene.view_layers[name]


def write_frame(frame: Frame, stem: Path, scene: bpy.types.Scene, layer: str) -> list[Path]:
    """stem.png and stem.exr, both whole or not there at all. Raises OSError."""
    picture, passes = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.exr")
    unfinished = stem.with_name(f".{stem.name}.{os.getpid()}.part.png")
    try:
        image.save_png(frame, str(unfinished), scene)
        frame.save(passes, layer)
        os.replace(unfinished, picture)
    except OSError as error:
        raise OSError(f"Cannot write '{picture}': {error.strerror or error}") from error
    finally:
        unfinished.unlink(missing_ok=True)
    return [picture, passes]


def summary(frame: Frame, paths: list[Path], seconds: float) -> list[str]:
    """What is said of a finished frame."""
    statistics = frame.statistics
    stages = ", ".join(f"{stage} {milliseconds:.1f}" for stage, milliseconds in statistics.milliseconds.items())
    total = max(statistics.ray_count, 1)
    lines = [str(path) for path in paths]
    lines.append(
        f"  {frame.size[0]} × {frame.size[1]} pixels in {duration(seconds)} on {statistics.device or 'no device'}"
    )
    lines.append(f"  Milliseconds: {stages or 'none measured'}")
    lines += [
        f"  {count} rays ({100 * count / total:.1f} %) {MEANINGS[status]}" for status, count in statistics.rays.items()
    ]
    if statistics.worst_drift is not None:
        lines.append(f"  Worst drift of the invariants: {statistics.worst_drift:.2g}")
    if statistics.prolonged:
        lines.append(f"  {patience(*statistics.prolonged)}")
    if statistics.left_out:
        lines.append(f"  Left out: {'; '.join(statistics.left_out)}")
    lines += [f"  Warning: {text}" for text in [*frame.warnings, *advice(statistics.rays)]]
    return lines


def render_frames(scene: bpy.types.Scene, frames: list[int], folder: Path, layer: bpy.types.ViewLayer) -> None:
    """Render and write each frame. Raises trace.Cancelled on Ctrl-C, and what the export and the renderer raise."""
    name = Path(bpy.data.filepath).stem or "untitled"
    with Interrupt().listening() as interrupted:
        progress = Progress()
        for number, frame_number in enumerate(frames):
            clock = Clock()
            label = f"Frame {frame_number}"

            def show(fraction: float, _sentence: str, number=number, label=label) -> None:
                progress.show((number + fraction) / len(frames), label)

            scene.frame_set(frame_number)
            exported, settings = capture.capture(scene, layer)
            if interrupted():
                raise trace.Cancelled
            frame = trace.render(exported, settings, progress=show, cancelled=interrupted)
            if interrupted():
                raise trace.Cancelled
            progress.clear()
            paths = write_frame(frame, folder / f"{name}_{frame_number:04d}", scene, layer.name)
            print(*summary(frame, paths, clock.elapsed), sep="\n", flush=True)


def write_report(scene: bpy.types.Scene, folder: Path, layer: bpy.types.ViewLayer, quick: bool) -> None:
    """Measure and write. Raises trace.Cancelled on Ctrl-C, and what the export and the renderer raise."""
    with Interrupt().listening() as interrupted:
        progress, clock = Progress(), Clock()
        exported, settings = capture.capture(scene, layer)
        words = report.command_line(bpy.data.filepath, folder, quick)
        index = report.write(exported, settings, folder, quick, words, progress.show, interrupted)
        progress.clear()
        print(index, f"  Measured in {duration(clock.elapsed)}", sep="\n", flush=True)


def main(argv: list[str]) -> int:
    """The command line after `--command nonlinear_rays`; returns the exit status. A failure is one line on stderr."""
    try:
        arguments = make_parser().parse_args(argv)
        scene = bpy.context.scene
        layer = view_layer(scene, arguments.layer)
        if arguments.command == "report":
            write_report(scene, report.output_folder(arguments.output), layer, arguments.quick)
        else:
            frames = [scene.frame_current] if arguments.frames is None else parse_frames(arguments.frames)
            render_frames(scene, frames, report.output_folder(arguments.output), layer)
    except _HelpShown:
        return 0
    except (trace.Cancelled, KeyboardInterrupt):
        return _failed("Stopped; no half-written file is left.", INTERRUPTED)
    except UsageError as error:
        return _failed(error, 2)
    except Exception as error:
        return _failed(error, 1)
    return 0


def _failed(reason: object, status: int) -> int:
    """One line on stderr, whatever the message's own lines are."""
    clear = "\r\x1b[K" if sys.stderr.isatty() else ""
    words = " ".join(str(reason).split()) or type(reason).__name__
    print(f"{clear}nonlinear_rays: {words}", file=sys.stderr, flush=True)
    return status


_handle = None


def register():
    global _handle
    _handle = bpy.utils.register_cli_command(NAME, main)


def unregister():
    global _handle
    bpy.utils.unregister_cli_command(_handle)
    _handle = None
