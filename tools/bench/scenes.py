"""The scenes that are timed. World space is model space: the model sits at the origin, a model length is a metre."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from addon.core.models import MODELS, Model
from addon.core.scene import Camera, Environment, Material, Scene, Spheres, Triangles

EYE = (0.0, -27.0, 4.5)  # of the paper's test scene, as in sample_blends
HALF_WIDTH = 0.75  # of the picture on the plane at distance 1: a lens of 24 mm
BOUNDS = 30.0  # radius of the bounding sphere, which holds all objects and the camera
BALL = 13.0  # radius of the ball that the spheres lie in, all of them in view
SPHERES_COVER = 50.0  # square metres: the spheres' cross sections together, however many they are
TORUS = (9.0, 2.5, 0.45)  # radii around and of the tube, inclination against the line of sight, radians

HOLE = MODELS["schwarzschild"](mass=1.0)
STRAIGHT = MODELS["straight"]()
TABLE_1: dict[str, Model] = {
    # The parameters of sample_blends' Figure 4 (b), (c), (d) and (e).
    "Lorenz System": MODELS["lorenz"](strength=2e-5, reach=60.0),
    "Potential Field": MODELS["radial_potential"](xi="cubic", R=16.0, strength=0.03),
    "Varying Index of Refraction": MODELS["refraction"](
        medium="explosion",
        radius=8.0,
        strength=0.12,
        thickness=0.15,
        roughness=0.12,
        frequency=2.5,
        rarefaction=0.5,
    ),
    "Schwarzschild": HOLE,
}
GLOW = tuple(Material(f"Glow {i}", (0.0, 0.0, 0.0), (0.2 + 0.08 * i, 0.9 - 0.07 * i, 0.5)) for i in range(10))
SKY_COLOR = Environment((0.1, 0.12, 0.2))


def camera(size: tuple[int, int], eye: tuple[float, float, float] = EYE) -> Camera:
    """Looks at the origin, Z up. size : columns, rows."""
    back = np.array(eye) / np.linalg.norm(eye)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    world_from_camera[:3, 3] = eye
    half_height = HALF_WIDTH * size[1] / size[0]
    return Camera(world_from_camera, (-HALF_WIDTH, HALF_WIDTH, -half_height, half_height), *size)


def pixel_angle(view: Camera) -> float:
    """Radians that a pixel in the picture's middle is wide."""
    return (view.window[1] - view.window[0]) / view.width


def spheres(count: int, seed: int = 4) -> Spheres:
    """Glowing spheres in a ball around the origin, none nearer to it than 4.5; together they cover the same area
    however many they are, so that about as many rays end on them.
    """
    generator = np.random.default_rng(seed)
    directions = generator.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radius = np.sqrt(SPHERES_COVER / np.pi / count)
    nearest = 4.5 + radius
    distances = np.cbrt(generator.uniform(nearest**3, max(BALL, nearest + 1.0) ** 3, count))
    rows = np.arange(count, dtype=np.int32)
    axes = np.broadcast_to(np.eye(3), (count, 3, 3)).copy()
    return Spheres(directions * distances[:, None], np.full(count, radius), axes, rows % len(GLOW), rows + 1)


def sphere_scene(model: Model, size: tuple[int, int], count: int) -> Scene:
    return Scene(camera(size), model, spheres=spheres(count), materials=GLOW, environment=SKY_COLOR)


def sky_scene(model: Model, size: tuple[int, int]) -> Scene:
    """Nothing but a sky of one colour."""
    return Scene(camera(size), model, environment=SKY_COLOR)


def torus_mesh(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, float64, (2 rings², 3), and quads, int32, (2 rings², 4), of a torus around the origin."""
    around, tube, inclination = TORUS
    u, v = np.meshgrid(np.arange(2 * rings) * np.pi / rings, np.arange(rings) * 2 * np.pi / rings, indexing="ij")
    reach = around + tube * np.cos(v)
    flat = np.stack([reach * np.cos(u), reach * np.sin(u), tube * np.sin(v)], axis=-1).reshape(-1, 3)
    c, s = np.cos(inclination), np.sin(inclination)
    vertices = flat @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
    i, j = (index.ravel() for index in np.indices((2 * rings, rings)))
    after_i, after_j = (i + 1) % (2 * rings), (j + 1) % rings
    quads = np.stack([i * rings + j, after_i * rings + j, after_i * rings + after_j, i * rings + after_j], axis=1)
    return vertices, quads.astype(np.int32)


def torus(rings: int) -> Triangles:
    """4 rings² flat triangles."""
    vertices, quads = torus_mesh(rings)
    corners = vertices[quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    n = len(corners)
    zeros = np.zeros(n, np.int32)
    return Triangles(
        corners,
        np.repeat(normals[:, None], 3, axis=1).astype(np.float32),
        np.zeros((n, 3, 2), np.float32),
        zeros,
        zeros + 1,
    )


def torus_scene(model: Model, size: tuple[int, int], rings: int) -> Scene:
    return replace(sky_scene(model, size), triangles=torus(rings), materials=GLOW)
