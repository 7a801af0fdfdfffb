"""Radial potentials against Kepler's hyperbolas, DOP853 in float64, and what they conserve."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.models import MODELS, ParameterError
from addon.core.scene import SceneError
from addon.core.settings import Settings
from addon.core.status import FAILURES, Status
from addon.core.trace import render, trace_rays
from tests.shaders import scenes
from tests.shaders.model_checks import (
    EPS,
    HIGH,
    all_finite,
    derivatives,
    errors,
    exact_end,
    on_gpu,
    parallel_rays,
    programs,
    states,
)
from tests.shaders.truth import integrate

TWO = ((0.0, 3.0, 0.5), (1.0, -3.0, -0.25))
KINDS = [
    {"xi": "cubic"},
    {"xi": "cubic", "strength": -0.2, "R": 12.0},
    {"xi": "coulomb"},
    {"xi": "coulomb", "k": -2.0},
    {"xi": "yukawa"},
    {"xi": "yukawa", "zeta": 1.0, "mu": 0.1},
    {"xi": "yukawa", "mu": 0.0},
    {"xi": "expression"},
    {"xi": "expression", "formula": "exp(-mu * r) * (strength * sin(R * r) - zeta / (1 + r)^2)"},
]


def potential(**values):
    return MODELS["radial_potential"](**values)


@pytest.mark.parametrize("centres", [None, TWO], ids=["one", "two"])
@pytest.mark.parametrize("values", KINDS, ids=str)
def test_right_hand_side(glsl, values, centres):
    """x - c rounds by eps (|x| + |c|), of which xi, which falls like r^-2 or e^(-mu r), makes (3 + mu r) / r; some 30
    operations and exp(), which GLSL gives to (3 + 2 mu r) eps, add to it. Sines round by eps of their argument.
    """
    model, given = potential(**values, centres=centres), states()
    found, exact = derivatives(glsl, model, given)
    assert np.array_equal(found[:, :3], given[:, 3:])
    x = given[:, :3].astype(float)
    bound = np.zeros(len(x))
    for centre in model.centres:
        r = np.linalg.norm(x - centre, axis=1)
        moved = (np.linalg.norm(x, axis=1) + np.linalg.norm(centre)) / r
        size = np.abs(model.force(r)) + abs(model.strength) * (1.0 if model.xi != "expression" else (1 + r) / r)
        bound += EPS * (30 + 3 * model.mu * r + (3 + model.mu * r) * moved) * size
    error = np.linalg.norm(found[:, 3:] - exact[:, 3:], axis=1)
    print(f"largest error, parts of its bound: {(error / bound).max():.2f}")
    assert (error <= bound).all()


@pytest.mark.parametrize("values", KINDS, ids=str)
def test_the_force_is_the_gradient_of_the_potential(glsl, values):
    """Which the shader knows for all kinds but a formula: the energy does not change along a float64 ray, nor does
    (x - c) cross v around the one centre. Rounding: 20 eps of the invariants' terms at both ends.
    """
    model = potential(**values, centres=[(1.0, 0.5, 0.0)])
    start = states(20, seed=3, nearest=4.0, farthest=40.0).astype(float)
    start[:, 3:] *= np.sign(np.sum(start[:, :3] * start[:, 3:], axis=1))[:, None]  # outward: nothing falls in
    end = np.array([integrate(model, state[None], 15.0)[0] for state in start])
    first, last = (
        on_gpu(glsl, model, "out_result = invariants(RayState(x.xyz, v.xyz));", s)["result"] for s in (start, end)
    )
    size = [1 + np.abs(s[:, :3]).max(axis=1) * np.linalg.norm(s[:, 3:], axis=1) for s in (start, end)]
    assert (np.abs(first - last).max(axis=1) <= 20 * EPS * np.add(*size)).all()
    assert np.abs(first).max() > 0.1


# Coulomb: Kepler's hyperbola in closed form


def hyperbola(k, position, direction):
    """Of f = -k x / r^3, from one of its states (float64, (3,) each): the eccentricity vector times k, A = v x L - k n
    (Laplace, Runge, Lenz), and L.
    """
    angular = np.cross(position, direction)
    return np.cross(direction, angular) - k * position / np.linalg.norm(position), angular


def asymptote(k, vector, angular):
    """n of the conic L^2 / r = k + n.A at its end, 1 / r = 0; (3,), unit."""
    size = np.linalg.norm(vector)
    along, across = vector / size, np.cross(angular, vector) / (np.linalg.norm(angular) * size)
    return -k / size * along + np.sqrt(1.0 - (k / size) ** 2) * across


@pytest.mark.parametrize("k", [1.0, -1.0, 0.1])
def test_coulomb_against_the_hyperbola(k):
    """Directions of the asymptotes, b from 0.3 to 50: there the conic L^2 / r = k + n.A has 1 / r = 0."""
    model = potential(xi="coulomb", k=k)
    b = np.geomspace(0.3, 50.0, 20)
    positions, directions = parallel_rays(b)
    ends = trace_rays(model, positions, directions, HIGH)
    exact = np.array(
        [
            asymptote(k, *hyperbola(k, x, d))
            for x, d in zip(positions.astype(float), directions.astype(float), strict=True)
        ]
    )
    error = np.linalg.norm(ends.direction - exact, axis=1)
    # The turn is 2 arctan(k / b) and changes by at most 2 k start / b^2 for a turn of the start; at least by 1.
    allowed = (HIGH.tolerance + EPS * ends.steps) * np.maximum(1.0, 2 * abs(k) * 20.0 / (b**2 + k**2))
    print(
        f"k = {k}: max {error.max():.2e}, median {np.median(error):.2e} rad, of its bound {(error / allowed).max():.2f}"
    )
    assert (ends.status == Status.ESCAPED).all() and (error <= allowed).all()


@pytest.mark.parametrize("k", [1.0, -1.0])
@pytest.mark.parametrize("pipeline", ["paper", "fused"])
def test_coulomb_turns_by_two_arctan(k, pipeline):
    """theta = 2 arctan(k / b) between the asymptotes where v is 1 at infinity. These rays have |v| = 1 at 1e5 lengths,
    so that v_inf^2 = 1 - 2 k / 1e5 and b_inf = b / v_inf: corrections of 2e-5 of the angle, and both are made. What is
    left are the turns before the start, k b / (2 * 1e10), and after the end.
    """
    far = 1e5
    b = np.array([0.5, 1.0, 2.0, 5.0, 10.0, 30.0])
    positions = np.stack([np.full(6, -far), b, np.zeros(6)], axis=1)
    directions = np.tile((1.0, 0.0, 0.0), (6, 1))
    settings = replace(HIGH, pipeline=pipeline)
    ends = trace_rays(potential(xi="coulomb", k=k), positions, directions, settings)
    turned = -np.arctan2(ends.direction[:, 1].astype(float), ends.direction[:, 0].astype(float))
    speed_squared = 1.0 - 2.0 * k / far
    expected = 2.0 * np.arctan(k / (np.sqrt(speed_squared) * b))  # k / (b_inf v_inf^2), with b_inf v_inf = b
    left = abs(k) * b / far**2
    error = np.abs(turned - expected)
    # b rounds by eps at each step, relative; the turn changes by 2 k / b of that at most, and is at most a right angle.
    allowed = left + (HIGH.tolerance + EPS * ends.steps) * np.maximum(1.0, 2.0 * abs(k) / b)
    print(
        f"k = {k}: {error.max():.2e} rad; to 2 arctan(k / b) itself {np.abs(turned - 2 * np.arctan(k / b)).max():.1e}"
    )
    assert (ends.status == Status.ESCAPED).all() and (error <= allowed).all()
    assert np.abs(turned - 2.0 * np.arctan(k / b)).max() < 1e-4


@pytest.mark.parametrize("centres", [None, TWO], ids=["one", "two"])
@pytest.mark.parametrize("values", [kind for kind in KINDS if kind.get("mu") != 0.0], ids=str)
def test_rays_against_float64(values, centres):
    model = potential(**values, centres=centres)
    ends, found, allowed = errors(
        model, *parallel_rays(np.geomspace(0.5, 15.0, 4 if values["xi"] == "expression" else 8))
    )
    print(f"max {found.max():.2e}, median {np.median(found):.2e} rad, of its bound {(found / allowed).max():.2f}")
    assert (ends.status == Status.ESCAPED).all() and all_finite(ends)
    assert (found <= allowed).all()


@pytest.mark.parametrize("values", KINDS, ids=str)
def test_energy_and_angular_momentum(values):
    """Their drift within 50 lengths, b from 1 to 15. Every step may turn v by a tenth of the tolerance, and rounds x
    and v by eps: of the products |x||v| <= 50 * 2 this makes 100 (0.1 tolerance + eps) a step, as a random walk.
    """
    model = potential(**values)
    b = np.geomspace(1.0, 15.0, 12)
    ends = trace_rays(model, *parallel_rays(b), replace(HIGH, escape_radius=50.0))
    allowed = 100 * (0.1 * HIGH.tolerance + EPS) * np.sqrt(ends.steps) / np.maximum(b, 0.5)
    print(f"drift max {ends.invariant_drift.max():.2e}, of its bound {(ends.invariant_drift / allowed).max():.2f}")
    assert (ends.invariant_drift <= allowed).all() and ends.invariant_drift.max() > 0


def test_energy_is_conserved_between_two_centres():
    ends = trace_rays(
        potential(xi="coulomb", k=0.3, centres=TWO),
        *parallel_rays(np.geomspace(1, 15, 12)),
        replace(HIGH, escape_radius=50.0),
    )
    # |v|^2 / 2 of at most 1, by eps and a tenth of the tolerance a step; the invariant itself is about 1/2.
    print(f"drift {ends.invariant_drift.max():.2e}")
    assert (ends.invariant_drift <= 4 * (0.1 * HIGH.tolerance + EPS) * ends.steps).all()


@pytest.mark.parametrize(
    "weak",
    [{"xi": "cubic", "strength": 0.0}, {"xi": "coulomb", "k": 0.0}, {"xi": "yukawa", "zeta": 0.0},
     {"xi": "expression", "formula": "0"}, {"xi": "expression", "k": 0.0}],
    ids=str,
)  # fmt: skip
def test_straight_limit(weak):
    positions, directions = parallel_rays(np.geomspace(0.2, 10.0, 16))
    ends = trace_rays(potential(**weak), positions, directions, HIGH)
    assert np.array_equal(ends.direction, directions) and (ends.status == Status.ESCAPED).all()


@pytest.mark.parametrize("weak", [{"xi": "cubic", "strength": 1e-9}, {"xi": "coulomb", "k": 1e-9}], ids=str)
def test_straight_limit_of_a_picture(weak):
    """The same hits, at the same depth: 1e-5 of the camera's distance of 8. A surface seen at a slant turns an error
    across the ray into a larger one along it, by 1 / cos, which the normal takes out.
    """
    settings = replace(HIGH, passes=("Status", "Position", "Normal"))
    straight, bent = (
        render(scenes.mixed(model), settings).passes for model in (scenes.STRAIGHT, potential(**weak, core_radius=1e-6))
    )
    hit = straight["Status"] == Status.HIT
    assert hit.sum() > 100 and np.array_equal(hit, bent["Status"] == Status.HIT)
    gap = np.linalg.norm(straight["Position"] - bent["Position"], axis=2)
    to_camera = np.array((0.0, -8.0, 1.0)) - straight["Position"]
    cosine = np.sum(straight["Normal"] * to_camera, axis=2) / np.linalg.norm(to_camera, axis=2)
    print(f"apart {gap[hit[..., 0]].max():.1e}, with the slant {(gap * cosine)[hit[..., 0]].max():.1e}")
    assert (gap * np.abs(cosine))[hit[..., 0]].max() < 8e-5


# Where the force is infinite

HEAD_ON = np.array([[-10.0, b, 0.0] for b in (0.0, 1e-6, 1e-3)])
SETTINGS = {
    "high": HIGH,
    "paper": Settings(),
    "verlet": Settings(integrator="verlet", tolerance=1e-4),
    "constant": Settings(integrator="runge_kutta_4", step_control="constant", step=0.01),
}


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"xi": "coulomb"}, Status.ABSORBED),
        ({"xi": "yukawa"}, Status.ABSORBED),
        ({"xi": "expression"}, Status.ABSORBED),
        ({"xi": "coulomb", "k": -1.0}, Status.ESCAPED),
        ({"xi": "yukawa", "zeta": 1.0}, Status.ESCAPED),
        ({"xi": "expression", "k": -1.0}, Status.ESCAPED),
        ({"xi": "cubic"}, Status.ESCAPED),
        ({"xi": "cubic", "strength": -1.0}, Status.ESCAPED),
    ],
    ids=str,
)
def test_head_on(values, expected, settings):
    """b = 0, 1e-6, 1e-3: absorbed where the force attracts, and turned back where it repels; numbers in any case."""
    ends = trace_rays(potential(**values), HEAD_ON, np.tile((1.0, 0, 0), (3, 1)), SETTINGS[settings])
    names = [Status(status).name for status in ends.status]
    print(f"{names}, steps {ends.steps}, drift {ends.invariant_drift}")
    assert all_finite(ends)
    if settings == "constant":  # a constant step may jump over the core: the drift of the energy shows it
        assert set(ends.status) <= {expected, Status.ESCAPED, *FAILURES}
    else:
        assert (ends.status == expected).all()
    if expected == Status.ESCAPED and values["xi"] != "cubic" and settings == "high":  # back, nearly the way it came
        for x, found, length in zip(HEAD_ON, ends.direction, ends.parameter.astype(float), strict=True):
            exact, _ = exact_end(potential(**values), x, np.array((1.0, 0, 0)), length)
            assert np.abs(found - exact).max() < 10 * HIGH.tolerance


def test_a_formula_too_steep_for_any_step_ends_in_a_named_failure():
    ends = trace_rays(
        potential(xi="expression", formula="k / r^9", core_radius=1e-6), HEAD_ON, np.tile((1.0, 0, 0), (3, 1)), HIGH
    )
    assert all_finite(ends) and set(ends.status) <= {Status.ABSORBED, *FAILURES}


def test_the_core_absorbs_what_comes_near():
    """A ray with b has its nearest point at r0 where b^2 = 2 r0^2 (E + k / r0), E = 1/2 - k / start."""
    core, k, start = 0.05, 1.0, 20.0
    energy = 0.5 - k / start
    b = np.sqrt(2 * core**2 * (energy + k / core)) * np.array([0.5, 0.9, 1.02, 1.5])
    positions = np.stack([np.full(4, -start), b, np.zeros(4)], axis=1)
    ends = trace_rays(potential(xi="coulomb", k=k, core_radius=core), positions, np.tile((1.0, 0, 0), (4, 1)), HIGH)
    assert ends.status.tolist() == [Status.ABSORBED] * 2 + [Status.ESCAPED] * 2


def test_no_step_jumps_over_a_far_ball():
    """Without a force before it, steps could grow past it."""
    model = potential(xi="cubic", R=1.0, strength=0.2, centres=[(0, 0, 0), (300, 0, 0)])
    positions, directions = np.array([[-5.0, 0.4, 0]]), np.array([[1.0, 0, 0]])
    _, found, allowed = errors(model, positions, directions)
    alone = trace_rays(potential(xi="cubic", R=1.0, strength=0.2), positions, directions, HIGH)
    straight_on = alone.position + alone.direction * 310
    assert np.linalg.norm(straight_on - (300, 0, 0)) > 1.0 and (found <= allowed).all()  # misses the second one
    aimed = potential(xi="cubic", R=1.0, strength=0.2, centres=[(300, 0.4, 0)])
    assert trace_rays(aimed, positions, [[1, 0.0005, 0]], HIGH).direction[0, 1] != np.float32(0.0005)


# Centres


def test_centres_move_and_multiply_without_compiling():
    rays = parallel_rays(np.array([1.0, 2.0]))
    settings = replace(HIGH, max_steps=500)  # as many as one draw takes: what goes on with a ray is another program
    places = np.random.default_rng(1).normal(size=(40, 3))
    for first, others in (([places[0]], [places[1]]), (places[:2], places)):  # one, and several: two programs
        trace_rays(potential(xi="coulomb", centres=first), *rays, settings)
        before = programs()
        trace_rays(potential(xi="coulomb", k=2.0, core_radius=0.1, centres=others), *rays, settings)
        assert programs() == before


def test_a_centre_may_lie_anywhere():
    """Moved with the rays, the same ends: coordinates of 300 round by 300 eps, seen from b = 2 that is 1e-5 rad."""
    rays = parallel_rays(np.array([2.0, 4.0]))
    shift = np.float32([100.0, -300.0, 50.0])
    here = trace_rays(potential(xi="yukawa"), *rays, HIGH)
    there = trace_rays(potential(xi="yukawa", centres=[shift]), rays[0] + shift, rays[1], HIGH)
    error = np.linalg.norm(here.direction - there.direction, axis=1)
    print(f"{error.max():.1e} rad")
    assert (error <= 300 * EPS / 2.0 * np.sqrt(here.steps) + HIGH.tolerance).all()


@pytest.mark.parametrize(
    "centres", [np.zeros((0, 3)), np.zeros(3), np.zeros((2, 2)), [[np.nan, 0, 0]], np.zeros((5000, 3))]
)
def test_unusable_centres_are_refused(centres):
    with pytest.raises(ParameterError, match=r"Model 'radial_potential': 'centres' .*\. (Choose|Move)"):
        potential(centres=centres)


def test_no_camera_in_a_core():
    scene = scenes.mixed(potential(xi="coulomb", centres=[(0.0, -8.0, 1.0)]))
    with pytest.raises(SceneError, match=r"within its core of 0\.001, where light is absorbed\. Move the camera"):
        render(scene, Settings())
    assert potential(xi="cubic").observer_problem("chart", np.zeros(3)) is None


# Formulas


def test_a_typed_force_is_the_built_in_one():
    """k / r^2 typed: the same directions, but for rounding and the fading beyond 800 lengths, k b / (2 * 800^2)."""
    rays = parallel_rays(np.geomspace(0.5, 15, 8))
    typed = trace_rays(potential(xi="expression", formula="k / r^2"), *rays, HIGH)
    built_in = trace_rays(potential(xi="coulomb"), *rays, HIGH)
    error = np.linalg.norm(typed.direction - built_in.direction, axis=1)
    # The tolerance and a rounding of 200 steps, both twice; the smallest b magnifies most, by 2 * 20 / (0.5^2 + 1).
    print(f"{error.max():.1e} rad")
    assert (error <= 2e-5).all()


def test_errors_in_a_formula_name_the_column():
    with pytest.raises(
        ParameterError, match=r"Model 'radial_potential': 'formula', column 5: unknown name 'q'. Known: r, k"
    ):
        potential(xi="expression", formula="k + q")
    assert potential(xi="coulomb", formula="k + q").xi == "coulomb"  # not used, and so no matter
