"""Where rays from far away pass the centre, in float64: what shaders/camera/moment_*.glsl begin with.

A ray's moment is x × d, d its unit direction in the chart: its length is the distance at which the straight ray passes
the centre, and d × (x × d) is the nearest point. From r = 1e6 one rounding of d in float32 moves that by 0.06. So the
moment is not computed from x and d, but from one line through the centre: the direction in which the observer sees it,
or for parallel rays the place on the window. A pixel's ray differs from it by an offset, which is as small as it looks.
The line's own moment would be 0, but for Kerr's chart, which is twisted by a M / r: it is a uniform, too.
"""

from __future__ import annotations

import numpy as np

from .models import Model
from .observers import chart_directions, directions_at_rest
from .scene import Camera, Placement

SIDEWAYS = 0.1  # cosine to the camera's axis: in no picture that shows the centre the line is farther from it


def far_camera(
    camera: Camera, placement: Placement, model: Model, observer: str, velocity: np.ndarray
) -> dict[str, tuple[float, ...]]:
    """Uniforms of moment_perspective.glsl and moment_orthographic.glsl.

    observer : a file of observers/;  velocity : (3,), where he moves, model space, in units of that of light
    """
    place = placement.points_to_model(camera.world_from_camera[:3, 3])
    axes = placement.directions_to_model(camera.world_from_camera[:3, :3].T).T  # columns: right, up, back
    left, _, bottom, _ = camera.window
    if observer != "moving":
        velocity = np.zeros(3)
    if camera.kind == "ORTHOGRAPHIC":
        seen = -axes[:, 2]
        aim = _at_rest(velocity, seen)
        depth = aim @ axes[:, 2]
        through = aim * (place @ axes[:, 2]) / min(depth, -SIDEWAYS * np.linalg.norm(aim))
        # Not by the transposed axes: Blender's are perpendicular to float32's digits only.
        offset = np.linalg.solve(axes, place - through) + np.array([left, bottom, 0.0]) / placement.scale
        place = through
    else:
        towards = -place if place.any() else -axes[:, 2]
        seen = axes.T @ _at_rest(-velocity, towards)  # the way back, from rest to him
        seen /= max(-seen[2], SIDEWAYS * np.linalg.norm(seen))
        offset = np.array([left, bottom, -1.0]) - seen
        aim = seen = axes @ seen
    moment = np.zeros(3)
    if np.linalg.norm(place) > model.flat_radius():
        size = np.linalg.norm(_at_rest(velocity, seen))
        moment = size * moments(model, observer, velocity, place[None], seen[None])[0]
    return {"u_aim": tuple(aim), "u_aim_offset": tuple(offset), "u_aim_moment": tuple(moment)}


def moments(
    model: Model, observer: str, velocity: np.ndarray, positions: np.ndarray, directions: np.ndarray
) -> np.ndarray:
    """float64, (n, 3), model lengths: x × d. positions, directions that the observer sees : float64, (n, 3)"""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return np.cross(positions, chart_directions(model, observer, tuple(velocity), positions, unit))


def _at_rest(velocity: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(3,): the direction for an observer at rest, times Doppler's factor: linear in the direction and its length."""
    size = np.linalg.norm(direction)
    frequency = (size - velocity @ direction) / np.sqrt(1.0 - velocity @ velocity)
    return frequency * directions_at_rest(velocity, direction[None] / size)[0]
