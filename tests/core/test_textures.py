"""The arrays that the shaders read: nothing lost, nothing too much, every digit kept."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from addon.core.compose import read
from addon.core.models import MODELS
from addon.core.scene import Camera, Image, Light, Material, Placement, Scene, Spheres, Triangles
from addon.core.textures import (
    GROUP_SIZE,
    TEXELS_PER_ROW,
    folded,
    group_spheres,
    pack,
    spatial_order,
)

CAMERA = Camera(np.eye(4), (-1, 1, -1, 1), 4, 4)
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # world_from_model: x becomes y


def soup(n, seed=1, size=1.0, at=(0.0, 0.0, 0.0)):
    """n random triangles."""
    generator = np.random.default_rng(seed)
    normals = generator.normal(size=(n, 3, 3))
    return Triangles(
        np.array(at) + size * generator.normal(size=(n, 3, 3)),
        (normals / np.linalg.norm(normals, axis=-1, keepdims=True)).astype(np.float32),
        generator.random((n, 3, 2), np.float32),
        generator.integers(0, 3, n).astype(np.int32),
        np.arange(n, dtype=np.int32),
    )


def balls(n, at=(0.0, 0.0, 0.0)):
    generator = np.random.default_rng(4)
    axes, _ = np.linalg.qr(generator.normal(size=(n, 3, 3)))
    return Spheres(
        np.array(at) + generator.normal(size=(n, 3)),
        generator.random(n) + 0.1,
        axes,
        np.zeros(n, np.int32),
        np.arange(n, dtype=np.int32),
    )


def scene(**parts):
    return Scene(CAMERA, MODELS["straight"](), **parts)


def texels(array, count, per_object):
    """(rows, columns, 4) -> (count, per_object, 4)."""
    return array.reshape(-1, 4)[: count * per_object].reshape(count, per_object, 4)


@given(n=st.integers(0, 3 * TEXELS_PER_ROW + 5), seed=st.integers(0, 99))
@settings(max_examples=30, deadline=None)
def test_folded_keeps_every_texel_in_order_and_adds_zeros(n, seed):
    data = np.random.default_rng(seed).normal(size=(n, 4)).astype(np.float32)
    rows = folded(data)
    assert rows.dtype == np.float32 and rows.shape[1:] == (TEXELS_PER_ROW, 4)
    assert len(rows) == max(1, math.ceil(n / TEXELS_PER_ROW))
    assert np.array_equal(rows.reshape(-1, 4)[:n], data)
    assert not rows.reshape(-1, 4)[n:].any()


def test_numbers_shared_with_the_shaders():
    assert f"TEXELS_PER_ROW_LOG2 = {int(math.log2(TEXELS_PER_ROW))};" in read("common/texels")
    assert f"GROUP_SIZE = {GROUP_SIZE};" in read("intersection/triangles")


@given(hnp.arrays(np.float64, st.tuples(st.integers(1, 200), st.just(3)), elements=st.floats(-1e6, 1e6)))
@settings(deadline=None)
def test_spatial_order_is_a_permutation(points):
    assert np.array_equal(np.sort(spatial_order(points)), np.arange(len(points)))


def test_spatial_order_brings_neighbours_together():
    """A shuffled line is put in order; groups of a shuffled grid are far smaller than the grid."""
    generator = np.random.default_rng(1)
    line = generator.permutation(1000)[:, None] * np.ones(3)
    assert np.array_equal(line[spatial_order(line)][:, 0], np.arange(1000))
    grid = generator.permutation(np.indices((16, 16, 16)).reshape(3, -1).T.astype(float))
    blocks = grid[spatial_order(grid)].reshape(-1, 64, 3)
    assert (blocks.max(axis=1) - blocks.min(axis=1)).max() == 3.0


@given(
    n=st.integers(1, 70),
    seed=st.integers(0, 1000),
    size=st.sampled_from([1e-4, 1e-2, 1.0, 1e3]),
    offset=st.sampled_from([0.0, 1.0, 1e2, 1e4]),
)
@settings(max_examples=60, deadline=None)
def test_group_spheres_hold_their_corners_in_float32_too(n, seed, size, offset):
    """In the arithmetic of the shader: float32 centre, squared radius, and corners rebuilt from corner 0 and edges."""
    corners = soup(n, seed, size, (offset, -offset, 0.5 * offset)).positions
    spheres = group_spheres(corners).astype(np.float32)
    assert len(spheres) == math.ceil(n / GROUP_SIZE)
    first = corners[:, :1].astype(np.float32)
    edges = (corners[:, 1:] - corners[:, :1]).astype(np.float32)
    points = np.concatenate([first, first + edges], axis=1)
    own = spheres[np.arange(n) // GROUP_SIZE]
    distance_squared = np.sum((points - own[:, None, :3]) ** 2, axis=-1, dtype=np.float32)
    assert (distance_squared <= own[:, None, 3]).all()


@pytest.mark.parametrize("groups", [True, False])
def test_triangles_are_laid_out_as_the_shader_reads_them(groups):
    triangles = soup(100)
    placement = Placement(np.array([3.0, 0.0, -1.0]), TURN, 2.0)
    packed = pack(scene(triangles=triangles, placement=placement, materials=(Material(),) * 3), groups=groups)
    shape = texels(packed.arrays["u_triangles"], 100, 3)
    surface = texels(packed.arrays["u_corners"], 100, 4)
    order = shape[:, 1, 3].astype(int)  # the object index is the original row
    assert np.array_equal(np.sort(order), np.arange(100))
    model = (triangles.positions - placement.position) @ TURN / 2.0  # row vectors: v R is R^T v
    rebuilt = np.stack([shape[:, 0, :3], shape[:, 0, :3] + shape[:, 1, :3], shape[:, 0, :3] + shape[:, 2, :3]], axis=1)
    # Two roundings of numbers below 4: 2 * 4 * 2^-24.
    assert np.abs(rebuilt - model[order]).max() < 5e-7
    assert np.array_equal(shape[:, 0, 3], triangles.material_index[order])
    assert np.abs(surface[:, :3, :3] - (triangles.normals @ TURN)[order]).max() < 1e-7
    uvs = np.stack([surface[:, 0, 3], surface[:, 1, 3], surface[:, 2, 3], *surface[:, 3, :3].T], axis=1)
    assert np.array_equal(uvs, triangles.uvs[order].reshape(-1, 6))
    assert packed.triangle_count == 100
    assert ("u_triangle_groups" in packed.arrays) == groups


def test_spheres_are_laid_out_as_the_shader_reads_them():
    spheres = balls(5)
    placement = Placement(np.array([3.0, 0.0, -1.0]), TURN, 2.0)
    packed = pack(scene(spheres=spheres, placement=placement))
    rows = texels(packed.arrays["u_spheres"], 5, 5)
    assert rows[:, 0, :3] == pytest.approx((spheres.centres - placement.position) @ TURN / 2.0, abs=1e-6)
    assert rows[:, 0, 3] == pytest.approx(spheres.radii / 2.0)
    assert np.array_equal(rows[:, 1, 1], np.arange(5))
    assert rows[:, 2:, :3] == pytest.approx(spheres.axes @ TURN, abs=1e-6)
    assert packed.sphere_count == 5


def test_the_bounding_radius_holds_every_object():
    packed = pack(scene(triangles=soup(20), spheres=balls(3, (0, 0, 9))))
    corners = np.linalg.norm(soup(20).positions, axis=-1).max()
    spheres = (np.linalg.norm(balls(3, (0, 0, 9)).centres, axis=1) + balls(3).radii).max()
    assert packed.bounds_radius == pytest.approx(max(corners, spheres))


@pytest.mark.parametrize("distance", [0.0, 1e5])
def test_a_scene_far_from_the_worlds_origin_keeps_its_digits(distance):
    """Camera, model and objects moved together pack to the same float32 numbers within float64's own rounding."""
    at = distance * np.array([1.0, -0.7, 0.3])
    near = pack(scene(triangles=soup(40), spheres=balls(4)))
    placement = Placement(at, np.eye(3), 1.0)
    far = pack(scene(triangles=soup(40, at=at), spheres=balls(4, at), placement=placement))
    # 1e5 has an ulp of 1.5e-11 in float64: below half an ulp of float32 at 0.001.
    for name in ("u_triangles", "u_spheres"):
        assert np.abs(far.arrays[name] - near.arrays[name]).max() < 3e-7


@pytest.mark.parametrize(
    ("kind", "factor"),
    [("POINT", 0.25 / np.pi), ("SPOT", 0.25 / np.pi), ("AREA", 1.0 / np.pi), ("SUN", None)],
)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 50.0])
def test_light_arithmetic(kind, factor, scale):
    """A lamp of P watts sends P / 4 pi per steradian everywhere, a Lambertian area P / pi on its axis; intensity over
    the squared distance in model lengths is irradiance per square metre; a sun's irradiance stands as it is.
    """
    placement = Placement(np.array([1.0, 2.0, 3.0]), TURN, scale)
    light = Light(kind, (100.0, 50.0, 0.0), (4.0, 6.0, 3.0), (0.0, 1.0, 0.0), (0.5, 0.75))
    packed = pack(scene(triangles=soup(1), lights=(light,), placement=placement, materials=(Material(),) * 3))
    place, power, direction = texels(packed.arrays["u_lights"], 1, 3)[0]
    metres = 5.0  # |(4, 6, 3) - (1, 2, 3)|
    model_lengths = np.linalg.norm(place[:3])
    assert model_lengths == pytest.approx(metres / scale, rel=1e-6)
    expected = 100.0 if kind == "SUN" else factor * 100.0 / metres**2
    found = power[0] if kind == "SUN" else power[0] / model_lengths**2
    assert found == pytest.approx(expected, rel=1e-6)
    assert power[1] == pytest.approx(power[0] / 2) and power[2] == 0.0
    assert (power[3], direction[3]) == (0.5, 0.75)
    assert direction[:3] == pytest.approx([1.0, 0.0, 0.0], abs=1e-7)  # y of the world is x of the model
    assert place[3] == ("POINT", "SUN", "SPOT", "AREA").index(kind)


def full_scene():
    picture = Image("picture", np.ones((3, 5, 4), np.float32), "CLIP", "CLOSEST")
    return scene(
        triangles=soup(40),
        spheres=balls(3),
        materials=(Material(base_image=0), Material(), Material()),
        images=(picture,),
        lights=(Light("SUN", (1.0, 1.0, 1.0)),),
    )


@pytest.mark.parametrize(
    ("without", "absent"),
    [
        ({"triangles": Triangles.empty()}, {"u_triangles", "u_corners", "u_triangle_groups"}),
        ({"spheres": Spheres.empty()}, {"u_spheres"}),
        ({"lights": ()}, {"u_lights"}),
        ({"images": (), "materials": (Material(),) * 3}, {"u_image_table", "u_image_texels"}),
        ({"materials": (Material(),) * 3}, {"u_image_table", "u_image_texels"}),  # an image that nothing shows
        (
            {"materials": (Material(base_color=(0, 0, 0), emission=(1, 1, 1)),) * 3},
            {"u_lights", "u_image_table", "u_image_texels"},
        ),
    ],
)
def test_what_a_scene_does_not_have_is_not_packed(without, absent):
    everything = set(pack(full_scene()).arrays)
    assert absent <= everything
    found = set(pack(dataclasses.replace(full_scene(), **without)).arrays)
    assert found == everything - absent


def test_an_empty_scene_packs_nothing():
    packed = pack(dataclasses.replace(full_scene(), triangles=Triangles.empty(), spheres=Spheres.empty()))
    assert packed.arrays == {} and packed.bytes == 0 and packed.bounds_radius == 0.0


def test_groups_are_not_made_unasked():
    assert "u_triangle_groups" not in pack(full_scene(), groups=False).arrays


@given(shapes=st.lists(st.tuples(st.integers(1, 70), st.integers(1, 70)), min_size=1, max_size=4))
@settings(max_examples=20, deadline=None)
def test_images_are_found_where_the_table_says(shapes):
    generator = np.random.default_rng(1)
    images = tuple(
        Image(str(i), generator.random((*shape, 4), np.float32), ("REPEAT", "EXTEND", "CLIP", "MIRROR")[i % 4])
        for i, shape in enumerate(shapes)
    )
    packed = pack(dataclasses.replace(full_scene(), images=images))
    table = packed.arrays["u_image_table"].reshape(-1, 4)
    rows = packed.arrays["u_image_texels"]
    for entry, image in zip(table, images, strict=False):
        row, width, height, code = entry.astype(int)
        assert (height, width) == image.pixels.shape[:2]
        assert code == ("REPEAT", "EXTEND", "CLIP", "MIRROR").index(image.extension)
        found = rows[row:].reshape(-1, 4)[: width * height].reshape(height, width, 4)
        assert np.array_equal(found, image.pixels)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
def test_triangles_that_are_not_numbers_are_skipped_and_counted(bad):
    triangles = soup(5)
    triangles.positions[2, 1, 0] = bad
    packed = pack(scene(triangles=triangles, materials=(Material(),) * 3))
    assert packed.triangle_count == 4
    assert packed.warnings == (
        "1 of 5 triangles have corners that are not numbers or lie too far away, and were skipped.",
    )
    assert np.isfinite(packed.arrays["u_triangles"]).all()
    assert 2 not in texels(packed.arrays["u_triangles"], 4, 3)[:, 1, 3]


@pytest.mark.parametrize("part", ["normals", "uvs"])
def test_normals_and_uvs_that_are_not_numbers_do_not_reach_the_shaders(part):
    triangles = soup(5)
    getattr(triangles, part)[3, 0, 1] = np.nan
    packed = pack(scene(triangles=triangles, materials=(Material(),) * 3))
    assert np.isfinite(packed.arrays["u_corners"]).all()
    assert packed.warnings


@pytest.mark.parametrize(
    ("centre", "radius"),
    [(np.nan, 1.0), (np.inf, 1.0), (0.0, np.nan), (0.0, np.inf), (0.0, 0.0), (0.0, -1.0), (1e30, 1.0), (0.0, 1e30)],
)
def test_spheres_that_are_none_are_skipped_and_counted(centre, radius):
    spheres = balls(3)
    spheres.centres[1, 0] = centre
    spheres.radii[1] = radius
    packed = pack(scene(spheres=spheres))
    assert packed.sphere_count == 2
    assert len(packed.warnings) == 1 and packed.warnings[0].startswith("1 of 3 spheres")
    assert math.isfinite(packed.bounds_radius) and packed.bounds_radius > 0
    assert np.isfinite(packed.arrays["u_spheres"]).all()


def test_nothing_but_broken_triangles_is_an_empty_scene():
    triangles = soup(2)
    triangles.positions[:] = np.nan
    packed = pack(scene(triangles=triangles))
    assert packed.arrays == {} and packed.triangle_count == 0 and packed.bounds_radius == 0.0


def test_pixels_of_images_are_finite():
    """EXR files may hold infinity and NaN; a picture may not."""
    pixels = np.ones((2, 2, 4), np.float32)
    pixels[0, 0, 0], pixels[1, 1, 1] = np.nan, np.inf
    packed = pack(dataclasses.replace(full_scene(), images=(Image("bad", pixels),)))
    assert np.isfinite(packed.arrays["u_image_texels"]).all()
