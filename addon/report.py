"""The report of a scene, for the command line and the panel."""

from __future__ import annotations

import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path

import bpy

from .core import trace
from .core.report import make_report
from .core.scene import Scene
from .core.settings import Settings

MANIFEST = Path(__file__).parents[1] / "blender_manifest.toml"


def output_folder(path: str) -> Path:
    """The folder, made where it is missing. Raises OSError with a sentence where nothing can be written to it."""
    folder = Path(path).expanduser().absolute()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"Cannot write to '{folder}': {error.strerror}. Choose another folder.") from error
    return folder


def command_line(file: str, folder: Path, quick: bool) -> str:
    """The command line that makes the report again. file : path of the .blend, "" where it is not saved"""
    words = ["blender", "-b", file or "FILE", "--command", "nonlinear_rays", "report", "--output", str(folder)]
    return " ".join([f'"{word}"' if " " in word else word for word in words] + ["--quick"] * quick)


def write(
    scene: Scene,
    settings: Settings,
    folder: Path,
    quick: bool,
    command: str,
    progress: Callable[[float, str], None],
    cancelled: Callable[[], bool],
) -> Path:
    """The path of index.html. Callable from any thread. Raises trace.Cancelled; then nothing was written."""

    def tell(fraction: float, text: str) -> None:
        if cancelled():
            raise trace.Cancelled
        progress(fraction, text)

    version = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]
    return make_report.write(
        folder,
        quick=quick,
        scene=scene,
        settings=settings,
        versions={"Blender": bpy.app.version_string, "Nonlinear Rays": version},
        command=command,
        progress=tell,
    )
