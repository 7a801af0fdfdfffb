"""Black holes at the edge: near-critical rays, near and far cameras, the fastest rotation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...models import MODELS, Model
from ...reference import angles, true_ends
from ...scene import Camera, Scene
from ...settings import Settings
from ...status import Status
from ...trace import render, trace_rays
from ..cases import look_at_centre
from ..errors import CRITICAL
from .kerr_outline import outline
from .ladder import edge
from .record import EPSILON, EXACT, counted, record, worst

UNKNOWN = 1.0  # radians: a bound as large as this says nothing


def near_critical(quick: bool) -> list[dict]:
    """Rays from 30 M with an impact parameter b at a given distance from critical.

    The deflection is -ln(b/b_c - 1) and a constant (Darwin 1959), so that the condition number, its derivative by
    ln b, is 1 / |b/b_c - 1|. What float32 does to b alone decides the end of a ray within 100 roundings of critical.
    """
    distance, around = 30.0, 4 if quick else 16
    model = MODELS["schwarzschild"](mass=1.0)
    exact = replace(EXACT, tolerance=1e-7)
    phase = 0.1 + 2.0 * np.pi * np.arange(around) / around
    values = [sign * 10.0**power for sign in (1, -1) for power in range(-2, -8, -1)]
    b = CRITICAL * (1.0 + np.repeat(values, around))
    sine = b / np.sqrt(distance**2 + 2.0 * b**2 / distance)  # h / r, with b = h / E and E² = 1 - 2 h² / r³
    phase = np.tile(phase, len(values))
    directions = np.stack([np.sqrt(1.0 - sine**2), sine * np.cos(phase), sine * np.sin(phase)], axis=1)
    directions = directions.astype(np.float32).astype(np.float64)
    positions = np.tile([-distance, 0.0, 0.0], (len(b), 1))
    ends = trace_rays(model, positions, directions, exact)
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    truth = true_ends(model, positions, unit)
    records = []
    for index, value in enumerate(values):
        rows = slice(index * around, (index + 1) * around)
        elsewhere = int(np.sum(ends.status[rows] != truth.status[rows]))
        bound = 100.0 * EPSILON / abs(value)
        both = (ends.status[rows] == Status.ESCAPED) & (truth.status[rows] == Status.ESCAPED)
        both &= truth.uncertainty[rows] <= 0.01 * bound
        error = angles(ends.direction[rows][both].astype(float), truth.direction[rows][both])
        more = {"statuses": counted(ends.status[rows])}
        named = bool((ends.status[rows] > Status.RUNNING).all())
        if bound >= UNKNOWN:
            expectation = "a named status; float32 cannot resolve the way: counted"
            measure = f"of {around} rays, those that end elsewhere"
            records.append(record(model.name, value, expectation, measure, elsewhere, holds=named, **more))
        elif value > 0:
            expectation = "escapes, error <= 100 x rounding x condition number"
            also = named and elsewhere == 0
            records.append(
                record(model.name, value, expectation, "largest error, rad", worst(error), bound, also=also, **more)
            )
        else:
            measure = "rays that are not absorbed"
            records.append(record(model.name, value, "absorbed", measure, elsewhere, 0, also=named, **more))
    return records


def near_camera(quick: bool) -> list[dict]:
    """The shadow of a camera at rest close to the hole, in four directions of the picture."""
    model = MODELS["schwarzschild"](mass=1.0)
    settings = replace(EXACT, observer="static")
    back = np.array([0.6, -0.48, 0.64])
    right = np.cross([0.0, 0.0, 1.0], back) / np.hypot(back[0], back[1])
    up = np.cross(back, right)
    across = np.array([right, up, -right, -up])
    records = []
    for r in (2.001, 2.1, 2.5, 3.0, 3.001):
        found, status = _shadows_edge(
            model,
            settings,
            r * back,
            lambda angle: -np.cos(angle) * back + np.sin(angle) * across[:, None],
            np.full(4, np.pi),
        )
        sine = np.sqrt(27.0 * (1.0 - 2.0 / r)) / r
        synge = np.arcsin(min(sine, 1.0)) if r >= 3.0 else np.pi - np.arcsin(sine)
        error = float(np.abs(found - synge).max())
        records.append(
            record(
                model.name,
                r,
                "shadow's angle within 1e-3 rad of Synge's",
                "error, rad",
                error,
                1e-3,
                also=bool((status > Status.RUNNING).all()),
                statuses=counted(status),
            )
        )
    return records


def far_camera(quick: bool) -> list[dict]:
    """Pictures of 256 x 256 pixels through a lens that makes the shadow's radius 100 pixels; measured by its area."""
    side, radius = 256, 100.0
    model = MODELS["schwarzschild"](mass=1.0)
    settings = replace(EXACT, passes=("Status",), observer="static")
    places = {"on an axis": np.array([1.0, 0.0, 0.0]), "anywhere": np.array([0.6, -0.48, 0.64])}
    records = []
    for where, place in places.items():
        for r in (1e3, 1e4, 1e6):
            sine = np.sqrt(27.0 * (1.0 - 2.0 / r)) / r
            half = sine / np.sqrt(1.0 - sine**2) * 0.5 * side / radius
            camera = Camera(look_at_centre(tuple(r * place)), (-half, half, -half, half), side, side)
            status = render(Scene(camera, model), settings).passes["Status"]
            found = np.sqrt(np.sum(status == Status.ABSORBED) / np.pi)
            records.append(
                record(
                    model.name,
                    f"{r:,.0f} M, {where}",
                    "shadow's radius within 0.1 pixel of Synge's",
                    "error, pixels",
                    abs(found - radius),
                    0.1,
                    also=bool((status > Status.RUNNING).all()),
                    statuses=counted(status),
                )
            )
    return records


def extremal_kerr(quick: bool) -> list[dict]:
    """The outline, seen at rest from 1e4 M on the axis and in the equator, in pixels of 1024 across 16 M.

    Bardeen's curve is for an observer at infinity; from 1e4 M it is larger by about 1e-4 of 340 pixels.
    """
    distance, pixel = 1e4, 16.0 / 1024
    count = 8 if quick else 32
    phase = 2.0 * np.pi * np.arange(count) / count + 0.01
    settings = replace(EXACT, observer="static", escape_radius=1.1 * distance)
    records = []
    for spin in (0.998, 0.9999, 1.0):
        model = MODELS["kerr"](spin=spin)
        for where, inclination in (("axis", 0.0), ("equator", 0.5 * np.pi)):
            place = np.array([np.sin(inclination), 0.0, np.cos(inclination)])
            up = np.array([-np.cos(inclination), 0.0, np.sin(inclination)])
            across = np.cos(phase)[:, None] * np.array([0.0, 1.0, 0.0]) + np.sin(phase)[:, None] * up
            found, status = _shadows_edge(
                model,
                settings,
                distance * place,
                lambda radius, place=place, across=across: -place + radius / distance * across[:, None],
                np.full(count, 8.0),
            )
            error = np.abs(found - outline(spin, inclination, phase)) / pixel
            records.append(
                record(
                    model.name,
                    f"a = {spin:g} M, camera on the {where}" if where == "axis" else f"a = {spin:g} M, in the {where}",
                    "outline within 0.5 pixel of Bardeen's",
                    "largest error, pixels",
                    error.max(),
                    0.5,
                    also=bool((status > Status.RUNNING).all()),
                    statuses=counted(status),
                )
            )
    return records


def _shadows_edge(
    model: Model,
    settings: Settings,
    position: np.ndarray,
    direction: Callable[[np.ndarray], np.ndarray],
    beyond: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """How far from the middle of the shadow rays begin to escape, (n,), and the status of all rays tried.

    position : (3,), of the camera;  beyond : (n,), where rays escape
    direction : distances from the middle, (n, rungs, 1) -> directions, (n, rungs, 3)
    """
    statuses = []

    def escapes(ladder: np.ndarray) -> np.ndarray:
        directions = direction(ladder[..., None])
        positions = np.broadcast_to(position, directions.shape).reshape(-1, 3)
        status = trace_rays(model, positions, directions.reshape(-1, 3), settings).status
        statuses.append(status)
        return (status == Status.ESCAPED).reshape(ladder.shape)

    found = edge(escapes, np.zeros(len(beyond)), beyond)
    return found, np.concatenate(statuses)
