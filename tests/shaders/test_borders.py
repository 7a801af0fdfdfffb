"""Where a law is not smooth, or swallows light, is where a step ends: rims, fronts, jumps of n, horizons."""

import functools
import itertools

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.reference import true_ends
from addon.core.scene import Camera, Material, Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import render, trace_rays
from tests.shaders import scenes

REFRACTION = MODELS["refraction"]
PAPERS = {"pipeline": "paper", "integrator": "automatic", "step_control": "embedded", "segments": 2000}
PIPELINES = {"fused": {}, "paper": PAPERS}


def beam(b, start=10.0):
    """Rays along +X from x = -start, at the distances b from the X axis."""
    return np.stack([np.full(len(b), -start), b, 0 * b], axis=1), np.tile([1.0, 0.0, 0.0], (len(b), 1))


def turned_by(directions):
    """By how much rays of the beam are turned towards the axis, radians in (-pi, pi]."""
    directions = directions.astype(np.float64)
    return np.arctan2(-directions[:, 1], directions[:, 0])


def away(angles):
    """Of differences of angles, the nearest to 0."""
    return np.abs((angles + np.pi) % (2 * np.pi) - np.pi)


# Fronts


@functools.cache
def shell_turns(b, strength, thickness):
    """Of a ray that meets the unit ball behind a front at the impact parameter b: in float64, from Bouguer's
    n r sin = b, twice the angle from the turning point out to the front's outer side, and the straight rest, less pi.
    """
    outer = 1.0 + 0.5 * thickness

    def index(r):
        t = np.clip(0.5 - (r - 1.0) / thickness, 0.0, 1.0)
        return 1.0 + strength * t**3 * (t * (6.0 * t - 15.0) + 10.0)

    # The turning point is the outermost root of n r = b: found on a grid that is fine in the front, then by halving.
    grid = np.concatenate(
        [np.linspace(outer, 1.0 - 0.5 * thickness, 4001), np.linspace(1.0 - 0.5 * thickness, 0.0, 4001)]
    )
    first = np.flatnonzero(index(grid) * grid <= b)[0]
    low, high = grid[first], grid[max(first - 1, 0)]
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if index(middle) * middle > b else (middle, high)
    edges = [high, *(r for r in (1.0 - 0.5 * thickness, 1.0) if high < r < outer), outer]
    nodes, weights = np.polynomial.legendre.leggauss(400)
    angle = np.arcsin(b / outer)
    for begin, end in itertools.pairwise(edges):
        s = 0.5 * (nodes + 1.0)  # r = begin + (end - begin) s^2 takes the root at the turning point away
        r = begin + (end - begin) * s * s
        root = np.sqrt(np.maximum((index(r) * r) ** 2 - b * b, 1e-300))
        angle += np.sum(0.5 * weights * 2.0 * s * (end - begin) * b / (r * root))
    return 2.0 * angle - np.pi


IMPACTS = np.concatenate([np.linspace(0.05, 0.9, 40), [0.93, 0.96]])
THICKNESSES = (1e-1, 1e-2, 1e-3, 1e-4, 3e-5, 1e-5, 1e-6)


def test_a_shell_as_thin_as_nothing_is_snells_law():
    """The reference's own limit: 2 (arcsin b - arcsin (b / n)), and 2 arccos b where all light is reflected."""
    for b in (0.1, 0.5, 0.9):
        assert shell_turns(b, 0.5, 1e-9) == pytest.approx(2 * (np.arcsin(b) - np.arcsin(b / 1.5)), abs=1e-7)
    assert away(shell_turns(0.9, -0.3, 1e-9) + 2 * np.arccos(0.9)) < 1e-7


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("strength", [0.5, -0.3])
@pytest.mark.parametrize("thickness", THICKNESSES)
def test_fronts_of_every_thickness(thickness, strength, pipeline):
    """Within the promise, 1e-4 rad at the default, and no worse where the tolerance is tighter. Rays next to where
    total reflection begins, b = 1 + strength, are left out: there the angle changes without bound.
    """
    b = IMPACTS[np.abs(IMPACTS / (1.0 + strength) - 1.0) > 0.1]
    exact = np.array([shell_turns(one, strength, thickness) for one in b])
    model = REFRACTION(medium="shell", radius=1.0, strength=strength, thickness=thickness)
    for settings in ({}, {"tolerance": 1e-5}, {"integrator": "dormand_prince_54"}):
        chosen = Settings(**({**PIPELINES[pipeline], "tolerance": 5e-5} | settings))
        ends = trace_rays(model, *beam(b), chosen)
        error = away(turned_by(ends.direction) - exact)
        print(f"{thickness:g} {strength} {pipeline} {settings}: {error.max():.1e} rad, {ends.steps.max()} steps")
        assert set(ends.status) == {Status.ESCAPED}
        assert error.max() < 1e-4


@pytest.mark.parametrize("roughness", [0.0, 0.05])
@pytest.mark.parametrize("thickness", [1e-1, 1e-2, 1e-3])
def test_fronts_of_explosions(thickness, roughness):
    """Against DOP853, whose steps are no longer than a quarter of the front next to it."""
    blast = REFRACTION(medium="explosion", strength=0.3, thickness=thickness, roughness=roughness)
    x, d = beam(np.linspace(0.05, 0.9, 12), 2.0)
    ends = trace_rays(blast, x, d, Settings())
    exact = true_ends(blast, x, d)
    known = exact.uncertainty < 1e-5
    assert known.mean() > 0.8 and set(ends.status) == {Status.ESCAPED}
    assert np.linalg.norm(ends.direction - exact.direction, axis=1)[known].max() < 1e-4


# Rims


@pytest.mark.parametrize("integrator", ["automatic", "dormand_prince_54"])
def test_a_wall_behind_luneburgs_lens(integrator):
    """From 10 R away, the light that goes through the lens meets a wall next to its rim, at 1.001 R. In the lens the
    ray is an ellipse, x = x0 cos t + v0 sin t with R = 1: it ends where |x| = 1 again, and goes on straight.
    """
    size, half = 200, 0.11
    camera = Camera(scenes.look_at((-10.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (-half, half, -half, half), size, size)
    wall = np.array(
        [
            [[1.001, y, z] for y, z in corners]
            for corners in (((-50, -50), (50, -50), (50, 50)), ((-50, -50), (50, 50), (-50, 50)))
        ]
    )
    scene = Scene(
        camera, REFRACTION(medium="luneburg", radius=1.0), triangles=scenes.triangles(wall), materials=(Material(),)
    )
    passes = render(scene, Settings(integrator=integrator, passes=("Position", "Status"))).passes
    across = (np.arange(size) + 0.5) / size * 2 * half - half
    d = np.stack(np.broadcast_arrays(1.0, -across[None, :], across[:, None]), axis=-1).reshape(-1, 3)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = np.array([-10.0, 0.0, 0.0])
    along = -d @ o
    gap = np.linalg.norm(o + along[:, None] * d, axis=1)
    through = gap < 0.98
    x = o + (along - np.sqrt(np.maximum(1.0 - gap**2, 0.0)))[:, None] * d
    # Where |x| = 1 again, found by halving.
    low, high = np.full(len(d), 1e-3), np.full(len(d), np.pi)
    for _ in range(60):
        t = 0.5 * (low + high)
        at = x * np.cos(t)[:, None] + d * np.sin(t)[:, None]
        inside = np.sum(at**2, axis=1) < 1.0
        low, high = np.where(inside, t, low), np.where(inside, high, t)
    at = x * np.cos(t)[:, None] + d * np.sin(t)[:, None]
    v = -x * np.sin(t)[:, None] + d * np.cos(t)[:, None]
    ahead = through & (v[:, 0] > 0.05)
    exact = at + ((1.001 - at[:, 0]) / v[:, 0])[:, None] * v
    hit = (passes["Status"][..., 0] == Status.HIT).ravel()
    assert hit[ahead].all() and ahead.mean() > 0.5
    # The tolerance as a length on the wall: the way from the camera, over the cosine at which the wall is met.
    error = np.linalg.norm(passes["Position"].reshape(-1, 3) - exact, axis=1)[ahead]
    bound = Settings().tolerance * 11.0 / v[ahead, 0]
    print(f"{integrator}: {error.max():.1e}, {(error / bound).max():.2f} of the bound")
    assert (error < bound).all()


# Jumps

STEP_LENS = ("1 + step(r, 70) * exp(-r^2/4900)", "1 + (0.5 + 0.5*sign(70 - r)) * exp(-r^2/4900)")
LENS_TURNS = np.radians([0.61065, 12.24584, 37.60245, 66.65273])  # b = 0.5, 10, 30, 50; physics.md, 5
LENS_IMPACTS = np.array([0.5, 10.0, 30.0, 50.0])


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("formula", STEP_LENS)
def test_a_typed_index_that_jumps_refracts(formula, pipeline):
    model = REFRACTION(medium="expression", formula=formula, grain=10.0)
    ends = trace_rays(model, *beam(LENS_IMPACTS, 600.0), Settings(**PIPELINES[pipeline], tolerance=1e-5))
    assert away(turned_by(ends.direction) - LENS_TURNS).max() < 1e-5 + np.radians(1e-5)  # the table's last digit
    assert ends.invariant_drift.max() < 1e-5


def test_the_papers_default_refracts_at_a_jump():
    """Euler with step doubling: the jump is Snell's, the rest Euler's, of first order (0.4 of 67 degrees)."""
    model = REFRACTION(medium="expression", formula=STEP_LENS[0], grain=10.0)
    ends = trace_rays(model, *beam(LENS_IMPACTS, 600.0), Settings(pipeline="paper", segments=5000))
    assert away(turned_by(ends.direction) - LENS_TURNS).max() < np.radians(0.5)


@pytest.mark.parametrize("pipeline", ["fused", "paper"])
def test_snells_steps_refract_at_a_jump(pipeline):
    """n is constant on both sides, so that the straight steps between are exact, and what is left is the jump."""
    model = REFRACTION(medium="expression", formula="1 + 0.5 * step(r, 1)", grain=0.1, stepping="snell")
    b = np.array([0.1, 0.4, 0.7, 0.9])
    ends = trace_rays(model, *beam(b, 3.0), Settings(pipeline=pipeline, segments=2000, step=0.05))
    assert away(turned_by(ends.direction) - 2 * (np.arcsin(b) - np.arcsin(b / 1.5))).max() < 1e-5


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_layers_of_a_floor_refract_one_by_one(pipeline):
    """n = 1.4 - 0.1 floor(4 r), r < 1: four layers. Through each, Bouguer's n r sin = b; the turns are Snell's."""
    model = REFRACTION(medium="expression", formula="1 + step(r, 1) * 0.1 * (4 - floor(4 * r))", grain=0.1)
    b = np.array([0.05, 0.2, 0.3, 0.45, 0.62, 0.9])
    exact = np.zeros(len(b))
    for i, one in enumerate(b):
        before = 1.0
        for radius, n in ((1.0, 1.1), (0.75, 1.2), (0.5, 1.3), (0.25, 1.4)):
            if one / (before * radius) >= 1.0:
                break  # it passes by this layer
            exact[i] += 2 * (np.arcsin(one / (before * radius)) - np.arcsin(min(one / (n * radius), 1.0)))
            before = n
    ends = trace_rays(model, *beam(b, 3.0), Settings(**PIPELINES[pipeline]))
    assert away(turned_by(ends.direction) - exact).max() < 1e-5


@pytest.mark.parametrize("integrator", ["automatic", "dormand_prince_54", "bogacki_shampine_32", "rosenbrock_32"])
@pytest.mark.parametrize("grain", [0.1, 30.0, 300.0])
def test_a_step_that_leaves_the_formulas_domain_is_taken_back(grain, integrator):
    """n^2 = 1.2 - 0.02 |z| has no root beyond |z| = 60; the ray, parabolas, stays within 5."""
    model = REFRACTION(medium="expression", formula="sqrt(1.2 - 0.02*abs(z))", grain=grain)
    ends = trace_rays(model, [[0, 0, 5]], [[1, 0, 0]], Settings(integrator=integrator, escape_radius=200.0))
    assert ends.status[0] == Status.ESCAPED


def test_a_typed_force_without_a_value_takes_the_step_back():
    model = MODELS["custom"](fx="0", fy="0", fz="-z * sqrt(9 - z^2)", reach=100.0)
    ends = trace_rays(model, [[0, 0, 1.0]], [[1, 0, 0.5]], Settings())
    assert ends.status[0] == Status.ESCAPED


# Horizons

HOLES = {
    "schwarzschild": (MODELS["schwarzschild"](), lambda x: np.linalg.norm(x, axis=1) / 2.0),
    "isotropic": (REFRACTION(medium="isotropic"), lambda x: np.linalg.norm(x, axis=1) / 0.505),
    **{
        f"kerr {spin}": (
            MODELS["kerr"](spin=spin),
            lambda x, spin=spin: MODELS["kerr"](spin=spin).radius(x) / MODELS["kerr"](spin=spin).horizon,
        )
        for spin in (0.0, 0.9, 1.0)
    },
}
METHODS = {
    "default": {},
    "1e-2": {"tolerance": 1e-2},
    "euler": {"integrator": "euler", "step_control": "constant", "step": 0.5},
    "runge-kutta": {"integrator": "runge_kutta_4", "step_control": "constant", "step": 0.5},
    "paper": {"pipeline": "paper", "segments": 1000},
    "paper, embedded": {**PAPERS, "tolerance": 1e-3},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("hole", HOLES)
def test_nothing_is_hit_inside_a_horizon(hole, method):
    """Random triangles, many of which go through it."""
    model, radius = HOLES[hole]
    generator = np.random.default_rng(7)
    corners = generator.uniform(-3, 3, (40, 1, 3)) + generator.normal(scale=1.5, size=(40, 3, 3))
    camera = Camera(scenes.look_at((0.0, -26.0, 12.0), (0.0, 0.0, 0.0)), (-0.2, 0.2, -0.2, 0.2), 80, 80)
    scene = Scene(camera, model, triangles=scenes.triangles(corners), materials=(Material(),))
    passes = render(scene, Settings(passes=("Position", "Status"), **METHODS[method])).passes
    hit = passes["Status"][..., 0] == Status.HIT
    assert hit.sum() > 500
    assert radius(passes["Position"][hit].astype(np.float64)).min() > 1.0 - 1e-6


@pytest.mark.parametrize("tolerance", [5e-5, 1e-3])
@pytest.mark.parametrize("hole", ["schwarzschild", "kerr 0.9"])
def test_a_floor_through_a_horizon_has_a_smooth_edge(hole, tolerance):
    """A square through the centre: it is seen where it is at a much tighter tolerance. A pixel at its edge flips where
    the edge is within the tolerance of the pixel's centre: of the pixels at edges, 2 tolerance / pixel may.
    """
    model, _ = HOLES[hole]
    square = np.array([[[-9, -9, 0], [9, -9, 0], [9, 9, 0]], [[-9, -9, 0], [9, 9, 0], [-9, 9, 0]]], float)
    camera = Camera(scenes.look_at((0.0, -26.0, 12.0), (0.0, 0.0, 0.0)), (-0.25, 0.25, -0.25, 0.25), 160, 160)
    scene = Scene(camera, model, triangles=scenes.triangles(square), materials=(Material(),))
    seen, fine = (
        render(scene, Settings(passes=("Status",), tolerance=one)).passes["Status"][..., 0] for one in (tolerance, 1e-6)
    )
    edge = (fine[1:, :] != fine[:-1, :]).sum() + (fine[:, 1:] != fine[:, :-1]).sum()
    pixel = 0.5 / 160
    print(f"{hole} {tolerance}: {(seen != fine).sum()} pixels of {edge} at edges")
    assert (seen != fine).sum() <= max(2 * tolerance / pixel * edge, 2)


CONSTANT = {"euler": "euler", "verlet": "verlet", "runge-kutta": "runge_kutta_4"}


@pytest.mark.parametrize("control", ["constant", "doubling"])
@pytest.mark.parametrize("pipeline", ["fused", "paper"])
@pytest.mark.parametrize("integrator", CONSTANT)
@pytest.mark.parametrize("hole", ["schwarzschild", "isotropic"])
def test_absorbed_is_absorbed_whatever_the_methods_step(hole, integrator, pipeline, control):
    """Rays within the photon sphere that go inwards; n of the isotropic medium is 800 at its horizon, and no step of
    0.05 M is short there.
    """
    model, _ = HOLES[hole]
    generator = np.random.default_rng(3)
    inwards = generator.normal(size=(200, 3))
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    aside = np.cross(inwards, generator.normal(size=(200, 3)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    x = -1.8 * inwards if hole == "isotropic" else -2.9 * inwards
    slant = np.radians(generator.uniform(0, 60, (200, 1)))
    d = np.cos(slant) * inwards + np.sin(slant) * aside
    settings = Settings(pipeline=pipeline, integrator=CONSTANT[integrator], step_control=control, segments=2000)
    assert set(trace_rays(model, x, d, settings).status) == {Status.ABSORBED}
