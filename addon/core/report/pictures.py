"""What people see: which pixels of a scene's picture are visibly wrong, against the tolerance and the time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..scene import Scene
from ..settings import Settings
from ..trace import render
from .page import Page
from .work_precision import Progress

TOLERANCES = (0.3, 0.1, 0.05, 0.02)  # pixels; the panel's default is the third
TIGHT = 1e-3  # pixels, of the reference
VISIBLE = 8.0 / 255.0  # of a display's brightest value
QUICK_WIDTH, FULL_WIDTH = 240, 640  # pixels across
REPEATS = 3
COLUMNS = {
    "case": "picture",
    "tolerance_px": "tolerance, px",
    "wrong_percent": "pixels visibly wrong, %",
    "wrong_pixels": "of them",
    "time_min_ms": "least time of tracing, ms",
}
TEXT = (
    "Directions may be right and the picture wrong: where a ray meets an object counts as well. Every picture with "
    f"one ray a pixel, beside Dormand and Prince's method at {TIGHT:g} pixel, whose curves are as near to the rays; a "
    "pixel is visibly wrong where it differs by more than 8/255 of a display's brightest value. What stays is at "
    "edges: a pixel whose centre is as near to one as the ray's error shows the other side of it."
)


def wrong_pixels(scenes: Mapping[str, tuple[Scene, Settings]], quick: bool, progress: Progress) -> list[dict]:
    """A record for every scene and tolerance. scenes : by name; the settings are the user's, but for the tolerance and
    for how many rays a pixel has
    """
    rows = []
    for index, (name, (scene, settings)) in enumerate(scenes.items()):
        progress(index / len(scenes), "Pixels that are visibly wrong")
        scene = _narrower(scene, QUICK_WIDTH if quick else FULL_WIDTH)
        left, right, _, _ = scene.camera.window
        pixel = (right - left) / scene.camera.width
        if scene.camera.kind == "ORTHOGRAPHIC":  # as settings count it: seen from the model's centre
            away = np.linalg.norm(scene.camera.world_from_camera[:3, 3] - scene.placement.position)
            pixel /= max(float(away), pixel)
        single = replace(settings, samples=1, edge_samples=1, passes=("Combined",), filter_textures=False)
        tight = replace(_at(single, TIGHT * pixel), chord_tolerance=TIGHT * pixel)
        if tight.step_control == "embedded":
            tight = replace(tight, integrator="dormand_prince_54", segments=tight.max_steps)
        exact = displayed(render(scene, tight).passes["Combined"])
        for tolerance in TOLERANCES:
            chosen = _at(single, tolerance * pixel)
            frames = [render(scene, chosen) for _ in range(REPEATS)]
            wrong = np.abs(displayed(frames[0].passes["Combined"]) - exact).max(axis=-1) > VISIBLE
            rows.append(
                {
                    "model": scene.model.name,
                    "case": name,
                    "tolerance_px": tolerance,
                    "wrong_percent": 100.0 * float(wrong.mean()),
                    "wrong_pixels": int(wrong.sum()),
                    "time_min_ms": min(frame.statistics.milliseconds["trace"] for frame in frames),
                }
            )
    return rows


def write(page: Page, rows: list[dict]) -> None:
    page.section("Pixels that are visibly wrong")
    page.text(TEXT)
    page.table(rows, COLUMNS)


def displayed(radiance: np.ndarray) -> np.ndarray:
    """(…, 4), linear -> (…, 3), sRGB in [0, 1]: IEC 61966-2-1."""
    light = np.clip(radiance[..., :3], 0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)


def _at(settings: Settings, tolerance: float) -> Settings:
    return replace(settings, tolerance=float(np.clip(tolerance, 1e-9, np.pi)))


def _narrower(scene: Scene, width: int) -> Scene:
    """The scene with a picture of at most this width, whole."""
    camera = scene.camera
    if camera.width <= width:
        return replace(scene, camera=replace(camera, region=None))
    height = max(1, round(camera.height * width / camera.width))
    return replace(scene, camera=replace(camera, width=width, height=height, region=None))
