"""Small scenes for the tests."""

from dataclasses import replace

import numpy as np

from addon.core.models import MODELS
from addon.core.scene import Camera, Placement, Scene, Spheres, Triangles
from addon.core.settings import Settings

STRAIGHT = MODELS["straight"]()
HOLE = MODELS["schwarzschild"](mass=1.0)


def papers(**options):
    """Settings of the paper's pipeline; by default with Euler's method and step doubling."""
    return Settings(pipeline="paper", **options)


def rotation(x, y, z):
    """(3, 3): turns by angles around x, then y, then z."""
    c, s = np.cos((x, y, z)), np.sin((x, y, z))
    about_x = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    about_y = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    about_z = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def look_at(position, target, up=(0.0, 0.0, 1.0)):
    """world_from_camera, (4, 4)."""
    position = np.array(position, float)
    back = position - np.array(target, float)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = position
    return matrix


def camera(width=32, height=24, position=(0.0, -8.0, 1.0), target=(0.0, 0.0, 0.0), half=0.5, **options):
    """Perspective, `half` of the width on the plane at distance 1, square pixels."""
    tall = half * height / width
    return Camera(look_at(position, target), (-half, half, -tall, tall), width, height, **options)


def triangles(positions, normals=None, uvs=None, material=0, object_index=None):
    """Flat normals unless given; object indices 1, 2, … unless given."""
    positions = np.asarray(positions, float).reshape(-1, 3, 3)
    n = len(positions)
    if normals is None:
        size = np.maximum(np.abs(positions).max(axis=(1, 2), keepdims=True), 1e-300)
        near = positions / size
        faces = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0])
        faces /= np.maximum(np.linalg.norm(faces, axis=1, keepdims=True), 1e-300)
        normals = np.repeat(faces[:, None], 3, axis=1)
    if uvs is None:
        uvs = np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (n, 1, 1))
    if object_index is None:
        object_index = np.arange(1, n + 1)
    return Triangles(
        positions,
        np.asarray(normals, np.float32).reshape(n, 3, 3),
        np.asarray(uvs, np.float32).reshape(n, 3, 2),
        np.broadcast_to(np.int32(material), n).copy(),
        np.asarray(object_index, np.int32),
    )


def quad(centre, along_u, along_v, **options):
    """Two triangles, counter-clockwise as seen from along_u x along_v; uv from 0 to 1."""
    centre, u, v = (np.array(values, float) for values in (centre, along_u, along_v))
    corners = [centre - u - v, centre + u - v, centre + u + v, centre - u + v]
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    rows = [[0, 1, 2], [0, 2, 3]]
    return triangles([[corners[i] for i in row] for row in rows], uvs=uvs[rows], **options)


def joined(*parts):
    """One soup of several."""
    return Triangles(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))


def spheres(centres, radii, axes=None, object_index=None, material=0):
    centres = np.asarray(centres, float).reshape(-1, 3)
    n = len(centres)
    return Spheres(
        centres,
        np.broadcast_to(np.asarray(radii, float), n).copy(),
        np.broadcast_to(np.eye(3) if axes is None else axes, (n, 3, 3)).copy(),
        np.broadcast_to(np.int32(material), n).copy(),
        np.arange(101, 101 + n, dtype=np.int32) if object_index is None else np.asarray(object_index, np.int32),
    )


def random_soup(n, seed=5, size=0.8, spread=2.0, smooth=True):
    """n triangles of about `size` with their own corner normals, within `spread` of the origin."""
    generator = np.random.default_rng(seed)
    centres = generator.uniform(-spread, spread, (n, 1, 3))
    positions = centres + generator.normal(scale=size, size=(n, 3, 3))
    face = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])[:, None]
    face = face / np.linalg.norm(face, axis=-1, keepdims=True)
    normals = face + (0.3 * generator.normal(size=(n, 3, 3)) if smooth else 0.0)
    normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True) * np.ones((n, 3, 1))
    return triangles(positions, normals, generator.random((n, 3, 2)))


def mixed(model=STRAIGHT, view=None, placement=None, count=40, **options):
    """Triangles and spheres in front of a camera, all over the picture."""
    axes = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3, 3)))[0]
    axes *= np.sign(np.linalg.det(axes))[:, None, None]
    balls = spheres([[1.5, -1.0, 0.8], [-1.6, 0.5, -0.6], [0.0, 2.0, 1.9]], [0.7, 0.9, 0.5], axes)
    return Scene(view or camera(), model, placement or Placement(), random_soup(count), balls, **options)


def scaled(scene, factor):
    """The same scene, all lengths times a factor: world, camera, model."""
    matrix = scene.camera.world_from_camera.copy()
    matrix[:3, 3] *= factor
    window = tuple(factor * edge for edge in scene.camera.window)
    view = replace(
        scene.camera,
        world_from_camera=matrix,
        window=window if scene.camera.kind == "ORTHOGRAPHIC" else scene.camera.window,
    )
    lights = tuple(
        replace(
            light,
            position=tuple(factor * np.array(light.position)),
            power=light.power if light.kind == "SUN" else tuple(factor**2 * np.array(light.power)),
        )
        for light in scene.lights
    )
    return replace(
        scene,
        camera=view,
        triangles=replace(scene.triangles, positions=factor * scene.triangles.positions),
        spheres=replace(scene.spheres, centres=factor * scene.spheres.centres, radii=factor * scene.spheres.radii),
        placement=replace(
            scene.placement, position=factor * scene.placement.position, scale=factor * scene.placement.scale
        ),
        lights=lights,
    )
