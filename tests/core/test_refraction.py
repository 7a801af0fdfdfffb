"""Media in float64: gradients against differences of n, known values, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from addon.core.compose import SHADERS, read
from addon.core.models import MODELS, ParameterError
from addon.core.models.noise import corner_values, noise, value_noise
from addon.core.models.refraction import MEDIA
from addon.core.models.still_blocks import FARTHEST, still_blocks, still_cells

REFRACTION = MODELS["refraction"]
DENSITY = np.random.default_rng(1).random((5, 6, 7))
MODELS_OF_ALL_MEDIA = {
    key: REFRACTION(
        medium=key,
        mass=0.2,
        grid=DENSITY,
        grid_min=(-1.2, -1.0, -1.1),
        formula="1.4 + 0.2*sin(2*x + t)*cos(y)*exp(-z^2) + 0.1*r",
    )
    for key in MEDIA
}


def points(n=500, radius=1.5, nearest=0.25, seed=3):
    generator = np.random.default_rng(seed)
    x = generator.normal(size=(n, 3))
    return x / np.linalg.norm(x, axis=1, keepdims=True) * generator.uniform(nearest, radius, (n, 1))


@pytest.mark.parametrize("key", MEDIA)
def test_the_force_is_half_the_gradient_of_the_squared_index(key):
    """Central differences of step 1e-5: wrong by h^2/6 of a third derivative, here up to 1e4, and by eps n^2 / h."""
    model = MODELS_OF_ALL_MEDIA[key]
    x = points()
    if key == "luneburg":  # a kink at the rim
        x = x[np.abs(np.linalg.norm(x, axis=1) - 1.0) > 1e-4]
    force, _ = model.law.field(x)
    for axis in range(3):
        shift = 1e-5 * np.eye(3)[axis]
        slope = (model.law.field(x + shift)[1] - model.law.field(x - shift)[1]) / 2e-5
        assert np.abs(force[:, axis] - 0.5 * slope).max() < 1e-5


@pytest.mark.parametrize("key", MEDIA)
def test_first_states_have_the_speed_n(key):
    model = MODELS_OF_ALL_MEDIA[key]
    x = points(50)
    states = model.initial_states(x, x / np.linalg.norm(x, axis=1, keepdims=True))
    assert np.linalg.norm(states[:, 3:], axis=1) ** 2 == pytest.approx(model.law.field(x)[1])
    assert model.rhs(states)[:, :3] == pytest.approx(states[:, 3:], rel=1e-14)


@pytest.mark.parametrize("key", MEDIA)
def test_every_medium_has_a_shader_and_declares_its_parameters(key):
    law = MODELS_OF_ALL_MEDIA[key].law
    text = "".join(read(file) for file in law.files())
    assert (SHADERS / "media" / f"{key}.glsl").is_file()
    assert law.label and law.description and law.parameters
    known = {parameter.name for parameter in REFRACTION.parameters}
    assert set(law.parameters) <= known
    for name in known:
        assert (f"uniform float u_{name};" in text) == (name in law.parameters), name


def test_every_parameter_moves_some_medium_or_the_stepping():
    used = {name for medium in MEDIA.values() for name in medium.parameters}
    assert {parameter.name for parameter in REFRACTION.parameters} == used | {"threshold"}
    assert "uniform float u_threshold;" in read("integrators/snell")


@pytest.mark.parametrize("key", MEDIA)
def test_scales_are_positive(key):
    model = MODELS_OF_ALL_MEDIA[key]
    assert 0 < model.default_step() < model.flat_radius() < math.inf


@pytest.mark.parametrize("key", ["explosion", "shell", "luneburg", "grid"])
def test_beyond_the_flat_radius_n_is_one(key):
    model = MODELS_OF_ALL_MEDIA[key]
    force, n_squared = model.law.field(points(100, 1.5, 1.0001) * model.flat_radius())
    assert not force.any() and (n_squared == 1.0).all()


# Known values


def test_mirage_over_hot_and_cold_ground():
    hot, cold = REFRACTION(medium="mirage"), REFRACTION(medium="mirage", mirage_b=1e-3)
    x = np.array([[3.0, -2.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -4.0]])
    assert hot.law.field(x)[1][:2] == pytest.approx([0.999, 1.0 - 1e-3 * math.exp(-2.0)], rel=1e-14)
    assert (hot.law.field(x)[0][:, 2] > 0).all() and (cold.law.field(x)[0][:, 2] < 0).all()
    assert hot.law.dark(x).tolist() == [False, False, True] and not cold.law.dark(x).any()


def test_the_default_mirage_mirrors_the_ground_beyond_fifty_lengths():
    """sin^2(dip) < |B| (1 - e^(-c h)) for a camera 1.5 above the ground: from 48 lengths on."""
    model = REFRACTION(medium="mirage")
    dip = math.asin(math.sqrt(-model.mirage_b * (1.0 - math.exp(-1.5 * model.mirage_c))))
    assert 45 < 1.5 / math.tan(dip) < 50


@pytest.mark.parametrize(("b", "deflection"), [(6.0, 1.71938831023017), (10.0, 0.590395787605827)])
def test_the_isotropic_medium_is_schwarzschild(b, deflection):
    """Darwin's angles in physics.md; from rho = 1e5 M on, the rest of the deflection is about 2 M b / rho^2 < 1e-8."""
    model = REFRACTION(medium="isotropic")
    far = 1e5
    n = math.sqrt(model.law.field(np.array([[far, 0.0, 0.0]]))[1][0])
    state = np.array([-far, b / n, 0.0, n, 0.0, 0.0])
    run = solve_ivp(lambda t, s: model.rhs(s[None])[0], (0, 2.2 * far), state, "DOP853", rtol=1e-12, atol=1e-10)
    found = -math.atan2(run.y[4, -1], run.y[3, -1])
    assert found == pytest.approx(deflection, abs=1e-7)


def test_the_blast_is_self_similar():
    """n(x, t) depends on x / t^(2/5) only."""
    x = points(200)
    early, late = REFRACTION(time=1.0), REFRACTION(time=3.0)
    scale = 3.0**0.4
    assert late.law.field(scale * x)[1] == pytest.approx(early.law.field(x)[1], abs=1e-12)
    assert scale * late.law.field(scale * x)[0] == pytest.approx(early.law.field(x)[0], abs=1e-9)


def test_a_blast_at_time_zero_is_a_point():
    model = REFRACTION(time=0.0)
    assert model.flat_radius() < 1e-5 and model.default_step() > 1e-4
    assert (model.law.field(points())[1] == 1.0).all()


def test_strength_zero_is_straight():
    states = np.concatenate([points(), points(seed=8)], axis=1)
    straight = MODELS["straight"]().rhs(states)
    for values in ({"medium": "explosion"}, {"medium": "shell"}, {"medium": "grid", "grid": DENSITY}):
        assert np.array_equal(REFRACTION(**values, strength=0.0).rhs(states), straight)
    assert np.array_equal(REFRACTION(medium="mirage", mirage_b=0.0).rhs(states), straight)
    assert np.array_equal(REFRACTION(medium="linear", gradient=0.0).rhs(states), straight)
    assert np.array_equal(REFRACTION(medium="isotropic", mass=0.0).rhs(states), straight)


# Noise


def test_noise_is_the_random_value_at_whole_points():
    cells = np.random.default_rng(2).integers(-50, 50, (300, 3))
    gradient, value = value_noise(cells.astype(float), 5)
    assert np.array_equal(value, corner_values(cells, 5)) and not gradient.any()


def test_noise_is_spread_and_differs_by_seed():
    cells = np.stack(np.meshgrid(*[np.arange(-10, 10)] * 3), axis=-1).reshape(-1, 3)
    values = corner_values(cells, 0)
    assert np.abs(values).max() <= 1.0
    # Uniform in [-1, 1]: mean 0 and variance 1/3, within 4 sigma of 8000 values.
    assert abs(values.mean()) < 4 / math.sqrt(3 * 8000) and abs(values.var() - 1 / 3) < 4 * 0.298 / math.sqrt(8000)
    assert abs(np.corrcoef(values, corner_values(cells, 1))[0, 1]) < 4 / math.sqrt(8000)
    assert abs(np.corrcoef(values, corner_values(cells + np.array([1, 0, 0]), 0))[0, 1]) < 4 / math.sqrt(8000)


@settings(deadline=None)
@given(st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3), st.integers(0, 10**6), st.integers(0, 2))
def test_noise_is_bounded_and_smooth(place, seed, axis):
    """|noise| <= 1, and its slope within what the shader's longest_step() counts on (NOISE_SLOPE)."""
    q = np.array([place])
    gradient, value = noise(q, seed)
    assert abs(value[0]) <= 1.0
    assert np.linalg.norm(gradient) < 11.2
    shift = 1e-4 * np.eye(3)[axis]
    slope = (noise(q + shift, seed)[1] - noise(q - shift, seed)[1]) / 2e-4
    assert gradient[0, axis] == pytest.approx(slope[0], abs=1e-3)


# Grids


def test_a_constant_grid_is_constant_inside():
    """The splines add up to one."""
    model = REFRACTION(medium="grid", grid=np.full((8, 9, 10), 0.5), strength=0.4)
    force, n_squared = model.law.field(points(100, 0.5, 0.0))
    assert np.sqrt(n_squared) == pytest.approx(1.2, abs=1e-7) and np.abs(force).max() < 1e-6


def test_a_linear_grid_is_linear_inside_and_the_axes_are_not_mixed_up():
    """density = 1 + 0.1 x + 0.2 y + 0.3 z on unequal sides, (nz, ny, nx): a B-spline reproduces it (float32 voxels)."""
    low, high, size = np.array([-1.0, -2.0, -1.5]), np.array([1.5, 2.0, 1.0]), (16, 20, 12)
    x, y, z = (low[i] + (np.arange(size[i]) + 0.5) * (high[i] - low[i]) / size[i] for i in range(3))
    density = 1.0 + 0.1 * x[None, None, :] + 0.2 * y[None, :, None] + 0.3 * z[:, None, None]
    model = REFRACTION(medium="grid", grid=density, grid_min=low, grid_max=high, strength=1.0)
    at = points(100, 0.5, 0.0)
    force, n_squared = model.law.field(at)
    n = 2.0 + at @ [0.1, 0.2, 0.3]
    assert np.sqrt(n_squared) == pytest.approx(n, abs=1e-6)
    assert force == pytest.approx(n[:, None] * [0.1, 0.2, 0.3], abs=1e-5)


def test_a_grid_stays_within_the_range_of_its_densities():
    model = REFRACTION(medium="grid", grid=DENSITY, strength=1.0)
    n = np.sqrt(model.law.field(points(2000, 2.0, 0.0))[1])
    assert n.min() >= 1.0 and n.max() <= 1.0 + DENSITY.max()


def test_a_grid_goes_to_the_shader_in_rows_of_four():
    model = REFRACTION(medium="grid", grid=DENSITY, grid_min=(0, 0, 0), grid_max=(7, 12, 5))
    rows = model.textures()["u_grid"]
    assert rows.shape == (11, 12, 10, 4) and rows.dtype == np.float32
    for channel in range(4):
        assert np.array_equal(rows[3:-3, 3:-3, 3 - channel : 10 - channel, channel], DENSITY.astype(np.float32))
    assert rows.sum() == pytest.approx(4 * DENSITY.sum(), rel=1e-5)  # zeros around
    assert model.uniforms()["u_grid_cell"] == (1.0, 2.0, 1.0) and model.uniforms()["u_grid_min"] == (0.0, 0.0, 0.0)


def test_a_grids_texels_are_made_once():
    """A frame asks for them twice: for what they take in memory, and to upload them."""
    model = REFRACTION(medium="grid", grid=DENSITY)
    first, second = model.textures(), model.textures()
    assert all(first[name] is second[name] for name in ("u_grid", "u_still_blocks"))


def patchy_density():
    """Noise in one corner, a constant in another, nothing between; (nz, ny, nx)."""
    density = np.zeros((17, 14, 19), np.float32)
    density[:4, :5, :3] = np.random.default_rng(8).random((4, 5, 3))
    density[9:, 8:, 10:] = 0.7
    return density


def test_the_spline_is_constant_in_still_cells_and_in_no_other():
    density = patchy_density()
    sides = np.array(density.shape[::-1])
    model = REFRACTION(medium="grid", grid=density, grid_min=(0, 0, 0), grid_max=sides, strength=1.0)
    still = still_cells(density)
    assert still.shape == (20, 17, 22) and 0.2 < still.mean() < 0.9
    k, j, i = np.indices(still.shape).reshape(3, -1)
    steepest = np.zeros(still.size)
    for corner in np.random.default_rng(2).random((5, 3)):
        at = np.stack([i, j, k], axis=1) - 1.5 + corner  # the first cell is centred at voxel -1.5
        steepest = np.maximum(steepest, np.abs(model.law.field(at)[0]).max(axis=1))
    assert steepest[still.ravel()].max() < 1e-12 and steepest[~still.ravel()].min() > 1e-9


def test_still_blocks_are_counted_in_all_directions():
    """Each count against its definition: all blocks nearer than it are still, and one as far as it is not."""
    cells = still_cells(patchy_density())
    counts = still_blocks(patchy_density()).astype(int)
    moving = np.unique(np.argwhere(~cells) // 2, axis=0)
    for block in np.ndindex(counts.shape):
        assert counts[block] == np.abs(moving - block).max(axis=1).min()
    assert counts.max() >= 3
    assert (still_blocks(np.zeros((3, 3, 3))) == FARTHEST).all()


# What is refused, and how


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"medium": "grid"}, "'grid' has no densities"),
        ({"medium": "grid", "grid": np.zeros((4, 4))}, r"shape \(4, 4\)"),
        ({"medium": "grid", "grid": np.zeros((4, 0, 4))}, "three sides"),
        ({"medium": "grid", "grid": np.full((2, 2, 2), np.nan)}, "not finite"),
        ({"medium": "grid", "grid": "smoke"}, "no numbers"),
        ({"medium": "grid", "grid": DENSITY, "grid_min": (1, 1, 1)}, "is empty"),
        ({"medium": "grid", "grid": DENSITY, "grid_max": (1, 1)}, "'grid_max' is"),
        ({"medium": "grid", "grid": DENSITY, "grid_max": (1, 1, math.inf)}, "'grid_max' is"),
        ({"medium": "grid", "grid": DENSITY, "strength": -2.0}, "n must be positive"),
        ({"medium": "shell", "strength": -1.0}, "n must be positive"),
        ({"medium": "explosion", "strength": -0.9}, "n must be positive"),
        ({"medium": "explosion", "strength": 9.0, "rarefaction": 1.0}, "n must be positive"),
        ({"medium": "expression", "formula": "1 + q"}, "column 5: unknown name 'q'"),
        ({"medium": "expression", "formula": ""}, "column 1"),
        ({"medium": "expression", "formula": "1" * 2000}, "'formula'"),
        ({"medium": "vacuum"}, "'medium'"),
    ],
)
def test_unusable_values_are_refused_by_name(values, message):
    with pytest.raises(ParameterError, match=f"Model 'refraction': .*{message}"):
        REFRACTION(**values)


def test_other_media_do_not_mind_the_formula_or_the_grid():
    assert REFRACTION(medium="mirage", formula="1 +", grid="none")


@pytest.mark.parametrize(
    ("values", "position", "problem"),
    [
        ({"medium": "isotropic"}, (0.0, 0.0, 0.4), True),
        ({"medium": "isotropic"}, (0.0, 0.0, 0.6), False),
        ({"medium": "linear", "gradient": 0.5}, (0.0, 0.0, -2.1), True),
        ({"medium": "linear", "gradient": 0.5}, (0.0, 0.0, -1.9), False),
        ({"medium": "mirage"}, (0.0, 0.0, -4.0), True),
        ({"medium": "expression", "formula": "r - 1"}, (0.5, 0.0, 0.0), True),
        ({"medium": "expression", "formula": "1 / (x - x)"}, (0.5, 0.0, 0.0), True),
        ({"medium": "expression", "formula": "log(-1 - r)"}, (0.5, 0.0, 0.0), True),
        ({"medium": "luneburg"}, (0.0, 0.0, 0.0), False),
    ],
)
def test_no_camera_where_there_is_no_light(values, position, problem):
    found = REFRACTION(**values).observer_problem("chart", np.array(position))
    assert (found is not None) == problem
    if problem:
        assert "no light" in found and "Move the camera" in found


def test_a_formula_is_printed_with_its_gradient():
    model = REFRACTION(medium="expression", formula="2*x + y*t + r^2")
    ((_, text),) = model.generated()
    assert "p.x" in text and "typed_index(vec3 p, float t)" in text
    force, n_squared = model.law.field(np.array([[1.0, 2.0, 2.0]]))
    n = 2 + 2 + 9
    assert n_squared[0] == n**2 and force[0] == pytest.approx(n * (np.array([2, 1, 0]) + 2 * np.array([1, 2, 2])))


def test_snell_stepping_has_an_integrator_of_its_own():
    assert REFRACTION().own_integrator() is None
    assert REFRACTION(stepping="snell").own_integrator() == "snell"
    assert (SHADERS / "integrators" / "snell.glsl").is_file()


def test_where_a_medium_thins_out_the_length_of_v_does_not_count():
    """A ray whose |v| is off goes the same way: dx/dtau is n long, and v turns as fast."""
    model = MODELS_OF_ALL_MEDIA["fisheye"]
    x = points(50)
    states = model.initial_states(x, x[::-1] / np.linalg.norm(x[::-1], axis=1, keepdims=True))
    off = states * [1.0, 1.0, 1.0, 1.3, 1.3, 1.3]
    rates = model.rhs(off)
    assert rates[:, :3] == pytest.approx(model.rhs(states)[:, :3], rel=1e-14)
    assert rates[:, 3:] == pytest.approx(1.3 * model.rhs(states)[:, 3:], rel=1e-14)
