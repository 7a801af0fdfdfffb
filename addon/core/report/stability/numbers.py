"""What float32 does to large and small numbers, to long runs, and what half as many bits would do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...frame import Frame
from ...models import MODELS
from ...reference import angles, true_ends
from ...scene import Camera, Placement, Scene, Spheres
from ...settings import Settings
from ...status import Status
from ...trace import render, trace_rays
from ..cases import camera_rays, look_at_centre
from ..errors import near_critical
from .record import EXACT, counted, record

SIDE = 96
HALF = 0.5  # of the picture's width, at distance 1
PIXEL = 2.0 * HALF / SIDE
LINES = {
    "euler": 1e-3,
    "verlet": 1e-2,
    "runge_kutta_4": 5e-2,
    "dormand_prince_54": 5e-2,
    "nystrom_64": 5e-2,
}  # constant steps of τ


def scale(quick: bool) -> list[dict]:
    """A hole with balls around it, all lengths times a factor."""
    return [
        _same_picture(f"scale {factor:g}", _scene(factor, np.zeros(3)), "the same picture within 0.1 pixel")
        for factor in (1e-4, 1e4)
    ]


def offset(quick: bool) -> list[dict]:
    """The same, 1e5 lengths from the origin."""
    away = 1e5 * np.array([0.6, -0.48, 0.64])
    return [_same_picture("1e5 lengths away", _scene(1.0, away), "the same picture within 0.1 pixel")]


def long_run(quick: bool) -> list[dict]:
    """Steps on a closed orbit: an ellipse in Coulomb's potential, of half axes 3 and √5. Verlet's drift is
    bounded; Runge, Kutta and Nyström's methods drift with every turn, until roundings are larger.
    """
    model = MODELS["radial_potential"](xi="coulomb", k=1.2)
    records = []
    for integrator, step in LINES.items():
        for steps in (1_000, 100_000) if quick else (100, 300, 1_000, 3_000, 10_000, 30_000, 100_000):
            settings = Settings(
                pipeline="fused",
                integrator=integrator,
                step_control="constant",
                step=step,
                max_steps=steps,
                segments=1_000_000,
            )
            ends = trace_rays(model, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], settings)
            holds = bool(ends.status[0] == Status.STEP_LIMIT and ends.steps[0] == steps)
            records.append(
                record(
                    model.name,
                    steps,
                    "goes on to the step limit; drift reported",
                    "drift of energy and angular momentum",
                    ends.invariant_drift[0],
                    holds=holds,
                    statuses=counted(ends.status),
                    integrator=integrator,
                    step=step,
                )
            )
    return records


def half_floats(quick: bool) -> list[dict]:
    """The paper's finding: rays in textures of 16 bit are too coarse. Step doubling, Euler and Dormand and Prince."""
    model = MODELS["schwarzschild"](mass=1.0)
    scene = _scene(1.0, np.zeros(3))
    at = (np.arange(12) + 0.5) / 12
    x, y = (part.ravel() for part in np.meshgrid(at, at))
    positions, directions = camera_rays(scene, x, y)
    truth = true_ends(model, positions, directions)
    calm = ~near_critical(model, positions, directions)
    records = []
    for bits in (32, 16):
        settings = Settings(
            pipeline="paper",
            integrator="dormand_prince_54",
            step_control="doubling",
            tolerance=1e-4,
            steps_per_segment=1,
            segments=2000,
            ray_bits=bits,
        )
        ends = trace_rays(model, positions, directions, settings)
        both = (ends.status == Status.ESCAPED) & (truth.status == Status.ESCAPED) & truth.converged & calm
        error = angles(ends.direction[both].astype(float), truth.direction[both]) / PIXEL
        median = float(np.median(error)) if both.any() else float("inf")
        wanted = median < 0.1 if bits == 32 else median > 0.1
        expectation = "below 0.1 pixel" if bits == 32 else "the paper's finding: worse than 0.1 pixel"
        records.append(
            record(
                model.name,
                f"{bits} bit",
                expectation,
                f"median error, pixels of {SIDE}",
                median,
                holds=bool(wanted and (ends.status > Status.RUNNING).all()),
                statuses=counted(ends.status),
            )
        )
    return records


def _scene(factor: float, away: np.ndarray) -> Scene:
    """factor : of all lengths;  away : (3,), where the hole is, lengths"""
    place = factor * away
    camera = look_at_centre((3.0, -18.0, 4.0))
    camera[:3, 3] = factor * camera[:3, 3] + place
    centres = factor * np.array([[0.0, 6.0, 3.0], [6.0, -3.0, 2.0], [-5.0, -4.0, -2.0], [0.0, 9.0, -5.0]]) + place
    n = len(centres)
    balls = Spheres(
        centres,
        np.full(n, 1.3 * factor),
        np.tile(np.eye(3), (n, 1, 1)),
        np.zeros(n, np.int32),
        np.arange(1, n + 1, dtype=np.int32),
    )
    placement = Placement(position=place, scale=factor)
    view = Camera(camera, (-HALF, HALF, -HALF, HALF), SIDE, SIDE)
    return Scene(view, MODELS["schwarzschild"](mass=1.0), placement, spheres=balls)


def _pictured(scene: Scene) -> Frame:
    return render(scene, replace(EXACT, passes=("Direction", "Object Index", "Status", "Position")))


def _same_picture(value: str, scene: Scene, expectation: str) -> dict:
    """Against the scene of scale 1 at the origin, in pixels: how far what a pixel shows has moved, for the sky as the
    angle between directions, for a ball as the way on it, seen from the camera. Where pixels show another object, an
    outline has moved; one that moves by 0.1 pixel changes a tenth of the pixels along it. Rays within 1e-3 of critical
    magnify roundings a thousandfold and are left out.
    """
    here, there = _scene(1.0, np.zeros(3)), scene
    base, other = _pictured(here).passes, _pictured(there).passes
    at = (np.arange(SIDE) + 0.5) / SIDE
    x, y = (part.ravel() for part in np.meshgrid(at, at))
    calm = ~near_critical(here.model, *camera_rays(here, x, y)).reshape(SIDE, SIDE)
    ends = [each["Status"][..., 0] + 10.0 * each["Object Index"][..., 0] for each in (base, other)]
    same = (ends[0] == ends[1]) & calm
    sky, ball = same & (base["Status"][..., 0] == Status.ESCAPED), same & (base["Status"][..., 0] == Status.HIT)
    moved = angles(base["Direction"][sky].astype(float), other["Direction"][sky].astype(float)) / PIXEL
    placement = there.placement
    on_it = placement.points_to_model(other["Position"][ball]) - base["Position"][ball]
    camera = here.camera.world_from_camera[:3, 3]
    # Position is float32 in world space: far from the origin it has only so many digits, whatever was traced.
    rounding = np.abs(other["Position"][ball]).max(initial=0.0) * 2.0**-23 / placement.scale
    ways = np.maximum(np.linalg.norm(on_it, axis=1) - rounding, 0.0)
    on_ball = ways / np.linalg.norm(base["Position"][ball] - camera, axis=1) / PIXEL
    outlines = _outline(ends[0])
    changed = int(np.sum((ends[0] != ends[1]) & calm))
    return record(
        here.model.name,
        value,
        expectation,
        "largest shift, pixels",
        max(moved.max(), on_ball.max()),
        0.1,
        also=changed <= 0.1 * outlines,
        statuses=counted(other["Status"]),
        pixels_changed=changed,
        pixels_on_outlines=outlines,
    )


def _outline(ends: np.ndarray) -> int:
    """Pixels that have a neighbour, right or above, that ends elsewhere."""
    edges = np.zeros(ends.shape, bool)
    edges[:, :-1] |= ends[:, :-1] != ends[:, 1:]
    edges[:-1] |= ends[:-1] != ends[1:]
    return int(edges.sum())
