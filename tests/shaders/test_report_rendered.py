"""Errors at a scene's objects: what is wrong on purpose is found, and by how much."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.report.cases import of_scene
from addon.core.report.rendered import Checked
from addon.core.scene import Scene
from addon.core.settings import Settings
from addon.core.status import Status
from tests.shaders.scenes import HOLE, STRAIGHT, camera, quad, spheres

FINE = Settings(tolerance=1e-5, segments=20_000)
SIDE = 16


def checked(model, **objects):
    scene = Scene(camera(64, 64, (0.0, -20.0, 0.0), half=0.3), model, **objects)
    return Checked(scene, of_scene(scene), SIDE, lambda fraction, text: None)


def wall(y):
    """Across the whole picture, which is 12 lengths wide at y = 0."""
    return quad((0.0, y, 0.0), (20.0, 0.0, 0.0), (0.0, 0.0, 20.0))


def test_a_wall_that_stands_nearer_is_seen_along_the_same_rays():
    """By a tenth of a length: the hit points are as far apart, and a little more at the picture's corners, where rays
    are sqrt(1 + 2 * 0.3^2) = 1.09 times as long; but on the same rays, so that the picture is the same.
    """
    found = checked(STRAIGHT, triangles=wall(0.0))
    assert found.hit.all() and found.known.all()
    right = found.figures(FINE)
    assert right["hit_distance_p99"] < 1e-4 and right["elsewhere_percent"] == 0.0
    found.scene = replace(found.scene, triangles=replace(found.scene.triangles, positions=wall(-0.1).positions))
    wrong = found.figures(FINE)
    assert wrong["hit_distance_p99"] == pytest.approx(0.1 * np.sqrt(1.18), rel=0.02)
    assert wrong["objects_px"] < 1e-3 and wrong["elsewhere_percent"] == 0.0


def test_an_object_that_stands_beside_its_place_is_counted():
    """A sphere of 1/4 of the picture's width, moved by its own diameter: it covers pi / 64 of the picture, and as much
    again where it was. A ray in 256 may fall either way at each of the two outlines of some 13 pixels.
    """
    ball = spheres([[0.0, 0.0, 0.0]], [1.5])
    found = checked(STRAIGHT, spheres=ball)
    assert found.figures(FINE)["rendered_px"] < 1e-3
    found.scene = replace(found.scene, spheres=replace(found.scene.spheres, centres=np.array([[3.1, 0.0, 0.0]])))
    wrong = found.figures(FINE)
    assert wrong["elsewhere_percent"] == pytest.approx(200.0 * np.pi / 64.0, abs=100.0 * 13 / SIDE**2)
    assert wrong["rendered_px"] == np.inf


def test_around_a_hole_the_sphere_behind_it_is_where_the_reference_has_it():
    """Seen as a ring: rays with a chord tolerance of 1e-5 rad are within a hundredth of a pixel (9 mrad)."""
    found = checked(HOLE, spheres=spheres([[0.0, 9.0, 0.0]], [2.5]))
    assert 0.05 < found.hit.mean() < 0.9 and (found.truth.status == Status.ABSORBED).any()
    figures = found.figures(FINE)
    assert figures["rendered_px"] < 0.01 and figures["objects_px"] > 0.0 and figures["elsewhere_percent"] == 0.0
