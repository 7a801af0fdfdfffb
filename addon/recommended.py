"""What a report recommends, in the panel's words, and how a scene is set to it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import bpy

from .core.report.methods import SEGMENTS, Method
from .presets import RAYS


class Recommendation(NamedTuple):
    """model : that it was measured for;  label : of the method
    goal, error : pixels, of 99 in 100 rays: what was asked for, and what was measured
    nanoseconds : to trace a ray;  settings : properties of Scene.nonlinear_rays by name
    """

    model: str
    label: str
    goal: float
    error: float
    nanoseconds: float
    settings: dict[str, object]


def of_row(row: dict, pixel: float) -> Recommendation:
    """row : of the list `recommended` of report.json;  pixel : radians, what the panel's tolerance is in units of"""
    method = Method(row["pipeline"], row["integrator"], row["step_control"])
    settings = {
        "pipeline": method.pipeline,
        "integrator": method.integrator,
        "step_control": method.step_control,
        "segments": SEGMENTS,
    }
    if method.step_control == "constant":
        settings |= {"use_custom_step": True, "step": row["value"]}
    else:
        settings["tolerance"] = row["value"] / pixel
    error, nanoseconds = row["rendered_px"], row["ns_per_ray"]
    return Recommendation(row["model"], method.label, row["goal_px"], error, nanoseconds, settings)


def of_report(index: Path, pixel: float) -> tuple[Recommendation, ...]:
    """index : path of the report's page;  pixel : radians."""
    content = json.loads(index.with_name("report.json").read_text(encoding="utf-8"))
    return tuple(of_row(row, pixel) for row in content["recommended"])


def apply(scene: bpy.types.Scene, recommendation: Recommendation) -> None:
    """Set how rays are integrated as it was measured; the rest of the scene stays as it is."""
    chosen = scene.nonlinear_rays
    for name in RAYS:
        chosen.property_unset(name)
    for name, value in recommendation.settings.items():
        setattr(chosen, name, value)
