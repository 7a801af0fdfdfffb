"""Colours at pixels against the formulas of Section 3.4 in Blender's units."""

import numpy as np
import pytest

from addon.core.scene import Image, Light, Material, Placement, Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders import scenes, truth

WHITE = (0.8, 0.5, 0.2)
LIGHTS = {
    "sun": Light("SUN", (3.0, 2.0, 1.0), direction=(0.6, 0.0, -0.8)),
    "point": Light("POINT", (500.0, 300.0, 100.0), position=(1.0, -2.0, 3.0)),
    "spot": Light("SPOT", (900.0, 900.0, 900.0), (0.5, -0.5, 4.0), (0.0, 0.0, -1.0), (0.85, 0.95)),
    "area": Light("AREA", (400.0, 200.0, 400.0), (-1.0, 1.0, 3.0), (0.28, 0.0, -0.96)),
}
MATERIALS = {
    "diffuse": Material(base_color=WHITE),
    "glossy": Material(base_color=WHITE, roughness=0.3, specular=0.5),
    "rough": Material(base_color=(0, 0, 0), roughness=1.0, specular=1.0),
    "glowing": Material(base_color=WHITE, emission=(0.0, 7.0, 0.25)),
}
TURNED = Placement(np.array([2.0, -1.0, 0.5]), scenes.rotation(0.5, 1.1, -0.7), 3.0)


def floor_and_ball(material, lights, placement=None, ambient=(0.0, 0.0, 0.0), images=()):
    """A floor with a ball on it, seen from above at a slant."""
    return Scene(
        scenes.camera(24, 18, (0, -6, 5), half=0.4),
        scenes.STRAIGHT,
        placement or Placement(),
        scenes.quad((0, 0, 0), (2, 0, 0), (0, 2, 0)),
        scenes.spheres([[0.0, 0.0, 0.8]], 0.8),
        (material,),
        images,
        lights,
        ambient=ambient,
    )


def compare(scene, tolerance=3e-5):
    """Every hit pixel clear of edges. Places are right to 1e-6, and the highlight's exponent of up to 240 (roughness
    0.3) magnifies a normal's rounding to 1e-4 of its peak; colours are compared relative to the brightest pixel.
    """
    passes = render(scene, Settings(passes=("Combined", "Status"), filter_textures=False)).passes
    exact = truth.cast(scene)
    _, directions = truth.camera_rays(scene.camera)
    clear = exact.hit & (exact.margin > 1e-4)
    assert clear.sum() > 100
    assert (passes["Status"][clear] == Status.HIT).all()
    expected = np.array(
        [
            truth.radiance(
                scene, scene.materials[0], exact.position[at], exact.normal[at], -directions[at], exact.uv[at]
            )
            for at in zip(*np.nonzero(clear), strict=True)
        ]
    )
    found = passes["Combined"][clear]
    assert np.abs(found[:, :3] - expected).max() < tolerance * expected.max()
    assert (found[:, 3] == 1.0).all()
    return expected


@pytest.mark.parametrize("placement", [None, TURNED], ids=["in place", "turned and scaled"])
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("material", MATERIALS)
def test_every_light_on_every_material(material, light, placement):
    expected = compare(floor_and_ball(MATERIALS[material], (LIGHTS[light],), placement), 3e-4)
    assert expected.max() > 0


def test_lights_add_up():
    compare(floor_and_ball(MATERIALS["glossy"], tuple(LIGHTS.values()), ambient=(0.1, 0.2, 0.3)), 3e-4)


def test_a_sun_of_one_watt_on_white_is_one_over_pi():
    scene = floor_and_ball(Material(base_color=(1, 1, 1)), (Light("SUN", (1, 1, 1), direction=(0, 0, -1)),))
    passes = render(scene, Settings(passes=("Combined", "Normal"))).passes
    floor = passes["Normal"][..., 2] > 0.999999
    assert floor.sum() > 20
    assert passes["Combined"][floor][:, :3] == pytest.approx(1 / np.pi, rel=1e-5)


def test_ambient_and_emission_without_lights():
    expected = compare(floor_and_ball(MATERIALS["glowing"], (), ambient=(0.5, 0.25, 1.0)))
    assert expected[0] == pytest.approx([0.4, 7.125, 0.45])


def test_a_light_behind_the_surface_does_not_shine_through():
    scene = floor_and_ball(Material(), (Light("SUN", (9, 9, 9), direction=(0, 0, 1)),))
    passes = render(scene, Settings(passes=("Combined", "Normal"))).passes
    floor = passes["Normal"][..., 2] > 0.999
    assert floor.any() and not passes["Combined"][floor][:, :3].any()


def test_outside_the_spots_cone_it_is_dark_and_inside_it_is_full():
    spot = Light("SPOT", (100.0,) * 3, (0.0, 0.0, 4.0), (0.0, 0.0, -1.0), (0.995, 0.999))
    expected = compare(floor_and_ball(Material(), (spot,)), 1e-3)
    assert (expected == 0).any() and (expected > 0).any()


@pytest.mark.parametrize("which", ["base_image", "emission_image"])
def test_images_multiply_their_colour(which):
    """A smooth image, so that the uv's rounding changes little; half floats keep 2^-11 of each texel."""
    v, u = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0.2, 1, 7), indexing="ij")
    image = Image("ramp", np.stack([u, v, u * v, np.ones_like(u)], axis=-1).astype(np.float32), "EXTEND")
    material = Material(base_color=WHITE, emission=(2.0, 1.0, 0.5), **{which: 0})
    compare(floor_and_ball(material, (LIGHTS["sun"],), ambient=(0.2, 0.2, 0.2), images=(image,)), 2.0**-11 + 1e-4)


def test_materials_and_images_go_by_their_index():
    """Four walls, four materials, two images of one texel: each wall glows as its own."""
    images = tuple(Image(name, np.full((1, 1, 4), value, np.float32)) for name, value in (("a", 0.5), ("b", 0.25)))
    materials = tuple(
        Material(base_color=(0, 0, 0), emission=(k, 0, 1), emission_image=image)
        for k, image in ((1, None), (2, 0), (3, 1), (4, 0))
    )
    walls = [scenes.quad((2 * k - 3, 0, 0), (0.9, 0, 0), (0, 0, 0.9), material=k) for k in range(4)]
    view = scenes.Camera(scenes.look_at((0, -9, 0), (0, 0, 0)), (-4, 4, -1, 1), 8, 2, "ORTHOGRAPHIC")
    scene = Scene(view, scenes.STRAIGHT, triangles=scenes.joined(*walls), materials=materials, images=images)
    row = render(scene, Settings()).passes["Combined"][0]
    assert row[::2, 0].tolist() == [1.0, 1.0, 0.75, 2.0]
    assert row[::2, 2].tolist() == [1.0, 0.5, 0.25, 0.5]
