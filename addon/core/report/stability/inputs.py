"""Geometry and settings that nobody should give."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ...frame import Frame
from ...models import MODELS
from ...scene import Camera, Scene, Spheres, Triangles
from ...settings import Settings, SettingsError
from ...status import Status
from ...trace import render
from ..cases import look_at_centre
from .record import counted, record

PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps", "Error")
CORNERS = np.array([[-2.0, 3.0, -2.0], [2.0, 3.0, -2.0], [0.0, 3.0, 2.0]])
NAN, HUGE = float("nan"), 1e38


def degenerate_geometry(quick: bool) -> list[dict]:
    """Each thing alone in a picture of 16 x 12 pixels, in both pipelines. What cannot be shown is skipped with a
    warning that counts it.
    """
    things = {
        "a triangle without area": (_soup([[0, 0, 0], [1, 0, 1], [2, 0, 2]], [[1, 1, 1]] * 3), None, False),
        "a NaN triangle": (_soup([[NAN, 0, 0], [1, 0, 0], [0, 0, 1]]), None, True),
        "an infinite triangle": (_soup([[math.inf, 0, 0], [1, 0, 0], [0, 0, 1]]), None, True),
        "a triangle of 1e38": (_soup(HUGE * CORNERS), None, True),
        "a triangle of 1e6": (_soup(1e6 * CORNERS), None, False),
        "coincident triangles": (_soup(CORNERS, CORNERS, CORNERS), None, False),
        "a sphere of radius zero": (None, _ball(0.0), True),
        "a negative sphere": (None, _ball(-1.0), True),
        "a NaN sphere": (None, _ball(NAN), True),
        "a sphere around everything": (None, _ball(500.0), False),
    }
    records = []
    for name, (triangles, spheres, skipped) in things.items():
        scene = _scene(triangles or Triangles.empty(), spheres or Spheres.empty())
        for pipeline in ("fused", "paper"):
            settings = Settings(
                pipeline=pipeline,
                integrator="dormand_prince_54",
                step_control="embedded",
                tolerance=1e-3,
                passes=PASSES,
            )
            frame = render(scene, settings)
            warned = any(any(letter.isdigit() for letter in warning) for warning in frame.warnings)
            records.append(
                record(
                    scene.model.name,
                    f"{name}, {pipeline}",
                    "skipped with a warning that counts it" if skipped else "finite pixels, named ends",
                    "values that are not finite",
                    _not_finite(frame),
                    0,
                    also=_named(frame) and (warned or not skipped),
                    statuses=counted(frame.passes["Status"]),
                )
            )
    return records


def settings(quick: bool) -> list[dict]:
    """A message that names the setting and its range, or a right picture."""
    records = []
    for tolerance in (0.0, -1.0, NAN, math.inf):
        try:
            Settings(tolerance=tolerance)
            message = ""
        except SettingsError as error:
            message = str(error)
        clear = "'tolerance'" in message and repr(tolerance) in message and "[1e-09, 3.14159]" in message
        records.append(
            record(
                "any",
                f"tolerance {tolerance:g}",
                "an error that names setting, value and range",
                "messages that do not",
                int(not clear),
                0,
            )
        )
    hole = _scene(Triangles.empty(), _ball(3.0))
    one_step = {"max_steps": 1, "segments": 1}
    sizes = {"1 step": (16, 12, one_step), "1 x 1 pixel": (1, 1, {}), "16384 x 1 pixels": (16384, 1, {})}
    for name, (columns, rows, options) in sizes.items():
        scene = replace(hole, camera=replace(hole.camera, width=columns, height=rows))
        for pipeline in ("fused", "paper"):
            chosen = Settings(
                pipeline=pipeline,
                integrator="dormand_prince_54",
                step_control="embedded",
                tolerance=1e-3,
                passes=PASSES,
                **options,
            )
            frame = render(scene, chosen)
            counts = frame.statistics.rays
            right = sum(counts.values()) == columns * rows and _named(frame)
            if options:
                right = right and counts.get(Status.STEP_LIMIT, 0) > 0
            else:
                right = right and counts.get(Status.HIT, 0) > 0  # the middle of the picture is the ball
            records.append(
                record(
                    hole.model.name,
                    f"{name}, {pipeline}",
                    "counted at the step limit" if options else "a picture of the ball",
                    "values that are not finite",
                    _not_finite(frame),
                    0,
                    also=right,
                    statuses=counted(frame.passes["Status"]),
                )
            )
    return records


def _not_finite(frame: Frame) -> int:
    return sum(int(np.sum(~np.isfinite(pixels))) for pixels in frame.passes.values())


def _named(frame: Frame) -> bool:
    return bool(np.isin(frame.passes["Status"], [float(each) for each in Status if each is not Status.RUNNING]).all())


def _scene(triangles: Triangles, spheres: Spheres) -> Scene:
    camera = Camera(look_at_centre((0.0, -8.0, 1.0)), (-0.5, 0.5, -0.375, 0.375), 16, 12)
    return Scene(camera, MODELS["schwarzschild"](mass=0.3), triangles=triangles, spheres=spheres)


def _soup(*corners) -> Triangles:
    positions = np.array(corners, float).reshape(-1, 3, 3)
    n = len(positions)
    normals = np.tile(np.array([0.0, -1.0, 0.0], np.float32), (n, 3, 1))
    uvs = np.zeros((n, 3, 2), np.float32)
    return Triangles(positions, normals, uvs, np.zeros(n, np.int32), np.ones(n, np.int32))


def _ball(radius: float) -> Spheres:
    index = np.zeros(1, np.int32)
    return Spheres(np.zeros((1, 3)), np.array([radius]), np.eye(3)[None], index, index + 1)
