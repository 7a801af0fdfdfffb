"""What leaving out saves: a scene with something that nobody sees or asks for, and the same scene without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from addon.core.models import MODELS
from addon.core.scene import Environment, Image, Light, Material, Scene, Spheres, Triangles
from addon.core.settings import PASSES, Settings

from . import scenes, settings
from .measure import KeptFrame, interleaved
from .mode import Mode
from .report import Part, Table

TOLERANCE = 1e-4  # radians
RINGS = 32  # of the torus: 4096 triangles
SKY_SIDE = 256  # texels
PICTURE_SIDE = 512


@dataclass(frozen=True)
class Pair:
    """The same picture twice, but for what is asked for."""

    with_it: tuple[Scene, Settings]
    without: tuple[Scene, Settings]


def pairs(size: tuple[int, int]) -> dict[str, Pair]:
    """Name of what is left out -> the two. What is there hides in the hole, or changes nothing."""
    chosen = settings.fused(TOLERANCE, TOLERANCE, escape_radius=None)
    torus = scenes.torus_scene(scenes.HOLE, size, RINGS)
    spheres = scenes.sphere_scene(scenes.HOLE, size, 10)
    sky = scenes.sky_scene(scenes.HOLE, size)
    straight = scenes.sky_scene(scenes.STRAIGHT, size)
    textured = tuple(replace(one, emission_image=0) for one in torus.materials)
    lit = tuple(Material(one.name, (0.5, 0.5, 0.5), one.emission) for one in torus.materials)
    grey = replace(torus, materials=lit)
    faces = np.full((6, SKY_SIDE, SKY_SIDE, 3), 0.3, np.float32)
    throat = scenes.sky_scene(MODELS["wormhole"](throat_radius=4.0), size)

    def both(scene: Scene, bare: Scene, with_settings: Settings = chosen, settings_: Settings = chosen) -> Pair:
        return Pair((scene, with_settings), (bare, settings_))

    return {
        "spheres": both(replace(torus, spheres=unseen_spheres()), torus),
        "triangles": both(replace(spheres, triangles=unseen_triangles()), spheres),
        "all objects": both(replace(sky, spheres=unseen_spheres()), sky),
        "image textures": both(replace(torus, materials=textured, images=(white_image(),)), torus),
        "lights": both(replace(torus, materials=lit, lights=(Light("SUN", (0.0, 0.0, 0.0)),)), grey),
        "environment texture": both(replace(sky, environment=Environment((0.3, 0.3, 0.3), faces)), sky),
        "second sky": both(replace(throat, far_environment=Environment((0.3, 0.3, 0.3), faces)), throat),
        "integration": both(replace(sky, model=MODELS["schwarzschild"](mass=1e-6)), straight),
        "passes": both(torus, torus, replace(chosen, passes=PASSES), chosen),
        "surface passes": both(torus, torus, replace(chosen, passes=("Combined", "Normal")), chosen),
        "tally of steps": both(torus, torus, replace(chosen, passes=("Combined", "Steps")), chosen),
        "frequency shift": both(torus, torus, replace(chosen, passes=("Combined", "Frequency Shift")), chosen),
        "observer": both(sky, sky, replace(chosen, observer="static"), chosen),
    }


def unseen_spheres() -> Spheres:
    """One that the horizon hides."""
    return replace(scenes.spheres(1), centres=np.zeros((1, 3)), radii=np.array([0.5]))


def unseen_triangles() -> Triangles:
    """One that the horizon hides."""
    corners = 0.5 * np.eye(3)[None]
    normals = np.full((1, 3, 3), 3.0**-0.5, np.float32)
    zero = np.zeros(1, np.int32)
    return Triangles(corners, normals, np.zeros((1, 3, 2), np.float32), zero, zero)


def white_image() -> Image:
    return Image("White", np.ones((PICTURE_SIDE, PICTURE_SIDE, 4), np.float32))


def measure(mode: Mode) -> Part:
    rows, figures = [], {}
    for name, pair in pairs(mode.table_size).items():
        frames = {"with": KeptFrame(*pair.with_it), "without": KeptFrame(*pair.without)}
        timings = interleaved(frames, mode.repeats)
        times = [timings[label].best("trace", "read") for label in frames]
        sizes = [frame.bytes / 1024 for frame in frames.values()]
        rows.append((name, *times, f"{100 * (1 - times[1] / times[0]):.0f} %", *sizes, sizes[0] - sizes[1]))
        figures[name] = {
            "milliseconds": {label: timings[label].as_json() for label in frames},
            "KiB": dict(zip(frames, sizes, strict=True)),
        }
    columns, lines = mode.table_size
    title = f"Left out: milliseconds of trace and read-back at {columns} x {lines}, KiB of textures"
    head = ("", "with", "without", "saved", "KiB with", "without", "saved")
    note = "What is there hides in the hole, or changes nothing."
    return Part([Table(title, head, rows, note)], figures)
