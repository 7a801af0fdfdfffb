"""Straight rays against a float64 ray caster that knows nothing of the shaders: hit masks, places, normals, uvs."""

import numpy as np
import pytest

from addon.core.scene import Image, Material, Scene
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders import scenes, truth

EPS = 2.0**-24
PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Status", "Direction")

# Moeller and Trumbore in float32: u, v, t are quotients of triple products of numbers below 10 (the camera is 8 from
# the scene); each product of three rounds by a few eps * 10^3 over a determinant of about 10. Decisions nearer than
# this to an edge may fall either way.
EDGE = 1e-4


def views():
    yield "perspective", scenes.camera(64, 48)
    yield "turned", scenes.camera(64, 48, (5.0, -6.0, 4.0), (0.2, 0.1, -0.3))
    shifted = scenes.Camera(scenes.look_at((-7, -4, 2), (0, 0, 0)), (-0.1, 0.5, -0.4, 0.2), 48, 64)
    yield "shifted", shifted
    yield (
        "orthographic",
        scenes.Camera(scenes.look_at((1, -9, 3), (0, 0, 0)), (-3, 3, -2.2, 2.3), 64, 48, "ORTHOGRAPHIC"),
    )
    yield "inside", scenes.camera(48, 48, (0.3, 0.2, 0.1), (1, 1, 0), half=1.5)


VIEWS = dict(views())


def compare(scene, settings=None):
    """Render and cast; the passes, the truth, and the pixels that are clear of every edge."""
    frame = render(scene, settings or scenes.papers(passes=PASSES))
    exact = truth.cast(scene)
    return frame.passes, exact, exact.margin > EDGE


def place_tolerance(scene, exact, directions):
    """(rows, columns): how far rounding may put a hit from its place. A triangle's t is a quotient of triple products:
    ten roundings of |from| |e1| |e2| over |e1 x e2| cos, the cosine of incidence. A sphere's is the root of
    r^2 - gap^2: ten roundings of r^2 + |from|^2, over r cos.
    """
    tolerance = np.full(exact.index.shape, 10 * EPS * 20.0)
    for at in zip(*np.nonzero(exact.hit), strict=True):
        row, reach = exact.index[at], exact.distance[at] + 4.0
        if exact.is_sphere[at]:
            outward = exact.position[at] - scene.spheres.centres[row]
            flat = abs(outward @ directions[at])  # r cos
            tolerance[at] += 10 * EPS * (scene.spheres.radii[row] ** 2 + reach**2) / max(flat, 1e-6)
        else:
            a, b, c = scene.triangles.positions[row]
            size = np.linalg.norm(b - a) * np.linalg.norm(c - a)
            tolerance[at] += 10 * EPS * reach * size / max(abs(np.cross(b - a, c - a) @ directions[at]), 1e-9)
    return tolerance


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("parts", ["triangles", "spheres", "both"])
def test_hits_places_normals_and_indices(view, parts):
    scene = scenes.mixed(view=VIEWS[view])
    if parts != "both":
        empty = {"triangles": "spheres", "spheres": "triangles"}[parts]
        scene = scenes.replace(scene, **{empty: type(getattr(scene, empty)).empty()})
    passes, exact, clear = compare(scene)
    assert clear.mean() > 0.97 and exact.hit.mean() > 0.01
    hit = passes["Status"][..., 0] == Status.HIT
    assert np.array_equal(hit[clear], exact.hit[clear])
    assert (passes["Status"][~hit] == Status.ESCAPED).all()
    both = hit & exact.hit & clear
    assert np.array_equal(passes["Object Index"][both][:, 0], exact.object_index[both])
    error = np.linalg.norm(passes["Position"][both] - exact.position[both], axis=1)
    assert (error < place_tolerance(scene, exact, passes["Direction"])[both]).all(), error.max()
    # Flat triangles' weights and spheres' places turn a normal by their own error.
    assert np.abs(passes["Normal"][both] - exact.normal[both]).max() < 2e-3
    assert np.median(np.abs(passes["Normal"][both] - exact.normal[both])) < 1e-6
    # Segment 0 and the fraction of the one chord.
    assert (passes["Depth"][~hit] == np.float32(1e10)).all()
    assert ((passes["Depth"][hit] >= 0) & (passes["Depth"][hit] < 1)).all()


def test_a_sphere_around_the_camera_is_seen_from_inside():
    """Every ray meets its far wall; the normal looks inward, and the texture is where it is from outside."""
    ball = scenes.spheres([[0.3, -7.0, 1.2]], 2.5, scenes.rotation(0.3, 0.5, 0.7))
    scene = Scene(scenes.camera(16, 12, half=1.0), scenes.STRAIGHT, spheres=ball)
    passes, exact, _ = compare(scene)
    assert exact.hit.all() and (passes["Status"] == Status.HIT).all()
    assert np.linalg.norm(passes["Position"] - exact.position, axis=-1).max() < 100 * EPS * 10
    assert np.abs(passes["Normal"] - exact.normal).max() < 100 * EPS


def test_hits_at_once_and_far_away():
    """The eps of depth does not depend on how far the objects are: a wall at 1e4, and one right before the camera."""
    for distance in (1e-3, 1.0, 1e4):
        view = scenes.camera(16, 12, (0, 0, 0), (0, 1, 0))
        wall = scenes.quad((0, distance, 0), (distance, 0, 0), (0, 0, distance))
        passes, exact, clear = compare(Scene(view, scenes.STRAIGHT, triangles=wall))
        assert exact.hit.all()
        assert (passes["Status"][clear] == Status.HIT).all()
        error = np.linalg.norm(passes["Position"] - exact.position, axis=-1)[clear]
        assert error.max() < 100 * EPS * distance


def test_a_closed_surface_has_no_holes():
    """A grid of 800 triangles that fills the picture: no ray slips between two triangles that share an edge."""
    n = 20
    x, y = np.meshgrid(np.linspace(-2, 2, n + 1), np.linspace(-2, 2, n + 1))
    points = np.stack([x, 0.3 * np.sin(3 * x) * np.cos(2 * y), y], axis=-1)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    mesh = scenes.triangles(np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3, 3))
    frame = render(
        Scene(scenes.camera(128, 128, (0, -6, 0), half=0.3), scenes.STRAIGHT, triangles=mesh),
        scenes.papers(passes=PASSES),
    )
    missed = frame.passes["Status"] != Status.HIT
    # Float32 decides u, v >= 0 of neighbours apart: Moeller and Trumbore may leak by one ray in some ten thousand.
    assert missed.sum() <= 2


def test_both_sides_of_a_triangle_are_seen_with_the_normal_towards_the_viewer():
    for position in ((0, -5, 0.5), (0, 5, 0.5)):
        scene = Scene(
            scenes.camera(8, 8, position, half=0.1),
            scenes.STRAIGHT,
            triangles=scenes.quad((0, 0, 0), (2, 0, 0), (0, 0, 2)),
        )
        normal = render(scene, scenes.papers(passes=PASSES)).passes["Normal"][4, 4]
        assert normal == pytest.approx([0, np.sign(position[1]), 0], abs=1e-6)


def test_the_nearest_of_many_wins_whatever_their_order():
    walls = [scenes.quad((0, y, 0), (9, 0, 0), (0, 0, 9), object_index=[10 + y] * 2) for y in (3, 1, 5, 2, 4)]
    scene = Scene(
        scenes.camera(8, 8, (0, -5, 0)),
        scenes.STRAIGHT,
        triangles=scenes.joined(*walls),
        spheres=scenes.spheres([[0, 9, 0]], 5.0),
    )
    assert (render(scene, scenes.papers(passes=PASSES)).passes["Object Index"] == 11).all()


def uv_scene(kind, interpolation="CLOSEST"):
    """Objects whose emission is an image that holds its own coordinates; nothing else shines."""
    v, u = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(64) + 0.5) / 64, indexing="ij")
    pixels = np.stack([u, v, np.ones_like(u), np.ones_like(u)], axis=-1).astype(np.float32)
    scene = scenes.mixed(
        view=scenes.camera(48, 36),
        materials=(Material(base_color=(0, 0, 0), emission=(1, 1, 1), emission_image=0),),
        images=(Image("uv", pixels, "EXTEND", interpolation),),
    )
    return scenes.replace(scene, **{kind: type(getattr(scene, kind)).empty()})


@pytest.mark.parametrize("other", ["triangles", "spheres"], ids=["spheres", "triangles"])
def test_texture_coordinates(other):
    """The image shows u and v in steps of 1/64 and half floats of 2^-11: read back within a texel and its rounding."""
    scene = uv_scene(other)
    passes, exact, clear = compare(scene)
    both = (passes["Status"][..., 0] == Status.HIT) & exact.hit & clear
    assert both.sum() > 50
    assert passes["Combined"][both][:, 2] == pytest.approx(1.0)
    difference = np.abs(passes["Combined"][both][:, :2] - exact.uv[both])
    # Uvs within 2e-4 of a texel's edge may take the next texel.
    assert difference.max() < 0.5 / 64 + 2e-4 + 2.0**-11
