"""Sky and images filtered over what a pixel covers of them after all the bending."""

import math
from dataclasses import replace

import numpy as np
import pytest

from addon.core import environment_cube
from addon.core.models import MODELS
from addon.core.pipelines.fused import FusedPipeline
from addon.core.scene import Environment, Image, Material, Scene
from addon.core.settings import Settings
from addon.core.textures import mip_levels
from addon.core.trace import render
from tests.shaders import scenes

EMBEDDED = {
    "pipeline": "fused", "integrator": "dormand_prince_54", "step_control": "embedded", "tolerance": 1e-4,
}  # fmt: skip
GLOWS = Material(base_color=(0, 0, 0), emission=(1, 1, 1), emission_image=0)


def picture(scene, filtered=True, **settings):
    return render(scene, Settings(**EMBEDDED, filter_textures=filtered, **settings)).passes["Combined"][..., :3]


def checkers(texels, size, dark=0.0, bright=1.0, **options):
    """A checkerboard of fields of size x size texels."""
    row = (np.arange(texels) // size) % 2
    pixels = np.ones((texels, texels, 4), np.float32)
    pixels[..., :3] = np.where(row[:, None] ^ row, bright, dark)[..., None]
    return Image("checkers", pixels, **options)


def wall(image, view, half=10.0, repeats=1.0, model=scenes.STRAIGHT):
    """A glowing wall in the plane y = 0."""
    quad = scenes.quad((0, 0, 0), (half, 0, 0), (0, 0, half), object_index=[1, 1])
    quad = replace(quad, uvs=(repeats * quad.uvs).astype(np.float32))
    return Scene(view, model, triangles=quad, materials=(GLOWS,), images=(image,))


# Levels of detail


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (8, 8), (5, 3), (640, 481)])
def test_every_level_has_the_images_mean(shape):
    """Sums of up to 3 x 3 numbers in [0, 1] with float32's rounding, level after level."""
    pixels = np.random.default_rng(2).random((*shape, 4), dtype=np.float32)
    levels = mip_levels(pixels)
    height, width = shape
    for level in levels:
        height, width = max(height // 2, 1), max(width // 2, 1)
        assert level.shape == (height, width, 4) and level.dtype == np.float32
        assert level.mean(axis=(0, 1), dtype=np.float64) == pytest.approx(
            pixels.mean(axis=(0, 1), dtype=np.float64), abs=len(levels) * 9 * 2.0**-24
        )
    assert (height, width) == (1, 1)


def test_levels_of_an_image_with_nan_and_infinity_are_numbers():
    pixels = np.array([[np.nan, np.inf], [-np.inf, 1.0]], np.float32)[..., None].repeat(4, axis=2)
    assert mip_levels(pixels)[0].ravel() == pytest.approx(0.25)


# Images


@pytest.mark.parametrize("interpolation", ["LINEAR", "CLOSEST"])
@pytest.mark.parametrize("texels", [256, 250])
def test_a_fine_checkerboard_far_away_is_its_mean(interpolation, texels):
    """160 fields a pixel: grey everywhere, where unfiltered rays pick white and black. A level's half floats round by
    2^-12 of 0.5.
    """
    image = checkers(texels, 1, interpolation=interpolation)
    scene = wall(image, scenes.camera(24, 18, (0.37, -12, 0.23), half=0.4), repeats=10.0)
    assert picture(scene) == pytest.approx(0.5, abs=2.0**-12)
    assert picture(scene, filtered=False).std() > 0.1


def test_a_slanted_checkerboard_has_no_moire():
    """A floor up to the horizon, fields of 8 x 8 texels: a picture of a hundred rays a pixel says what is right. The
    floor's far half is grey there within 0.1 and so it must be; unfiltered it is noise. Near, fields stay sharp: the
    contrast of single rays.
    """
    view = scenes.camera(48, 36, (0, -30, 2), (0, 0, -1), half=0.5)
    quad = scenes.quad((0, 100, -1), (130, 0, 0), (0, 130, 0), object_index=[1, 1])
    quad = replace(quad, uvs=(12 * quad.uvs).astype(np.float32))
    scene = Scene(view, scenes.STRAIGHT, triangles=quad, materials=(GLOWS,), images=(checkers(64, 8),))
    right = picture(scene, filtered=False, samples=100)
    floor = right[..., 0] > 0
    floor[:-1] &= floor[1:]  # not the horizon's row, which the sky shares
    away = {filtered: np.abs(picture(scene, filtered) - right)[floor].mean() for filtered in (True, False)}
    print(f"mean error of single rays: filtered {away[True]:.4f}, unfiltered {away[False]:.4f}")
    assert away[True] < 0.5 * away[False]
    assert picture(scene)[:6].std() > 0.8 * picture(scene, filtered=False)[:6].std()


@pytest.mark.parametrize("interpolation", ["LINEAR", "CLOSEST"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_magnified_images_are_what_they_are_unfiltered(model, extension, interpolation):
    """A texel is wider than a pixel everywhere that a ray goes on straight, and at most bent a little."""
    image = Image("noise", np.random.default_rng(4).random((16, 12, 4), dtype=np.float32), extension, interpolation)
    law = MODELS[model](mass=0.01) if model == "schwarzschild" else MODELS[model]()
    scene = wall(image, scenes.camera(40, 30, (0.3, -9, 0.2), half=0.7), half=6.0, model=law)
    assert np.abs(picture(scene) - picture(scene, filtered=False)).max() < 1e-6


def test_a_sphere_has_no_seam():
    """Where u jumps from 1 to 0, the footprint is what it is beside it: a magnified image is the unfiltered one there,
    and the poles alone, where a row of texels is one point, are filtered.
    """
    pixels = np.random.default_rng(4).random((16, 32, 4), dtype=np.float32)
    view = scenes.camera(64, 48, (-6.0, 0.1, 0.0), half=0.3)  # u = 0 and 1 are at -x
    balls = scenes.spheres([[0.0, 0.0, 0.0]], 2.0)
    scene = Scene(view, scenes.STRAIGHT, spheres=balls, materials=(GLOWS,), images=(Image("noise", pixels),))
    middle = slice(18, 30), slice(20, 44)
    assert np.abs(picture(scene) - picture(scene, filtered=False))[middle].max() < 1e-6


def test_objects_next_to_each_other_do_not_blur_each_other():
    """Two walls with the same material and object index, one before the other: every pixel, those on the silhouette
    too, is as bright as the image there without filtering, since the image is magnified.
    """
    image = Image("noise", np.random.default_rng(4).random((8, 8, 4), dtype=np.float32))
    front = scenes.quad((-1, -3, 0), (1, 0, 0.3), (0, 0, 1), object_index=[0, 0])
    back = scenes.quad((0, 3, 0), (6, 0, 0), (0, 0, 6), object_index=[0, 0])
    view = scenes.camera(40, 30, (0.3, -9, 0.2), half=0.4)
    scene = Scene(view, scenes.STRAIGHT, triangles=scenes.joined(front, back), materials=(GLOWS,), images=(image,))
    assert np.abs(picture(scene) - picture(scene, filtered=False)).max() < 1e-6


@pytest.mark.parametrize("extension", ["REPEAT", "CLIP"])
def test_a_border_does_not_show_the_images_other_side(extension):
    """A wall of few pixels whose lower half is black and whose upper half is white: of its rows at the bottom none gets
    white, of those at the top none gets black, though their footprints of some texels reach over the border.
    """
    pixels = np.zeros((64, 64, 4), np.float32)
    pixels[32:] = 1.0
    scene = wall(Image("halves", pixels, extension), scenes.camera(40, 30, (0.2, -30, 3.0), half=0.4))
    shown = picture(scene)[..., 0]
    hit = render(scene, Settings(**EMBEDDED, passes=("Object Index",))).passes["Object Index"][..., 0] == 1
    rows = np.nonzero(hit.any(axis=1))[0]
    assert len(rows) > 10
    assert shown[rows[0]][hit[rows[0]]].max() < 0.01
    assert shown[rows[-1]][hit[rows[-1]]].min() > 0.99


# Skies


def starry(size=256, stars=400, seed=3):
    """Faces with single bright texels."""
    generator = np.random.default_rng(seed)
    faces = np.zeros((6, size, size, 3), np.float32)
    at = generator.integers(0, size, (2, stars))
    faces[generator.integers(0, 6, stars), at[0], at[1]] = generator.uniform(1, 10, (stars, 1))
    return Environment(faces=faces)


def turned(position, angle, width=64, height=48, half=0.7, model=scenes.STRAIGHT, environment=None):
    """A camera that looks along y and past the model, turned by an angle."""
    target = (position[0] + math.sin(angle), position[1] + math.cos(angle), position[2])
    view = scenes.camera(width, height, position, target, half)
    return Scene(view, model, environment=environment)


def flux(scene, filtered):
    """The picture's light: radiance times the solid angle of each pixel."""
    camera = scene.camera
    left, right, bottom, top = camera.window
    x = left + (np.arange(camera.width) + 0.5) * (right - left) / camera.width
    y = bottom + (np.arange(camera.height) + 0.5) * (top - bottom) / camera.height
    weights = (1.0 + x**2 + y[:, None] ** 2) ** -1.5
    return float((picture(scene, filtered)[..., 0] * weights).sum())


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_stars_keep_their_light_while_the_camera_turns(model):
    """Eight turns by an eighth of a pixel: single rays meet a star of half a pixel's width or miss it; filtered, its
    light is shared out. Relative standard deviations of the picture's whole light; stars that leave at an edge are few.
    """
    pixel = 1.4 / 64
    law = MODELS[model](mass=0.3) if model == "schwarzschild" else MODELS[model]()
    skies = [turned((0.0, -10.0, 0.0), k / 8 * pixel, model=law, environment=starry()) for k in range(8)]
    spread = {}
    for filtered in (True, False):
        light = np.array([flux(scene, filtered) for scene in skies])
        spread[filtered] = light.std() / light.mean()
    print(f"{model}: flux varies by {spread[True]:.2%} filtered, {spread[False]:.2%} unfiltered")
    assert spread[True] < 0.25 * spread[False]


def test_a_minified_sky_has_its_mean_light():
    """All stars of a sky, in pictures of single rays that look along the six axes: the sum over all is the sum over the
    cube's texels, each with its solid angle.
    """
    sky = starry(128, 300)
    exact = float(np.einsum("fij,ij->", sky.faces[..., 0].astype(np.float64), environment_cube.solid_angles(128)))
    found = {True: 0.0, False: 0.0}
    for axis in range(6):
        target = np.zeros(3)
        target[axis // 2] = 1 - 2 * (axis % 2)
        up = (0, 1, 0) if axis > 3 else (0, 0, 1)  # the pictures' edges are the cube's
        view = scenes.Camera(scenes.look_at((0, 0, 0), target, up), (-1, 1, -1, 1), 32, 32)
        scene = Scene(view, scenes.STRAIGHT, environment=sky)
        for filtered in found:
            found[filtered] += flux(scene, filtered) * (2 / 32) ** 2
    print(f"light of the whole sky: {found[True] / exact:.3f} filtered, {found[False] / exact:.3f} unfiltered of it")
    assert found[True] == pytest.approx(exact, rel=0.05)


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_a_magnified_sky_is_what_it_is_unfiltered(model):
    """Texels of some pixels: level 0, one probe. The hole itself, next to which all is small, is out of sight."""
    faces = np.random.default_rng(5).random((6, 8, 8, 3), dtype=np.float32)
    law = MODELS[model](mass=1.0) if model == "schwarzschild" else MODELS[model]()
    scene = turned((0.0, -10.0, 14.0), 0.0, model=law, environment=Environment(faces=faces))
    assert np.abs(picture(scene) - picture(scene, filtered=False)).max() < 1e-6


def test_the_far_sides_sky_is_filtered_too():
    """Through a wormhole's throat: both skies are noise of mean 0.5 and finer than a pixel; both halves of the picture
    vary less than unfiltered.
    """
    generator = np.random.default_rng(6)
    near, far = (Environment(faces=generator.random((6, 256, 256, 3), dtype=np.float32)) for _ in range(2))
    scene = replace(
        turned((0.0, -8.0, 0.0), 0.0, 48, 36, model=MODELS["wormhole"](), environment=near), far_environment=far
    )
    filtered, plain = picture(scene), picture(scene, filtered=False)
    throat = np.s_[14:22, 20:28]
    corner = np.s_[:8, :8]
    for part in (throat, corner):
        assert filtered[part].mean() == pytest.approx(0.5, abs=0.05)
        assert filtered[part].std() < 0.5 * plain[part].std()


# Tiles and what is left out


def test_the_pixels_at_a_tiles_edge_are_filtered_as_the_others(monkeypatch):
    """Quads lie in the picture as they lie in tiles of even sizes, and a picture's odd edge is drawn as whole quads."""
    scene = wall(checkers(64, 1), scenes.camera(41, 31, (1, -12, 3), half=0.4), repeats=4.0)
    whole = picture(scene)
    sizes = iter([(16, 8), (32, 8), (8, 32)] * 1000)
    monkeypatch.setattr(FusedPipeline, "tile_size", lambda self: next(sizes))
    assert np.array_equal(whole, picture(scene))


def test_without_images_and_sky_the_picture_is_the_same():
    scene = scenes.mixed(environment=Environment((1.0, 1.0, 1.0)), ambient=(0.5, 0.5, 0.5))
    assert np.array_equal(picture(scene), picture(scene, filtered=False))
