"""Stiff and extreme cases: every row of physics.md, Section 3, with its stated expectation, on the GPU.

A case is a function of `quick` that gives its records (see record.py). What does not hold is a record, too.
"""

from __future__ import annotations

from collections.abc import Callable

from .fields import damping, head_on, stiff_flows, thin_fronts
from .holes import extremal_kerr, far_camera, near_camera, near_critical
from .inputs import degenerate_geometry, settings
from .numbers import half_floats, long_run, offset, scale
from .section import write

__all__ = ["CASES", "run", "write"]

Progress = Callable[[float, str], None]

CASES: dict[str, Callable[[bool], list[dict]]] = {
    "near-critical rays": near_critical,
    "near camera": near_camera,
    "far camera": far_camera,
    "near-extremal Kerr": extremal_kerr,
    "head-on singularity": head_on,
    "thin front": thin_fronts,
    "stiff Rössler and Lorenz": stiff_flows,
    "stiff damping": damping,
    "scale": scale,
    "offset": offset,
    "long run": long_run,
    "half floats": half_floats,
    "degenerate geometry": degenerate_geometry,
    "settings": settings,
}


def run(quick: bool, progress: Progress = lambda fraction, text: None) -> list[dict]:
    """All records. progress(fraction in [0, 1], sentence); what it raises ends the work."""
    records = []
    for index, (name, case) in enumerate(CASES.items()):
        progress(index / len(CASES), f"Stability: {name}")
        records += [{"case": name} | record for record in case(quick)]
    return records
