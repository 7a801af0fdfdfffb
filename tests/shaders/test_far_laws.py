"""Where a law ends: what bends a ray beyond the sphere within which steps are taken, on the way in and out.

The truth is float64 from where the ray begins to where nothing is left to bend it, or a closed form. Rays begin at
places and in directions that float32 holds exactly, so that their ends are held to the tolerance. Only what winds
around a throat magnifies a rounding of the impact parameter by more than that: `condition` says by how much.
"""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from addon.core.models import MODELS
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.shaders.truth import at_infinity

EPS = 2.0**-24
DEFAULT, TIGHT = Settings(), Settings(tolerance=1e-5)
PAPER = Settings(
    pipeline="paper", integrator="dormand_prince_54", step_control="embedded", tolerance=1e-5, segments=2000
)
EVERY = pytest.mark.parametrize("settings", [DEFAULT, TIGHT, PAPER], ids=["default", "tight", "paper"])


def beam(r, impacts):
    """Rays along +x from x = -r at y = b: positions and directions, float64, (n, 3), of float32's numbers."""
    b = np.asarray(impacts, np.float32).astype(float)
    positions = np.stack([np.full(len(b), -float(r)), b, 0.0 * b], axis=1)
    return positions, np.tile([1.0, 0.0, 0.0], (len(b), 1))


def angles_of(directions):
    return np.arctan2(directions[:, 1].astype(float), directions[:, 0].astype(float))


def check(what, model, rays, true, settings, condition=0.0):
    """true : directions, (n, 3);  condition : (n,), radians an impact parameter's relative error"""
    ends = trace_rays(model, *rays, settings)
    errors = 2.0 * np.arcsin(0.5 * np.linalg.norm(ends.direction - true, axis=1))
    bound = settings.tolerance + 8 * EPS * np.abs(condition)
    print(f"\n{what}, tolerance {settings.tolerance:g}:")
    for b, error, estimate in zip(rays[0][:, 1], errors, ends.error, strict=True):
        print(f"  b = {b:g}: {error:.1e} rad, estimate {estimate:.1e}")
    assert (ends.status == Status.ESCAPED).all()
    assert (errors <= bound).all()


def binet(r, b):
    """The direction far away of a ray from (-r, b) along +x past M = 1: u'' = 3 u^2 - u in float64 until u = 0."""

    def end(phi, state):
        return state[0]

    end.terminal, end.direction = True, -1
    radius = np.hypot(r, b)
    rate = [1.0 / radius, r / (radius * b)]  # du/dphi = -(dr/dtau) / h
    orbit = solve_ivp(
        lambda phi, state: [state[1], 3.0 * state[0] ** 2 - state[0]],
        (0.0, 30.0),
        rate,
        "DOP853",
        rtol=1e-13,
        atol=1e-18,
        events=end,
    )
    angle = np.arctan2(b, -r) - orbit.t_events[0][0]  # the ray goes around clockwise
    return [np.cos(angle), np.sin(angle), 0.0]


@EVERY
@pytest.mark.parametrize("r", [15.0, 1e3, 1e5, 1e6])
def test_schwarzschild(r, settings):
    impacts = [b for b in (6.0, 20.0, 100.0, 1e3, 1e4, 1e5, 1e6) if b <= r]
    true = np.array([binet(r, b) for b in impacts])
    check(f"from {r:g} M", MODELS["schwarzschild"](mass=1.0), beam(r, impacts), true, settings)


@EVERY
@pytest.mark.parametrize(("r", "impacts"), [(1e4, [6.0, 100.0, 1100.0, 1e4]), (3000.0, [8.0, 999.0, 1000.0, 1001.0])])
def test_kerr_without_spin(r, impacts, settings):
    true = np.array([binet(r, b) for b in impacts])
    check(f"from {r:g} M", MODELS["kerr"](mass=1.0, spin=0.0), beam(r, impacts), true, settings)


@pytest.mark.parametrize("settings", [DEFAULT, TIGHT], ids=["default", "tight"])
@pytest.mark.parametrize("spin", [0.9, -1.0])
@pytest.mark.parametrize(("r", "impacts"), [(15.0, [-8.0, 8.0, 12.0]), (1e4, [-8.0, 8.0, 100.0, -1100.0, 1e4])])
def test_kerr(r, impacts, spin, settings):
    """In the equator and, turned about x, above it."""
    model = MODELS["kerr"](mass=1.0, spin=spin)
    x, d = beam(r, impacts)
    x = np.concatenate([x, x[:, [0, 2, 1]]])
    d = np.concatenate([d, d])
    check(f"spin {spin} from {r:g} M", model, (x, d), at_infinity(model, x, d), settings)


@pytest.mark.parametrize("r", [300.0, 1000.0, 3000.0])
def test_what_leaves_keeps_turning(r):
    """Rays that begin beyond the sphere and leave: no step is taken, and what is left is the closed form's. The chart's
    own twist at 300 M is 2 a M / r^2 = 2e-5 rad.
    """
    model = MODELS["kerr"](mass=1.0, spin=1.0)
    d = np.random.default_rng(1).normal(size=(12, 3))
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32).astype(float)
    x = np.tile(np.float32([0.6 * r, 0.48 * r, 0.64 * r]), (12, 1)).astype(float)
    d *= np.sign(np.sum(x * d, axis=1))[:, None]
    ends = trace_rays(model, x, d, replace(DEFAULT, escape_radius=0.9 * r))
    errors = np.linalg.norm(ends.direction - at_infinity(model, x, d), axis=1)
    print(f"\nfrom {r:g} M: {errors.max():.1e} rad, estimates {ends.error.min():.1e} to {ends.error.max():.1e}")
    assert not ends.steps.any() and (errors <= ends.error + 4 * EPS).all()
    assert ends.error.max() < DEFAULT.tolerance * (300.0 / r) ** 2 * 4


def through_the_throat(r, y, b=1.0):
    """The direction far away, in the chart of its side, of a ray from (-r, y) along +x, in the isotropic chart; and how
    it changes with y / y. dphi = h dl / sqrt((b^2 + l^2) (b^2 + l^2 - h^2)), Morris and Thorne 1988.
    """

    def end(y):
        rho = mpmath.sqrt(mpmath.mpf(r) ** 2 + y**2)
        h, begin = (1 + b * b / (4 * rho**2)) * y, rho - b * b / (4 * rho)
        whole = mpmath.ellipk(b * b / h**2) if h > b else h / b * mpmath.ellipk(h**2 / b**2)  # to the middle, each
        before = mpmath.quad(  # in w = 1 / l
            lambda w: h / mpmath.sqrt((1 + b * b * w * w) * (1 + (b * b - h * h) * w * w)), [0, 1 / begin]
        )
        return mpmath.atan2(y, -r) - (2 * whole - before)

    angle = end(mpmath.mpf(y))
    steep = y * (end(mpmath.mpf(y) * (1 + mpmath.mpf(1e-6))) - angle) / (y * mpmath.mpf(1e-6))
    return [float(mpmath.cos(angle)), float(mpmath.sin(angle)), 0.0], float(steep)


@EVERY
@pytest.mark.parametrize(
    ("r", "impacts"),
    [(10.0, [0.5, 0.9, 1.1, 3.0]), (1e3, [0.9, 0.99, 1.1, 10.0, 100.0, 1e3]), (1e5, [0.9, 0.99, 50.0])],
)
def test_wormhole(r, impacts, settings):
    true, condition = zip(*[through_the_throat(r, float(np.float32(y))) for y in impacts], strict=True)
    check(f"from {r:g} b", MODELS["wormhole"](), beam(r, impacts), np.array(true), settings, np.array(condition))


@EVERY
@pytest.mark.parametrize(("r", "impacts"), [(15.0, [7.0, 10.0]), (1e5, [6.0, 20.0, 100.0, 1e3, 1e4, 1e5])])
def test_isotropic(r, impacts, settings):
    model = MODELS["refraction"](medium="isotropic", mass=1.0)
    rays = beam(r, impacts)
    check(f"from {r:g} M", model, rays, at_infinity(model, *rays), settings)


def asymptote(k, x, d):
    """Of f = -k x / r^3, |v| = 1 at x: the conic's end, L^2 / r = k + n.A = 0; (3,), unit."""
    angular = np.cross(x, d)
    vector = np.cross(d, angular) - k * x / np.linalg.norm(x)
    size = np.linalg.norm(vector)
    across = np.cross(angular, vector) / (np.linalg.norm(angular) * size)
    return -k / size * vector / size + np.sqrt(1.0 - (k / size) ** 2) * across


@EVERY
@pytest.mark.parametrize("k", [1.0, -1.0, 0.1])
@pytest.mark.parametrize(("r", "impacts"), [(100.0, [1.0, 50.0, 100.0]), (1e4, [5.0, 50.0, 1e3, 1e4])])
def test_coulomb(r, impacts, k, settings):
    rays = beam(r, impacts)
    true = np.array([asymptote(k, *ray) for ray in zip(*rays, strict=True)])
    check(f"k = {k:g} from {r:g}", MODELS["radial_potential"](xi="coulomb", k=k), rays, true, settings)


def test_coulombs_centres_together():
    """Two charges: their sum at their middle, and the quadrupole moment that this leaves out is in the estimate."""
    model = MODELS["radial_potential"](xi="coulomb", k=0.5, centres=[[10.0, 0.0, 0.0], [30.0, 5.0, 0.0]])
    rays = beam(100.0, [20.0, 50.0, 100.0])
    check("two centres", model, rays, at_infinity(model, *rays), TIGHT)


def circle_missing(x, d, image):
    """How far, model lengths, the fisheye's ray (R = 1) through x along d, a circle through x and -x / |x|^2, passes
    the image. float64, (3,) each.
    """
    normal = np.cross(x, d)
    inward = np.cross(normal, d) / np.linalg.norm(normal)  # in the ray's plane, across d
    other = -x / (x @ x) - x
    radius = other @ other / (2.0 * (inward @ other))
    off = image - (x + radius * inward)
    height = off @ normal / np.linalg.norm(normal)
    return np.hypot(height, np.sqrt(off @ off - height**2) - abs(radius))


@pytest.mark.parametrize("tolerance", [5e-5, 1e-5, 1e-6])
@pytest.mark.parametrize("angle", [7.5, 10.0, 30.0, 80.0])
def test_fisheye_rays_that_swing_far_out_come_back(angle, tolerance):
    """From (0.5, 0, 0), out to 14 R at 10 degrees and 19 R at 7.5, until they have passed the image at (-2, 0, 0).
    There a radian of a ray's direction, and of where it is on the sphere that the fisheye maps, is (1 + 2^2) / 2 R.
    """
    model = MODELS["refraction"](medium="fisheye", radius=1.0)
    turned = np.radians(angle)
    d = np.array([[np.cos(turned), np.sin(turned), 0.0]]).astype(np.float32).astype(float)
    for steps in range(4, 300):
        ends = trace_rays(model, [[0.5, 0.0, 0.0]], d, Settings(tolerance=tolerance, max_steps=steps))
        x = ends.position[0].astype(float)
        if x[1] < 0.0:
            break
    assert x[1] < 0.0
    miss = circle_missing(x, ends.direction[0].astype(float), np.array([-2.0, 0.0, 0.0]))
    print(f"\n{angle:g} degrees, {tolerance:g}: {miss:.1e} R after {steps} steps, estimate {ends.error[0]:.1e}")
    assert miss <= 2.5 * (2.0 * tolerance + 8 * EPS * steps)


@pytest.mark.parametrize("mu", [0.0, 1e-3])
def test_yukawa_of_a_long_range(mu):
    """Its sphere grows with its range, until r xi is 1e-6 rad."""
    model = MODELS["radial_potential"](xi="yukawa", zeta=-1.0, mu=mu)
    rays = beam(100.0, [10.0, 50.0, 100.0])
    check(f"mu = {mu:g}", model, rays, at_infinity(model, *rays), TIGHT)
