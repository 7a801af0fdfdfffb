"""The picture that comes back: passes by name, and what it took to make them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .settings import PASS_CHANNELS
from .status import Status


@dataclass
class Statistics:
    """rays : how many ended in which status;  milliseconds : by stage, in the order they ran
    texture_bytes : what was uploaded for the scene;  left_out : what this scene did not need, a phrase each
    steps : the largest and the mean number of steps a ray took, where the Steps pass was asked for
    worst_drift : of the invariants, of the rays that hit or escaped, where the Drift pass was asked for
    prolonged : how many rays were let beyond the step limit, and how many steps at most, where there are such rays
    """

    rays: dict[Status, int] = field(default_factory=dict)
    milliseconds: dict[str, float] = field(default_factory=dict)
    texture_bytes: int = 0
    left_out: tuple[str, ...] = ()
    steps: tuple[int, float] | None = None
    worst_drift: float | None = None
    prolonged: tuple[int, int] | None = None
    device: str = ""

    @property
    def ray_count(self) -> int:
        return sum(self.rays.values())


@dataclass(eq=False)
class Frame:
    """passes : name -> float32, (height, width, channels), scene-linear; row 0 is the bottom, as in Blender."""

    passes: dict[str, np.ndarray]
    statistics: Statistics = field(default_factory=Statistics)
    warnings: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Columns, rows."""
        height, width, _ = next(iter(self.passes.values())).shape
        return width, height

    def save(self, path: str | os.PathLike, layer: str = "ViewLayer") -> None:
        """Write all passes as one multi-layer OpenEXR file, named as Blender names them (layer.pass.channel).

        The file appears whole or not at all. This is the only place where rows are flipped: OpenEXR's row 0 is the top.
        Raises OSError where the file cannot be written.
        """
        import OpenEXR

        channels = {}
        for name, pixels in self.passes.items():
            for index, letter in enumerate(PASS_CHANNELS[name]):
                channels[f"{layer}.{name}.{letter}"] = np.ascontiguousarray(pixels[::-1, :, index], dtype=np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        path = Path(path)
        unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            OpenEXR.File(header, channels).write(str(unfinished))
            os.replace(unfinished, path)
        except RuntimeError as error:
            raise OSError(f"Cannot write '{path}': {error}. Choose another folder.") from error
        finally:
            unfinished.unlink(missing_ok=True)
