"""Text in pixels, with numpy alone: Blender's Python has nothing that draws letters into arrays.

The letters are DejaVu Sans, drawn once by tools/make_lettering.py.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

FILE = Path(__file__).with_suffix(".npz")
UNKNOWN = "?"  # stands for letters that are not there


@cache
def _glyphs() -> dict[str, np.ndarray]:
    with np.load(FILE) as stored:
        strip, edges = stored["strip"], stored["edges"]
        return {
            letter: strip[:, edges[index] : edges[index + 1]] for index, letter in enumerate(str(stored["letters"]))
        }


def written(text: str) -> np.ndarray:
    """One line of text -> how much of each pixel its letters cover, uint8, (height, width), row 0 at the top."""
    glyphs = _glyphs()
    height = glyphs[UNKNOWN].shape[0]
    parts = [glyphs.get(letter, glyphs[UNKNOWN]) for letter in text]
    return np.concatenate([np.zeros((height, 0), np.uint8), *parts], axis=1)
