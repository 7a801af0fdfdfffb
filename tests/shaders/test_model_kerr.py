"""Kerr on the GPU against closed forms and float64: Bardeen 1973, Boyer and Lindquist's equatorial integral, DOP853."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from addon.core.models import MODELS
from addon.core.report.stability import kerr_outline
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.core.test_kerr import constants, points
from tests.shaders import scenes, truth

EPS = 2.0**-24
FINE = Settings(integrator="dormand_prince_54", step_control="embedded", tolerance=1e-6, escape_radius=1e5)
SPINS = [0.0, 0.5, 0.9, -0.9, 0.998, 1.0]
FAR = 1e5  # where rays begin and escape, M: the field's rest of M b / r^2 is below float32's last digit


def given(kerr, n=1000, seed=5):
    """States outside the horizon with momenta of all sizes, in float32's numbers."""
    x = points(kerr, n, seed, nearest=1.1, farthest=200.0)
    p = np.random.default_rng(seed).normal(size=x.shape)
    return np.concatenate([x, p], axis=1).astype(np.float32)


def beam(b, distance=FAR):
    """Parallel rays along +x in the equator, at y = b."""
    b = np.asarray(b, float)
    positions = np.stack([np.full_like(b, -distance), b, 0 * b], axis=1)
    return positions, np.tile([1.0, 0.0, 0.0], (len(b), 1))


def equatorial_deflection(a, b):
    """Radians: 2 int dphi/dr dr - pi of a photon with L / E = b about a mass of 1, Boyer and Lindquist:

    dphi/dr = (b - a + a (r^2 + a^2 - a b) / Delta) / sqrt(R),   R = r^4 + (a^2 - b^2) r^2 + 2 (a - b)^2 r

    with r = r0 / (1 - t^2), which takes the root out of R.
    """
    quartic = np.array([1.0, 0.0, a * a - b * b, 2.0 * (a - b) ** 2, 0.0])
    roots = np.roots(quartic)
    r0 = max(root.real for root in roots if abs(root.imag) < 1e-9)
    for _ in range(5):  # Newton
        r0 -= np.polyval(quartic, r0) / np.polyval(np.polyder(quartic), r0)
    rest = np.polydiv(quartic, [1.0, -r0])[0]

    def rate(t):
        r = r0 / (1 - t * t)
        delta = r * r - 2 * r + a * a
        angle = b - a + a * (r * r + a * a - a * b) / delta
        return angle / np.sqrt(np.polyval(rest, r) * r0 / (1 - t * t)) * 2 * r0 / (1 - t * t) ** 2

    return 2 * abs(quad(rate, 0, 1, epsabs=1e-12, epsrel=1e-12, limit=400)[0]) - np.pi


def turned(ends):
    """Radians that rays of beam() were turned by in the equator, modulo 2 pi."""
    return np.arctan2(ends.direction[:, 1].astype(float), ends.direction[:, 0].astype(float))


def off_circle(angle):
    return np.abs(np.mod(angle + np.pi, 2 * np.pi) - np.pi)


@pytest.mark.parametrize("spin", SPINS)
def test_right_hand_side_is_float64s(glsl, spin):
    """Some 100 rounded operations; the horizon's nearness does not enter, since nothing in these coordinates is
    singular there. p's gradient is a sum of terms as large as e^2 M / r^2 with e <= 2 |p|.
    """
    model = MODELS["kerr"](spin=spin)
    states = given(model)
    found = glsl(
        ["models/kerr"],
        "RayState d = rhs(RayState(x.xyz, v.xyz)); out_dx = vec4(d.x, 0.0); out_dv = vec4(d.v, 0.0);",
        {"x": states[:, :3], "v": states[:, 3:]},
        ("dx", "dv"),
        {"u_mass": 1.0, "u_spin": spin},
    )
    exact = model.rhs(states.astype(float))
    p = np.linalg.norm(states[:, 3:].astype(float), axis=1)
    r = model.radius(states[:, :3].astype(float))
    dx = np.linalg.norm(found["dx"][:, :3] - exact[:, :3], axis=1) / (100 * EPS * p)
    dv = np.linalg.norm(found["dv"][:, :3] - exact[:, 3:], axis=1) / (100 * EPS * 12 * p * p / r**2)
    print(f"a = {spin}: dx {dx.max():.2f}, dp {dv.max():.2f} of their bounds")
    assert dx.max() <= 1 and dv.max() <= 1


def test_horizon_and_axis_are_regular(glsl):
    """At r = r+ exactly, inside, on the axis, and at the centre of a mass that is not there: no NaN."""
    x = [[0, 0, 1.4358899], [1.6945, 0, 0], [0, 0, 1.0], [0, 0, -3.0], [1.2, 0, 0.1], [0, 0, 1e-3], [1e6, 1e6, -1e6]]
    for mass in (1.0, 0.0):
        body = "RayState d = rhs(RayState(x.xyz, vec3(0.6, 0.0, 0.8))); out_result = vec4(d.x + d.v, finite(d.v));"
        found = glsl(["models/kerr"], body, {"x": x}, uniforms={"u_mass": mass, "u_spin": 0.9})["result"]
        assert np.isfinite(found).all()


def test_without_spin_the_deflection_is_darwins():
    """Float32's floor of some 200 steps, 5e-7 each at worst, magnified near b_c as 1 / (b / b_c - 1)."""
    b = np.array([5.2, 5.25, 5.3, 5.5, 6.0, 8.0, 10.0, 30.0, 100.0, 1000.0])
    ends = trace_rays(MODELS["kerr"](spin=0.0), *beam(b), FINE)
    assert (ends.status == Status.ESCAPED).all()
    error = off_circle(-turned(ends) - np.array([truth.darwin(value) for value in b]))
    bound = 5e-7 / np.minimum(b / truth.CRITICAL - 1, 0.1)
    for values in zip(b, error, bound, strict=True):
        print("b = {:g} M: {:.1e} rad, bound {:.1e}".format(*values))
    assert (error <= bound).all()
    assert error[b >= 5.5].max() <= 1e-5


@pytest.mark.parametrize("spin", [0.5, 0.9, 0.998])
def test_equatorial_deflection_on_both_sides(spin):
    """At y > 0 the light that arrives came around with the hole: b = +y. Away from b+ and b- by 5 %.

    physics.md: 100 eps times the condition number, which near b+ of a fast hole is some tens.
    """
    near = critical_impacts(spin)
    b = np.concatenate([near[0] * np.geomspace(1.05, 60, 12), near[1] * np.geomspace(1.05, 30, 12)])
    ends = trace_rays(MODELS["kerr"](spin=spin), *beam(b), FINE)
    assert (ends.status == Status.ESCAPED).all()
    expected = np.array([equatorial_deflection(spin, value) for value in b]) * -np.sign(b)
    error = off_circle(turned(ends) - expected)
    condition = 1 + np.abs(b * slope(spin, b))
    for part in (slice(0, 12), slice(12, 24)):
        worst = np.argmax(error[part])
        print(
            f"a = {spin}: worst at b = {b[part][worst]:.3f} M, {error[part][worst]:.1e} rad, "
            f"bound {100 * EPS * condition[part][worst]:.1e}; largest part of its bound "
            f"{(error / (100 * EPS * condition))[part].max():.2f}"
        )
    assert (error <= 100 * EPS * condition).all()
    assert error[condition < 10].max() <= 1e-5


def slope(a, b):
    """d(deflection)/db, radians / M."""
    step = 1e-4
    return np.array([(equatorial_deflection(a, x + step) - equatorial_deflection(a, x - step)) / (2 * step) for x in b])


def critical_impacts(a):
    """b+ and b- of the circular photon orbits, Bardeen 1973: b = (r^2 + a^2)... at r = 2 (1 + cos(2/3 acos(-+a)))."""
    impacts = []
    for sign in (1, -1):
        r = 2 * (1 + np.cos(2 / 3 * np.arccos(-sign * a)))
        impacts.append(sign * 3 * np.sqrt(r) - a if r > 1 else 2.0)
    return impacts


def test_the_closed_form_is_bardeens():
    assert critical_impacts(0.9) == pytest.approx([2.844421, -6.832319], abs=1e-6)


@pytest.mark.parametrize("spin", [0.5, 0.9, -0.9, 0.998])
def test_capture_boundary_is_bardeens(spin):
    """Three rounds of 64 rays each, down to 16 / 64^3 = 6e-5 M; physics.md asks for 5e-4 M."""
    sense = np.sign(spin)
    low, high = np.array([0.0, 0.0]), np.array([16.0, 16.0])
    for _ in range(3):
        ladder = low[:, None] + (high - low)[:, None] * (np.arange(64) + 0.5) / 64
        rays = (ladder * sense * np.array([[1], [-1]])).ravel()
        ends = trace_rays(MODELS["kerr"](spin=spin), *beam(rays, 1000.0), FINE)
        inside = (ends.status == Status.ABSORBED).reshape(2, 64).sum(axis=1)
        low, high = low + (high - low) * (inside - 0.5) / 64, low + (high - low) * (inside + 0.5) / 64
    # From r = 1000 the chart's y is not yet L / E: both of the ray's first state.
    model = MODELS["kerr"](spin=spin)
    found = sense * np.array([1, -1]) * (low + high) / 2
    positions, directions = beam(found, 1000.0)
    energy, around, _ = constants(model, model.initial_states(positions, directions)).T
    error = np.abs(-around / energy - sense * np.array(critical_impacts(abs(spin))))
    print(f"a = {spin}: b+ {-around[0] / energy[0]:+.5f}, b- {-around[1] / energy[1]:+.5f}, off {error.max():.1e} M")
    assert error.max() <= 1.5e-4


@pytest.mark.parametrize("spin", [0.9, 1.0])
def test_principal_null_rays_are_straight(spin):
    """Ingoing ones, p = -l, on and off the axis, equator included; they end on the line that they began on. Rounding of
    some 60 steps of positions of 50 M.
    """
    model = MODELS["kerr"](spin=spin)
    generator = np.random.default_rng(6)
    positions = generator.normal(size=(60, 3))
    positions[:5, :2] = 0.0
    positions[5:10, 2] = 0.0
    positions *= 50 / np.linalg.norm(positions, axis=1, keepdims=True)
    positions = positions.astype(np.float32).astype(float)
    directions = -model.fields(positions)[1]
    ends = trace_rays(model, positions, directions, FINE)
    assert (ends.status == Status.ABSORBED).all()
    way = ends.position - positions
    off = np.linalg.norm(np.cross(way, directions), axis=1).max()
    angle = np.linalg.norm(np.cross(ends.direction, directions), axis=1).max()
    print(f"a = {spin}: off the line {off:.1e} M, direction {angle:.1e} rad; bounds {60 * 50 * EPS:.1e}, 1e-5")
    assert off <= 60 * 50 * EPS
    assert angle <= 1e-5


@pytest.mark.parametrize("spin", [0.9, 0.998])
def test_rays_keep_energy_spin_and_carter(spin):
    """E, L_z and the root of Carter's K, as a part of the largest: float32's floor of a few hundred steps. H = 0 holds
    by construction, as E is the root of it.
    """
    model = MODELS["kerr"](spin=spin)
    generator = np.random.default_rng(7)
    aim = generator.uniform(-9, 9, (400, 3))
    aim = aim[np.linalg.norm(aim, axis=1) > 7.5]
    positions = np.tile([-30.0, 6.0, 8.0], (len(aim), 1))
    ends = trace_rays(model, positions, aim - positions, Settings(**{**vars(FINE), "escape_radius": 100.0}))
    assert (ends.status != Status.NOT_FINITE).all()
    print(f"a = {spin}: drift median {np.median(ends.invariant_drift):.1e}, largest {ends.invariant_drift.max():.1e}")
    assert np.median(ends.invariant_drift) <= 2e-6
    assert ends.invariant_drift.max() <= 2e-4


@pytest.mark.parametrize("spin", [0.0, 0.9, 0.998])
def test_rays_agree_with_float64(spin):
    """All directions around the hole that escape, against DOP853 far out; the near-critical ones (E of theirs magnified
    by more than 100) are left to the capture tests.
    """
    model = MODELS["kerr"](spin=spin)
    generator = np.random.default_rng(8)
    aim = generator.normal(size=(60, 3))
    aim *= generator.uniform(7.5, 20, (60, 1)) / np.linalg.norm(aim, axis=1, keepdims=True)
    positions = np.tile(np.float32([-30.0, 6.0, 8.0]), (60, 1)).astype(float)
    way = np.cross(aim, positions) / 30
    directions = (way / np.linalg.norm(way, axis=1, keepdims=True) * np.linalg.norm(aim, axis=1)[:, None]) - positions
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    ends = trace_rays(model, positions, directions, Settings(**{**vars(FINE), "escape_radius": 200.0}))
    assert (ends.status == Status.ESCAPED).all()
    errors = []
    for row in range(60):
        d = directions[row].astype(float)
        start = model.initial_states(positions[row : row + 1], (d / np.linalg.norm(d))[None])[0]
        solved = solve_ivp(lambda t, s: model.rhs(s[None])[0], (0, 1e9), start, "DOP853", rtol=1e-11, atol=1e-12)
        errors.append(np.linalg.norm(model.ray_directions(solved.y[:, -1:].T)[0] - ends.direction[row]))
    print(f"a = {spin}: median {np.median(errors):.1e}, largest {max(errors):.1e} rad; bound 1e-5")
    assert max(errors) <= 1e-5


# Shadows

CAMERA = 1000.0
PIXEL = 16.0 / 1024 / CAMERA  # radians: 1024 pixels across 16 M


def captured(a, xi, eta):
    """Whether a ray from far away with these constants meets no turning point: no root of
    R = (r^2 + a^2 - a xi)^2 - Delta (eta + (xi - a)^2) beyond the horizon.
    """
    result = np.empty(len(xi), bool)
    horizon = 1 + np.sqrt(max(1 - a * a, 0))
    for i, (x, q) in enumerate(zip(xi, eta, strict=True)):
        roots = np.roots([1, 0, a * a - x * x - q, 2 * (q + (x - a) ** 2), -a * a * q])
        real = roots.real[np.abs(roots.imag) < 1e-10 * np.maximum(np.abs(roots), 1)]
        result[i] = not (real > horizon * (1 + 1e-9)).any()
    return result


def view(inclination, angles):
    """Camera at `inclination` from the axis, and for every angle of the image the direction across the view's axis."""
    place = np.array([np.sin(inclination), 0.0, np.cos(inclination)])
    right, up = np.array([0.0, 1.0, 0.0]), np.array([-np.cos(inclination), 0.0, np.sin(inclination)])
    return CAMERA * place, -place, np.cos(angles)[:, None] * right + np.sin(angles)[:, None] * up


def edge(inside, rows, low, high, rounds=4, rungs=16):
    """Radii, radians, at which `inside(rows of angle tangents)` ends, for each row; by repeated division."""
    low, high = np.full(rows, low), np.full(rows, high)
    for _ in range(rounds):
        ladder = low[:, None] + (high - low)[:, None] * (np.arange(rungs) + 0.5) / rungs
        count = inside(ladder).sum(axis=1)
        low, high = low + (high - low) * (count - 0.5) / rungs, low + (high - low) * (count + 0.5) / rungs
    return (low + high) / 2


def static_directions(model, position, n):
    """Chart directions, unit, of directions n of the observer at rest: by the symmetric root of his metric, from its
    eigenvectors. float64.
    """
    f, l_i, _, _ = model.fields(position[None])
    metric = np.eye(3) + f[0] / (1 - f[0]) * np.outer(l_i[0], l_i[0])
    values, vectors = np.linalg.eigh(metric)
    d = n @ (vectors / np.sqrt(values)) @ vectors.T
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


@pytest.mark.parametrize("spin", [0.0, 0.5, 0.9, 0.998, 0.9999, 1.0])
def test_shadow_outline(spin):
    """32 directions each of four inclinations, seen by an observer at rest at 1000 M, in pixels of 1024 across 16 M:
    against the roots of the radial equation for the same observer, and against Bardeen's curve for an observer at
    infinity, which is larger by about M / r = 0.001 of 340 pixels.
    """
    model = MODELS["kerr"](spin=spin)
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False) + 0.01
    inclinations = np.radians([5.0, 30.0, 60.0, 90.0] if spin < 0.999 else [0.0, 90.0])
    rows = 32 * len(inclinations)
    settings = Settings(**{**vars(FINE), "observer": "static", "escape_radius": 1100.0, "segments": 3000})
    views = [view(inclination, angles) for inclination in inclinations]

    def rays(ladder):
        blocks = ladder.reshape(len(views), 32, -1)
        n = [
            ahead + block[..., None] * across[:, None] for (_, ahead, across), block in zip(views, blocks, strict=True)
        ]
        n = np.stack(n)
        place = np.stack([np.broadcast_to(place, n.shape[1:]) for place, _, _ in views])
        return place.reshape(-1, 3), (n / np.linalg.norm(n, axis=-1, keepdims=True)).reshape(-1, 3)

    def seen(ladder):
        ends = trace_rays(model, *rays(ladder), settings)
        assert np.isin(ends.status, (Status.ABSORBED, Status.ESCAPED, Status.STEP_LIMIT)).all()
        # The rungs crowd around the outline; what still winds when the steps run out (at a = 1) is near it.
        assert (ends.status == Status.STEP_LIMIT).mean() < 0.1
        return (ends.status != Status.ESCAPED).reshape(ladder.shape)

    def true(ladder):
        place, n = rays(ladder)
        result = np.empty(len(n), bool)
        for spot in np.unique(place, axis=0):
            of = (place == spot).all(axis=1)
            d = static_directions(model, spot, n[of])
            energy, around, carter = constants_on_axis(model, model.initial_states(place[of], d)).T
            result[of] = captured(spin, -around / energy, carter / energy**2)
        return result.reshape(ladder.shape)

    found = edge(seen, rows, 0.0, 8.0 / CAMERA, 4) / PIXEL
    exact = edge(true, rows, 0.0, 8.0 / CAMERA, 4) / PIXEL
    error = np.abs(found - exact).reshape(len(views), 32).max(axis=1)
    off_infinity = []
    for inclination, row in zip(inclinations, found.reshape(len(views), 32), strict=True):
        bardeen = kerr_outline.outline(spin, inclination, angles)
        off_infinity.append(np.abs(row * PIXEL * CAMERA - bardeen).max() / (PIXEL * CAMERA))
    print(f"a = {spin}: off by {np.round(error, 3)} pixels, from Bardeen's at infinity {np.round(off_infinity, 3)}")
    assert error.max() <= 0.5
    assert max(off_infinity) <= 1.0


def constants_on_axis(model, states):
    """constants(), and Q = K - (L_z - a E)^2 with K from its regular form, so that the axis is no special place."""
    x, p = states[:, :3], states[:, 3:]
    a, r = model.traced_a, model.radius(x)
    energy = model.energies(states)
    around = x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0]
    sine_squared = (x[:, 0] ** 2 + x[:, 1] ** 2) / (r * r + a * a)
    k = r * r * np.sum(p * p, axis=1) - np.sum(x * p, axis=1) ** 2 + a * a * (p[:, 0] ** 2 + p[:, 1] ** 2)
    k += -2 * a * energy * around + (a * energy) ** 2 * sine_squared
    return np.stack([energy, around, k - (around - a * energy) ** 2], axis=1)


def test_the_side_that_comes_towards_the_camera_is_the_flat_one():
    """From the equator, axis up: a hole that turns counter-clockwise, seen from above, comes nearer on the left."""
    position, ahead, _ = view(np.pi / 2, np.zeros(1))
    settings = Settings(**{**vars(FINE), "observer": "static", "escape_radius": 1100.0})
    left = np.array([0.0, -1.0, 0.0])  # right is view()'s +y
    x = np.array([4.0, -4.0])
    ends = trace_rays(MODELS["kerr"](spin=0.9), np.tile(position, (2, 1)), ahead + x[:, None] / CAMERA * left, settings)
    assert list(ends.status) == [Status.ESCAPED, Status.ABSORBED]


# Ways that end well


def in_the_other_chart(model, positions, directions):
    """The same places and ways of light, in the equator, in the chart of the hole that turns the other way: from
    ingoing to outgoing Kerr-Schild coordinates. x + iy = (r + ia) e^(i phi), phi_out = phi_in - 2 int a / Delta dr.
    """
    a = model.traced_a
    w, w_dot = (values[:, 0] + 1j * values[:, 1] for values in (positions.astype(float), directions.astype(float)))
    r = np.sqrt(np.abs(w) ** 2 - a * a)
    phase = w / (r + 1j * a)
    turning = w_dot / phase
    phi_dot = turning.imag / r
    r_dot = turning.real + a * phi_dot
    outer, inner = model.horizon, 2 - model.horizon
    phase = phase / np.abs(phase) * np.exp(-2j * a * np.log((r - outer) / (r - inner)) / (outer - inner))
    phi_dot = phi_dot - 2 * a / (r * r - 2 * r + a * a) * r_dot
    w, w_dot = (r - 1j * a) * phase, (r_dot + a * phi_dot + 1j * r * phi_dot) * phase
    w_dot /= np.abs(w_dot)
    return tuple(np.stack([values.real, values.imag, 0 * r], axis=1) for values in (w, w_dot))


@pytest.mark.parametrize("spin", [0.9, 0.998])
def test_forward_and_back(spin):
    """The way back of light runs about the hole that turns the other way, in whose chart the end is put. The way there
    is off by some roundings times its condition number, an angle that 300 M turn into an impact parameter, and the way
    back turns that by the deflection's slope into an angle. Places and ways are compared at radii of 300 M and more,
    between which the chart's twist turns a ray by 2aM/r^2.
    """
    b = np.array([-30.0, -12.0, -9.0, 5.0, 8.0, 30.0])
    settings = Settings(**{**vars(FINE), "escape_radius": 300.0})
    model, turned_round = MODELS["kerr"](spin=spin), MODELS["kerr"](spin=-spin)
    there = trace_rays(model, *beam(b, 300.0), settings)
    left = truth.directions_there(model, there.position, there.direction)
    end, way = in_the_other_chart(model, there.position, left)
    back = trace_rays(turned_round, end, -way, settings)
    left = truth.directions_there(turned_round, back.position, back.direction)
    end, way = in_the_other_chart(turned_round, back.position, left)
    # Where the way back meets the plane that the rays began in.
    met = end[:, 1] - (end[:, 0] + 300.0) / way[:, 0] * way[:, 1]
    angle, gap = np.linalg.norm(way + np.array([1.0, 0.0, 0.0]), axis=1), np.abs(met - b)
    steep = np.abs(slope(spin, b))
    bound = 40 * EPS * (1 + np.abs(b) * steep) * (1 + 300.0 * steep) + 2 * spin / 300.0**2
    print(f"a = {spin}: direction {angle.max():.1e} rad, b {gap.max():.1e} M; {(angle / bound).max():.2f} of the bound")
    assert (back.status == Status.ESCAPED).all()
    assert (angle <= bound).all() and (gap <= 300.0 * bound).all()


@pytest.mark.parametrize("spin", [0.9999, 1.0, -1.0])
@pytest.mark.parametrize("place", [(0.0, 0.0, 20.0), (20.0, 0.0, 0.0), (0.0, 0.0, 1.1), (2.4, 0.0, 0.0)])
def test_near_extremal_rays_are_finite_and_named(spin, place):
    n = np.random.default_rng(9).normal(size=(500, 3))
    settings = Settings(**{**vars(FINE), "observer": "static", "escape_radius": 100.0})
    ends = trace_rays(MODELS["kerr"](spin=spin), np.tile(place, (500, 1)), n, settings)
    for values in (ends.position, ends.direction, ends.parameter, ends.invariant_drift, ends.error):
        assert np.isfinite(values).all()
    assert np.isin(ends.status, (Status.ESCAPED, Status.ABSORBED, Status.STEP_LIMIT)).all()
    assert (ends.status == Status.STEP_LIMIT).mean() < 0.02


@pytest.mark.parametrize("mass", [0.0, 1e-9])
def test_without_mass_rays_are_straight(mass):
    positions, directions = beam(np.linspace(-5, 5, 20), 50.0)
    ends = trace_rays(
        MODELS["kerr"](mass=mass), positions, directions, Settings(**{**vars(FINE), "escape_radius": 100.0})
    )
    assert (ends.status == Status.ESCAPED).all()
    assert np.abs(ends.direction - directions).max() <= 1e-6


def test_a_camera_in_the_ergosphere():
    """The falling observer at r = 1.6 M in the equator, r+ = 1.436 M: some rays have E < 0, none of them escapes, and
    everything is named."""
    model = MODELS["kerr"](spin=0.9)
    n = np.random.default_rng(10).normal(size=(1000, 3))
    place = np.tile([np.sqrt(1.6**2 + 0.81), 0.0, 0.0], (1000, 1))
    ends = trace_rays(model, place, n, Settings(**{**vars(FINE), "observer": "falling", "escape_radius": 100.0}))
    assert np.isin(ends.status, (Status.ESCAPED, Status.ABSORBED)).all()
    assert 0.05 < (ends.status == Status.ESCAPED).mean() < 0.95


def test_a_neutron_star_is_met_before_its_horizon():
    """A sphere of radius 4 M around Schwarzschild's and Kerr's hole: no ray is absorbed; near rays hit it."""
    star = scenes.spheres([[0.0, 0.0, 0.0]], [4.0])
    b = np.linspace(-12, 12, 49)
    for name, values in (("schwarzschild", {}), ("kerr", {"spin": 0.5})):
        model = MODELS[name](**values)
        scene = scenes.Scene(scenes.camera(), model, spheres=star)
        ends = trace_rays(model, *beam(b, 50.0), Settings(**{**vars(FINE), "escape_radius": 60.0}), scene=scene)
        assert np.isin(ends.status, (Status.HIT, Status.ESCAPED)).all()
        hit = ends.status == Status.HIT
        assert hit[np.abs(b) < 5].all() and not hit[np.abs(b) > 8].any()
        assert np.abs(np.linalg.norm(ends.position[hit], axis=1) - 4).max() < 1e-3
        # A ray that grazes r = R has b = R (1 - 2M / R)^(-1/2) = 5.657 M in Schwarzschild.
        if name == "schwarzschild":
            assert hit.tolist() == (np.abs(b) < 4 / np.sqrt(0.5)).tolist()
