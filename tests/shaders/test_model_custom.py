"""Typed forces: every function on the GPU, a Coulomb law beside the built-in one, errors, stiff damping."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from addon.core.expressions import FUNCTIONS, GLSL_FILE, parse
from addon.core.models import MODELS, ParameterError
from addon.core.settings import Settings
from addon.core.status import FAILURES, Status
from addon.core.trace import render, trace_rays
from tests.shaders import scenes
from tests.shaders.model_checks import EPS, HIGH, all_finite, derivatives, errors, parallel_rays, programs, states

COULOMB = {"fx": "-k * x / r^3", "fy": "-k*y/r**3", "fz": "-k*z/(r*r*r)"}
EVERYTHING = {
    "fx": "kappa * sin(x) - vy * wind / (1 + r^2) + t",
    "fy": "-2^-2 * exp(-abs(y)) + min(vx, vz) * step(0, z) * pi",
    "fz": "atan2(y, x) + clamp(z, -1, kappa) - sqrt(r) * 1e-2",
}
VALUES = {"kappa": 0.7, "wind": -1.5}


def custom(**values):
    return MODELS["custom"](**values)


# Formulas on the GPU

TINY = 8 * EPS
ATAN = 5e-6  # radians: what Mesa's polynomial has, and asin and acos are made of it
FORMULAS = {  # formula in a and b -> error that is allowed, for a in [-4, 4], b in [-2, 2]
    "sin(a)": TINY,
    "cos(a)": TINY,
    "tan(b / 2)": 8 * TINY,
    "asin(b / 2)": ATAN,
    "acos(b / 2)": ATAN,
    "atan(a)": ATAN,
    "atan2(a, b)": ATAN,
    "sinh(a)": 30 * TINY,
    "cosh(a)": 30 * TINY,
    "tanh(30 * a)": TINY,
    "exp(a)": 60 * TINY,
    "log(abs(a) + 0.01)": 4 * TINY,
    "sqrt(abs(a))": TINY,
    "sign(a) + sign(0)": 0.0,
    "floor(a)": 0.0,
    "min(a, b) + 0": 0.0,
    "max(a, b)": 0.0,
    "step(a, b)": 0.0,
    "clamp(a, -1, 0.5)": 0.0,
    "a^2": 16 * EPS,
    "a^3": 200 * EPS,
    "a^-3 / (1 + a^-4)": TINY,
    "a^7 / 4^7": 10 * EPS,
    "(-2)^floor(a)": 16 * TINY,
    "abs(a)^b": 300 * TINY,
    "0^abs(b) + a^0": TINY,
    "pow(a, 2) - a*a": 16 * EPS,
    "-a^2 + 2^3^0.5 - 1e-5": 40 * EPS,
    "e + pi": TINY,
}


def test_every_function_is_run():
    assert set(FUNCTIONS) <= {name for name in FUNCTIONS if any(f"{name}(" in text for text in FORMULAS)}


@pytest.mark.parametrize("text", FORMULAS)
def test_functions_of_the_shader(glsl, text):
    """Against numpy on the same float32 numbers: what GLSL gives or some multiplications round, a few eps of the value.

    OpenGL does not say how good sin, atan or exp are; this is what Mesa has, and enough for a picture.
    """
    generator = np.random.default_rng(2)
    a = np.append(generator.uniform(-4, 4, 500), [0.5, -0.5, 1.0, -1.0, 2.0, -3.0]).astype(np.float32)
    b = np.append(generator.uniform(-2, 2, 500), [2.0, -2.0, 0.0, -1.0, 1.0, 1.5]).astype(np.float32)
    tree = parse(text, "ab")
    found = glsl(
        [GLSL_FILE], f"out_result = vec4({tree.glsl({'a': 'a.x', 'b': 'b.x'})});", {"a": a[:, None], "b": b[:, None]}
    )
    exact = tree.numpy({"a": a, "b": b})
    error = np.abs(found["result"][:, 0] - exact)
    print(f"{text}: {error.max():.1e}")
    assert error.max() <= FORMULAS[text]


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [(-2, 3, -8), (-2, 2, 4), (0, 0, 1), (5, 0, 1), (0, 2, 0), (0, -1, np.inf), (-2, 0.5, np.nan), (-1, -3, -1)],
)
def test_powers_at_their_edges(glsl, a, b, expected):
    """As numpy has them, with whole exponents that the shader does not know beforehand, too."""
    found = glsl([GLSL_FILE], "out_result = vec4(formula_power(a.x, b.x));", {"a": [[a]], "b": [[b]]})["result"][0, 0]
    with np.errstate(all="ignore"):
        assert np.array_equal(np.power(float(a), float(b)), expected, equal_nan=True)
    assert found == pytest.approx(expected, rel=1e-6, nan_ok=True)


def test_right_hand_side(glsl):
    """Sums of some ten numbers of at most 60; sines of arguments up to 60 round by eps of them."""
    model = custom(**EVERYTHING, time=0.25, parameters=VALUES)
    found, exact = derivatives(glsl, model, states())
    error = np.abs(found - exact).max()
    print(f"{error:.1e}")
    assert error <= 30 * 60 * EPS


def test_the_reach_ends_the_force(glsl):
    """From 0.8 to 1 of the reach it fades; d fade / dr is 1.5 / (0.2 reach), so that r's rounding makes 7.5 eps."""
    model = custom(fx="1", fy="r", fz="-x", reach=30.0)
    given = states(farthest=90.0)
    found, exact = derivatives(glsl, model, given)
    assert np.abs(found - exact).max() <= 30 * 20 * EPS
    r = np.linalg.norm(given[:, :3], axis=1)
    assert not found[r > 30.001, 3:].any() and (found[r < 23.999, 3] == 1.0).all()


# The Coulomb law, typed


def test_a_typed_coulomb_law_against_float64():
    ends, found, allowed = errors(custom(**COULOMB, parameters={"k": 1.0}), *parallel_rays(np.geomspace(0.3, 15, 5)))
    print(f"max {found.max():.2e}, median {np.median(found):.2e} rad")
    assert (ends.status == Status.ESCAPED).all() and (found <= allowed).all()


def test_a_typed_coulomb_law_gives_the_picture_of_the_built_in_one():
    """The same rays hit, at the same places; both end at 50 lengths. At k = 0.1 and b > 0.1 a ray that is wrong by 1e-5
    misses by 1e-4 at the 8 lengths of the camera; pixels that see the singular point (b < 0.3) are left out.
    """
    options = replace(HIGH, passes=("Status", "Position", "Combined"), escape_radius=50.0)
    typed = custom(**COULOMB, parameters={"k": 0.1}, reach=100.0)
    built_in = MODELS["radial_potential"](xi="coulomb", k=0.1)
    first, second = (render(scenes.mixed(model), options).passes for model in (typed, built_in))
    same = first["Status"] == second["Status"]
    hit = same & (first["Status"] == Status.HIT)
    gap = np.abs(first["Position"] - second["Position"]).max(axis=2, keepdims=True)
    print(
        f"{(~same).sum()} of {same.size} pixels end differently; {hit.sum()} hits, {gap[hit].max():.1e} apart at most"
    )
    assert hit.sum() > 100 and (~same).sum() <= 2 and np.quantile(gap[hit], 0.99) < 1e-4


@pytest.mark.parametrize("options", [HIGH, Settings(), Settings(step_control="constant")], ids=["high", "paper", "h"])
@pytest.mark.parametrize("k", [1.0, -1.0])
def test_head_on(k, options):
    """A typed force has no core: what falls into its singularity ends in a named failure."""
    positions = np.array([[-10.0, b, 0.0] for b in (0.0, 1e-6, 1e-3)])
    ends = trace_rays(custom(**COULOMB, parameters={"k": k}), positions, np.tile((1.0, 0, 0), (3, 1)), options)
    print([Status(status).name for status in ends.status])
    assert all_finite(ends) and set(ends.status) <= {Status.ESCAPED, *FAILURES}


@pytest.mark.parametrize(
    "force", ["1 / 0", "sqrt(-1)", "log(-r)", "1e30 * 1e30", "exp(exp(r))", "-1e30 * x", "tan(1e30 * x)"]
)
def test_hopeless_forces_end_in_a_named_status(force):
    for options in (HIGH, Settings(), Settings(step_control="constant")):
        ends = trace_rays(custom(fx=force, fy="0", fz=force), *parallel_rays(np.array([0.5, 2.0])), options)
        assert all_finite(ends) and set(ends.status) <= {Status.ESCAPED, *FAILURES}


# Values and time


def test_values_and_time_compile_nothing():
    rays = parallel_rays(np.array([1.0, 2.0]))
    model = custom(**EVERYTHING, parameters=VALUES)
    first = trace_rays(model, *rays, HIGH)
    before = programs()
    later = trace_rays(custom(**EVERYTHING, time=2.0, parameters={"kappa": 0.1, "wind": 9.0}), *rays, HIGH)
    assert programs() == before and not np.array_equal(first.direction, later.direction)
    assert custom(fx="x").generated() != model.generated()


def test_time_moves_the_force():
    """A force of t along Y on rays along X: y' = t tau where nothing fades, at tau = 10."""
    options = Settings(
        integrator="runge_kutta_4", step_control="constant", step=0.125, segments=1, steps_per_segment=80
    )
    for time in (0.0, 0.5, 2.0):
        ends = trace_rays(custom(fx="0", fy="t / 100", fz="0", time=time), [[0, 0, 0]], [[1, 0, 0]], options)
        assert ends.position[0, 1] == pytest.approx(0.5 * time / 100 * 100, rel=100 * EPS)


@pytest.mark.parametrize(
    "name", ["float", "input", "half", "u_time", "s", "v", "texel", "K", "a1", "gl_x", "main", "RayState"]
)
def test_names_that_mean_something_in_glsl_are_usable(name):
    model = custom(fx=f"{name} * x / (1 + r^2)", parameters={name: -1.0})
    ends = trace_rays(model, *parallel_rays(np.array([1.0])), Settings(segments=2))
    assert all_finite(ends)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from([*FUNCTIONS, "x", "vy", "r", "t", "k", "(", ")", "+", "-", "*", "/", "^", ",", "2"]),
        max_size=30,
    )
)
def test_whatever_parses_compiles_and_ends(words):
    try:
        model = custom(fx="".join(words), parameters={"k": 0.5})
    except ParameterError:
        return
    assert all_finite(trace_rays(model, *parallel_rays(np.array([0.5, 3.0])), Settings(segments=3)))


# Errors


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"fy": "x + foo"}, r"'fy', column 5: unknown name 'foo'\. Known: x, y, z, vx, vy, vz, r, t, k, pi"),
        ({"fz": ""}, r"'fz', column 1: a number, a name or '\(' is needed"),
        ({"fx": "x" * 1001}, r"'fx' must be a text of at most 1000 characters"),
        ({"parameters": {"1a": 1.0}}, r"'1a' cannot be a parameter's name"),
        ({"parameters": {"a__b": 1.0}}, "cannot be a parameter's name"),
        ({"parameters": {"a;}void": 1.0}}, "cannot be a parameter's name"),
        ({"parameters": {"ä": 1.0}}, "cannot be a parameter's name"),
        ({"parameters": {"a" * 33: 1.0}}, "cannot be a parameter's name"),
        ({"parameters": {3: 1.0}}, "cannot be a parameter's name"),
        ({"parameters": {"r": 1.0}}, "parameter 'r' has the name of something else"),
        ({"parameters": {"pow": 1.0}}, "parameter 'pow' has the name of something else"),
        ({"parameters": {"k": np.nan}}, "parameter 'k' is nan, not a number"),
        ({"parameters": {"k": "much"}}, "parameter 'k' is 'much', not a number"),
        ({"parameters": {f"k{i}": 1.0 for i in range(17)}}, "17 named parameters, but 16 are allowed"),
        ({"parameters": 3}, "'parameters' must map names to numbers"),
    ],
)
def test_errors_name_the_component_and_the_column(values, words):
    with pytest.raises(ParameterError, match=rf"^Model 'custom': .*{words}"):
        custom(**{"parameters": {"k": 1.0}} | values)


# Stiff damping: f = -kappa v, so that x ends at x0 + d / kappa


@pytest.mark.parametrize("kappa", [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6])
def test_stiff_damping(kappa):
    """A ray from 1 length beside the centre comes to rest 1 / kappa farther on, or ends in a failure that says so.

    Every step is wrong by up to a tenth of the tolerance, as an angle seen from the centre, and by eps.
    """
    model = custom(**{f"f{axis}": f"-kappa * v{axis}" for axis in "xyz"}, parameters={"kappa": kappa})
    ends = trace_rays(model, [[0, 1, 0]], [[1, 0, 0]], HIGH)
    error = np.linalg.norm(ends.position[0] - (1 / kappa, 1, 0))
    print(f"kappa = {kappa:g}: {Status(ends.status[0]).name}, {ends.steps[0]} steps, {error:.1e} from where it rests")
    assert all_finite(ends) and ends.status[0] in FAILURES
    rested = ends.parameter[0] * kappa > 20
    assert not rested or error <= (0.1 * HIGH.tolerance + EPS) * ends.steps[0]
