"""The shadow's radius from its area, against physics.md's formulas: within half a pixel at 1024 x 1024."""

import numpy as np
import pytest

from addon.core.scene import Camera, Scene
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders import scenes, truth

PIXELS = 1024
RADIUS = 256.0  # pixels that the formula's shadow takes
CASES = [(10.0, "chart"), (10.0, "static"), (30.0, "chart"), (30.0, "static")]


def shadow_scene(r, observer, region, pixels=PIXELS):
    """A camera at r that looks at the hole, so that the shadow's radius is a quarter of the picture's width."""
    half = np.tan(truth.shadow_angle(r, observer)) * (pixels / 2) / (RADIUS * pixels / PIXELS)
    matrix = scenes.look_at((r * 0.6, -r * 0.48, r * 0.64), (0, 0, 0))
    return Scene(Camera(matrix, (-half, half, -half, half), pixels, pixels, region=region), scenes.HOLE)


def measured_radius(status, parts):
    """Pixels, from the area: R = sqrt(N / pi)."""
    return float(np.sqrt(parts * np.sum(status == Status.ABSORBED) / np.pi))


@pytest.mark.parametrize(("r", "observer"), CASES)
def test_shadow_of_constant_steps(r, observer):
    """One quadrant is rendered; the others are alike.

    Euler's steps of h make the shadow too small by 0.46 h / M of its radius (measured at h from 0.04 to 0.005 M; it is
    of first order): 0.24 pixels of 256 at h = 0.002 M. The area of 51000 pixels has an error below 0.02 pixels.
    """
    h = 0.002
    settings = scenes.papers(
        step_control="constant",
        observer=observer,
        step=h,
        steps_per_segment=200,
        segments=int(6 * r / h / 200),
        max_steps=10_000_000,
        escape_radius=1.001 * r,
        passes=("Status",),
    )
    middle = PIXELS // 2
    frame = render(shadow_scene(r, observer, (middle, middle, PIXELS, PIXELS)), settings)
    status = frame.passes["Status"]
    assert set(np.unique(status)) == {Status.ABSORBED, Status.ESCAPED}
    assert not (status[-1] == Status.ABSORBED).any() and not (status[:, -1] == Status.ABSORBED).any()
    radius = measured_radius(status, 4)
    print(f"\nr = {r} M, {observer}: shadow {radius:.3f} px, formula {RADIUS} px, difference {radius - RADIUS:+.3f} px")
    assert abs(radius - RADIUS) < 0.5


@pytest.mark.parametrize(("r", "observer"), CASES)
def test_shadow_of_step_doubling(r, observer):
    """Adaptive steps, 256 x 256, whole. The tolerance is what a segment may be wrong by: some 30 of them add up, and
    the photon sphere magnifies what happens before it tenfold, so that a 300th of a pixel keeps the edge within half.
    """
    pixels = 256
    scene = shadow_scene(r, observer, None, pixels)
    pixel_angle = 2 * scene.camera.window[1] / pixels
    settings = scenes.papers(observer=observer, tolerance=pixel_angle / 300, segments=20_000, passes=("Status",))
    status = render(scene, settings).passes["Status"]
    radius, expected = measured_radius(status, 1), RADIUS * pixels / PIXELS
    print(f"\nr = {r} M, {observer}, doubling: shadow {radius:.3f} px, formula {expected} px")
    assert abs(radius - expected) < 0.5
