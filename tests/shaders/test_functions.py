"""GLSL functions on arrays against float64 numpy."""

import re

import numpy as np
import pytest

from addon.core.compose import read
from addon.core.models import MODELS
from addon.core.scene import EXTENSIONS, INTERPOLATIONS, Image, Material, Scene
from addon.core.textures import pack_images
from addon.core.trace import camera_uniforms
from tests.shaders import scenes, truth

EPS = 2.0**-24  # half an ulp of float32, relative
CASES = [("straight", {}), *(("schwarzschild", {"mass": mass}) for mass in (1.0, 0.25, 0.0))]


def states(n=1000, seed=1, nearest=2.0, farthest=200.0):
    """(n, 6) in float32's numbers: radii spread evenly in log r, unit directions; some radial, some tangential."""
    generator = np.random.default_rng(seed)
    x = generator.normal(size=(n, 3))
    x *= np.geomspace(nearest, farthest, n)[:, None] / np.linalg.norm(x, axis=1, keepdims=True)
    v = generator.normal(size=(n, 3))
    v[:10] = -x[:10]
    v[10:20] = np.cross(x[10:20], v[10:20])
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return np.concatenate([x, v], axis=1).astype(np.float32)


@pytest.mark.parametrize(("name", "values"), CASES, ids=str)
def test_right_hand_side(glsl, name, values):
    """f is a product of some 20 rounded operations; h = x cross v cancels where v is nearly radial, so its rounding is
    relative to |x||v|, not to |h|. Hence |df| <= 40 eps |f| + 40 eps 3M |x|^2 |h| / r^4.
    """
    model, given = MODELS[name](**values), states()
    found = glsl(
        [f"models/{name}"],
        "RayState d = rhs(RayState(x.xyz, v.xyz)); out_dx = vec4(d.x, 0.0); out_dv = vec4(d.v, 0.0);",
        {"x": given[:, :3], "v": given[:, 3:]},
        ("dx", "dv"),
        model.uniforms(),
    )
    exact = model.rhs(given.astype(np.float64))
    assert np.array_equal(found["dx"][:, :3], given[:, 3:])
    x, v = given[:, :3].astype(float), given[:, 3:].astype(float)
    r, h = np.linalg.norm(x, axis=1), np.linalg.norm(np.cross(x, v), axis=1)
    size = np.linalg.norm(exact[:, 3:], axis=1)
    bound = 40 * EPS * (size + 3.0 * values.get("mass", 0.0) * (h + EPS * r) / r**3)
    error = np.linalg.norm(found["dv"][:, :3] - exact[:, 3:], axis=1)
    assert (error <= bound).all(), (error / np.maximum(bound, 1e-300)).max()


@pytest.mark.parametrize(("name", "values"), CASES, ids=str)
def test_invariants_are_conserved_by_the_float64_equation(glsl, name, values):
    """What the shader calls an invariant does not change along a truth of DOP853: each is checked at both ends.

    Rounding: 10 operations on numbers as large as the invariants' own terms.
    """
    model = MODELS[name](**values)
    start = states(20, seed=3, nearest=6.0, farthest=40.0).astype(np.float64)
    # No ray that falls in: outward, or with b > 5.2 M at these radii.
    start[:, 3:] *= np.sign(np.sum(start[:, :3] * start[:, 3:], axis=1))[:, None]
    end = truth.integrate(model, start, 30.0)
    uniforms = model.uniforms()
    both = [
        glsl(
            [f"models/{name}"],
            "out_result = invariants(RayState(x.xyz, v.xyz));",
            {"x": state[:, :3], "v": state[:, 3:]},
            uniforms=uniforms,
        )["result"]
        for state in (start, end)
    ]
    size = 1.0 + np.linalg.norm(start[:, :3], axis=1) + np.linalg.norm(end[:, :3], axis=1)
    assert (np.abs(both[0] - both[1]).max(axis=1) <= 10 * EPS * size).all()


def test_static_frame_against_the_metric(glsl):
    """The chart direction of the static observer, measured with the metric, is the direction that he sees: with
    g_ij = delta_ij + 2M / (r - 2M) n_i n_j, the angle to n has tan = sin / (cos / sqrt(1 - 2M/r)).
    """
    given = states(200, nearest=2.2)
    found = glsl(
        ["observers/static", "models/schwarzschild"],
        "out_result = vec4(chart_direction(x.xyz, d.xyz), 0.0);",
        {"x": given[:, :3], "d": given[:, 3:]},
        uniforms={"u_mass": 1.0},
    )["result"][:, :3].astype(float)
    x, d = given[:, :3].astype(float), given[:, 3:].astype(float)
    r = np.linalg.norm(x, axis=1)
    n = x / r[:, None]
    radial = np.sum(found * n, axis=1)
    proper_radial = radial / np.sqrt(1 - 2 / r)
    across = found - radial[:, None] * n
    seen = across + proper_radial[:, None] * n
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    # 1 / sqrt(1 - 2/2.2) = 3.3 magnifies the rounding of some ten operations.
    assert np.abs(seen - d).max() < 100 * EPS
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 4 * EPS


@pytest.mark.parametrize(
    ("x", "expected"),
    [((0, 0, 1.99), True), ((0, -1.5, 1.3), True), ((0, 0, 2.01), False), ((0, 0, 0), True), ((1e6, 0, 0), False)],
)
def test_absorbed_at_the_horizon(glsl, x, expected):
    body = "out_result = vec4(absorbed(RayState(x.xyz, vec3(1.0, 0.0, 0.0))));"
    found = glsl(["models/schwarzschild"], body, {"x": [x]}, uniforms={"u_mass": 1.0})["result"]
    assert bool(found[0, 0]) == expected


@pytest.mark.parametrize("value", [0.0, 1.0, 1e18, np.inf, -np.inf, np.nan])
def test_finite(glsl, value):
    body = "out_result = vec4(finite(a.xyz));"
    found = glsl(["camera/given"], body, {"a": [[1.0, value, 2.0]]})["result"]
    assert bool(found[0, 0]) == np.isfinite(value)


@pytest.mark.parametrize("kind", ["PERSPECTIVE", "ORTHOGRAPHIC"])
def test_camera_rays(glsl, kind):
    """Every pixel of a turned, shifted window; a few roundings of the direction and of the position."""
    placement = scenes.Placement(np.array([3.0, -2.0, 5.0]), scenes.rotation(0.4, -0.9, 2.0), 2.5)
    camera = scenes.Camera(scenes.look_at((4, -9, 2), (0, 1, 1)), (-0.7, 0.3, -0.1, 0.6), 40, 30, kind)
    scene = Scene(camera, scenes.STRAIGHT, placement)
    column, row = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    found = glsl(
        [f"camera/{kind.lower()}"],
        "vec3 o, d; camera_ray(pixel.xy, o, d); out_origin = vec4(o, 0.0); out_direction = vec4(d, 0.0);",
        {"pixel": np.stack([column.ravel(), row.ravel()], axis=1)},
        ("origin", "direction"),
        camera_uniforms(scene),
    )
    origins, directions = (rays.reshape(-1, 3) for rays in truth.camera_rays(camera))
    origins = (origins - placement.position) @ placement.rotation / placement.scale
    directions = directions @ placement.rotation
    assert np.abs(found["origin"][:, :3] - origins).max() < 4 * EPS * np.abs(origins).max()
    assert np.abs(found["direction"][:, :3] - directions).max() < 6 * EPS


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("size", [1, 2, 5])
def test_texel_indices_are_folded(glsl, extension, size):
    numbers = np.arange(-3 * size - 2, 3 * size + 3)
    found = glsl(
        ["shading/images"],
        f"out_result = vec4(float(folded(int(i.x), {size}, {EXTENSIONS.index(extension)})));",
        {"i": numbers[:, None]},
    )["result"][:, 0]
    assert np.array_equal(found, truth.folded_index(numbers, size, extension))


WIDTHS = np.arange(1, 8193)
MULTIPLES = (-7, -3, -2, -1, 0, 1, 2, 3, 7)


def with_rounded_reciprocal(i, period):
    """i - period floor(i / period) where a driver takes i / period as i times the rounded 1 / period, in float32."""
    reciprocal = np.float32(1.0) / period.astype(np.float32)
    return i - period * np.floor(i.astype(np.float32) * reciprocal).astype(int)


def test_a_quotient_of_floats_would_not_fold_texel_indices():
    """Why folded() has none: whole multiples of many widths, the usual ones among them, would be beyond the image."""
    beyond = {int(w) for k in MULTIPLES for w in WIDTHS[with_rounded_reciprocal(k * WIDTHS, WIDTHS) == WIDTHS]}
    assert {250, 500, 1000, 1920, 3840} <= beyond and len(beyond) > 1500


def test_texel_indices_are_folded_in_whole_numbers():
    """Neither a quotient nor a float is in the function."""
    body = re.search(r"^int folded\(.*?^}", read("shading/images"), re.DOTALL | re.MULTILINE)[0]
    assert not re.search(r"float|floor|/|\d\.\d", body)


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_texel_indices_of_all_widths(glsl, extension):
    """At and next to whole multiples of every width, where a rounded quotient has the wrong floor."""
    i = np.stack([k * WIDTHS + off for k in MULTIPLES for off in (-1, 0, 1)])
    size = np.broadcast_to(WIDTHS, i.shape)
    found = glsl(
        ["shading/images"],
        f"out_result = vec4(float(folded(int(i.x), int(size.x), {EXTENSIONS.index(extension)})));",
        {"i": i.reshape(-1, 1), "size": size.reshape(-1, 1)},
    )["result"][:, 0]
    assert np.array_equal(found, truth.folded_index(i.ravel(), size.ravel(), extension))


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_images_are_sampled(glsl, extension, interpolation):
    """Two images, one larger than a row of texels, at uvs in and around [0, 1]; none within 1e-5 of a texel's edge,
    where float32 may choose the neighbour. uv * 60 rounds by 60 * 2.5 * eps texels, times the contrast of 1.
    """
    generator = np.random.default_rng(2)
    images = tuple(
        Image(str(shape), generator.random((*shape, 4), np.float32), extension, interpolation)
        for shape in ((3, 4), (60, 50))
    )
    scene = Scene(scenes.camera(), scenes.STRAIGHT, materials=(Material(base_image=0),), images=images)
    table, texels = pack_images(scene)
    uv = generator.uniform(-1.5, 2.5, (600, 2)).astype(np.float32)
    for index, image in enumerate(images):
        height, width, _ = image.pixels.shape
        at = uv.astype(float) * (width, height)
        clear = (np.abs(at - np.round(at)) > 1e-4).all(axis=1)
        found = glsl(
            ["shading/images"],
            f"out_result = sample_image({index}, uv.xy);",
            {"uv": uv[clear]},
            textures={"u_image_table": table, "u_image_texels": texels},
        )["result"]
        assert np.abs(found - truth.sample(image, uv[clear])).max() < 60 * 2.5 * 4 * EPS


def test_step_control_doubles_halves_and_keeps(glsl):
    """Two thresholds, Section 4.2: above the upper the step halves and is taken back; below the lower it doubles."""
    errors = np.array([0.0, 0.19, 0.21, 1.0, 1.01, 50.0, np.inf, np.nan]) * 1e-3
    found = glsl(
        ["step_control/doubling"],
        "out_result = vec4(next_step(0.5, e.x), float(accepted(e.x)), 0.0, 0.0);",
        {"e": errors[:, None]},
        uniforms={"u_tolerance": float(np.float32(1e-3))},
    )["result"]
    assert found[:, 0].tolist() == [1.0, 1.0, 0.5, 0.5, 0.25, 0.25, 0.25, 0.25]
    assert found[:, 1].tolist() == [1, 1, 1, 1, 0, 0, 0, 0]


def test_euler_is_one_step_of_the_right_hand_side(glsl):
    given = states(100)
    found = glsl(
        ["integrators/euler", "models/schwarzschild"],
        "RayState s = advance(RayState(x.xyz, v.xyz), 0.1).state; out_x = vec4(s.x, 0.0); out_v = vec4(s.v, 0.0);",
        {"x": given[:, :3], "v": given[:, 3:]},
        ("x", "v"),
        {"u_mass": 1.0},
    )
    both = given.astype(np.float64)
    exact = both + 0.1 * scenes.HOLE.rhs(both)
    size = np.linalg.norm(exact[:, :3], axis=1)[:, None]
    assert (np.abs(found["x"][:, :3] - exact[:, :3]) < 4 * EPS * size).all()
    assert np.abs(found["v"][:, :3] - exact[:, 3:]).max() < 10 * EPS
