"""The cube's directions against the OpenGL specification's table, and integrals with known values."""

import numpy as np
import pytest

from addon.core import environment_cube as cube


def look_up(direction):
    """OpenGL 3.3 core, Table 3.11 and the text below it: (face, s, t) of a direction; face counts +X -X +Y -Y +Z -Z."""
    rx, ry, rz = direction
    major = int(np.argmax(np.abs(direction)))
    if major == 0:
        face, sc, tc, ma = (0, -rz, -ry, rx) if rx > 0 else (1, rz, -ry, rx)
    elif major == 1:
        face, sc, tc, ma = (2, rx, rz, ry) if ry > 0 else (3, rx, -rz, ry)
    else:
        face, sc, tc, ma = (4, rx, -ry, rz) if rz > 0 else (5, -rx, -ry, rz)
    return face, 0.5 * (sc / abs(ma) + 1.0), 0.5 * (tc / abs(ma) + 1.0)


def direction_of(u, v):
    """Cycles' equirectangular_to_direction, from the picture's u, v."""
    phi, theta = np.pi * (1.0 - 2.0 * u), np.pi * (1.0 - v)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@pytest.mark.parametrize("size", [1, 2, 5, 16])
def test_texel_centres_are_where_opengl_looks_them_up(size):
    directions = cube.face_directions(size)
    assert directions.shape == (6, size, size, 3)
    assert np.allclose(np.linalg.norm(directions, axis=-1), 1.0)
    for face, row, column in np.ndindex(6, size, size):
        found, s, t = look_up(directions[face, row, column])
        assert found == face
        assert (s * size, t * size) == pytest.approx((column + 0.5, row + 0.5))


def test_face_size_is_the_next_power_of_two_of_a_quarter_of_the_width():
    widths = (1, 64, 65, 256, 1000, 1024, 2048, 4096, 4097, 16384)
    assert [cube.face_size(width) for width in widths] == [16, 16, 32, 64, 256, 256, 512, 1024, 1024, 1024]


def test_solid_angles_cover_the_sphere():
    for size in (1, 3, 64):
        assert 6.0 * cube.solid_angles(size).sum() == pytest.approx(4.0 * np.pi)
    # A small texel at the face's centre, at distance 1: its area.
    assert cube.solid_angles(301)[150, 150] == pytest.approx((2.0 / 301) ** 2, rel=1e-4)


def test_mean_radiance_of_known_skies():
    directions = cube.face_directions(64)
    faces = np.stack(
        [np.full(directions.shape[:-1], 3.0), directions[..., 2] ** 2, np.maximum(directions[..., 0], 0)], -1
    )
    assert cube.mean_radiance(faces) == pytest.approx((3.0, 1.0 / 3.0, 0.25), rel=1e-3)


def test_pixels_are_found_at_cycles_directions():
    generator = np.random.default_rng(1)
    height, width = 6, 12
    pixels = generator.random((height, width, 3), np.float32)
    for row, column in np.ndindex(height, width):
        direction = direction_of((column + 0.5) / width, (row + 0.5) / height)
        assert cube.sample_equirect(pixels, 7.0 * direction) == pytest.approx(pixels[row, column], abs=1e-5)


def test_the_six_axes_of_a_picture():
    """Middle +X, a quarter from the left +Y, the edges -X, three quarters -Y, top +Z, bottom -Z."""
    u, v = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(128) + 0.5) / 128)
    pixels = np.stack([u, v, np.cos(2.0 * np.pi * u)], axis=-1).astype(np.float32)
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [-1, 0, 0]], float)
    found = cube.sample_equirect(pixels, axes)
    assert found[:3, 0] == pytest.approx([0.5, 0.25, 0.75], abs=0.003)
    assert found[3:5, 1] == pytest.approx([1.0, 0.0], abs=0.005)
    assert found[5, 2] == pytest.approx(1.0, abs=1e-3)


def test_the_seam_is_interpolated_across():
    pixels = np.zeros((2, 4, 3), np.float32)
    pixels[:, 0], pixels[:, -1] = 1.0, 3.0
    assert cube.sample_equirect(pixels, np.array([-1.0, 0.0, 0.0])) == pytest.approx([2.0] * 3)


@pytest.mark.parametrize("width", [64, 512])
def test_cube_shows_a_smooth_sky_turned_and_minified(width):
    """The picture holds its own direction (x, y, z) as colour; 512 pixels on 32² faces are averaged."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(width // 2) + 0.5) * 2 / width)
    pixels = np.moveaxis(direction_of(u, v), 0, -1).astype(np.float32)
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    faces = cube.equirect_to_cube(pixels, 32, turn)
    assert faces.dtype == np.float32
    assert np.abs(faces - cube.face_directions(32) @ turn.T).max() < 2.0 * np.pi / width


@pytest.mark.parametrize("width", [512, 514, 509])
def test_minifying_averages(width):
    """A chequerboard of single pixels becomes grey, not a moiré; a width that divides evenly, and two that do not."""
    pixels = np.indices((256, width)).sum(axis=0)[..., None] % 2 * np.ones(3, np.float32)
    faces = cube.equirect_to_cube(pixels.astype(np.float32), 16)
    assert faces.mean() == pytest.approx(0.5, abs=0.02)
    assert faces.std() < 0.15


def test_an_affine_mapping_shifts_directions():
    pixels = np.tile(np.linspace(0, 1, 64, dtype=np.float32)[:, None, None], (1, 128, 3))
    far_up = np.column_stack([np.eye(3), [0.0, 0.0, 1000.0]])
    assert cube.equirect_to_cube(pixels, 16, far_up).min() > 0.98
