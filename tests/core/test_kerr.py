"""The float64 Kerr and wormhole equations against the metric, differences and closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from addon.core.models import MODELS, ParameterError
from addon.core.scene import SceneError
from addon.core.settings import Settings, SettingsError
from addon.core.trace import check
from tests.shaders import scenes

SPINS = [0.0, 0.5, 0.9, -0.9, 0.998, 1.0]


def points(model, n=200, seed=1, nearest=1.05, farthest=50.0):
    """Places outside the horizon, some on the axis, some on the equator."""
    generator = np.random.default_rng(seed)
    cosine, phi = generator.uniform(-1, 1, n), generator.uniform(0, 2 * np.pi, n)
    cosine[:10], cosine[10:20] = 1.0, 0.0
    r = np.geomspace(nearest * model.horizon, farthest, n)
    across = np.sqrt((r * r + model.traced_a**2) * (1 - cosine**2))
    return np.stack([across * np.cos(phi), across * np.sin(phi), r * cosine], axis=1)


def hamiltonian(model, states, energy):
    """g^{mn} p_m p_n / 2 with the whole inverse metric as a matrix."""
    f, l_i, _, _ = model.fields(states[:, :3])
    l_up = np.concatenate([-np.ones((len(states), 1)), l_i], axis=1)
    inverse = np.diag([-1.0, 1, 1, 1]) - f[:, None, None] * l_up[:, :, None] * l_up[:, None, :]
    p = np.concatenate([-energy[:, None], states[:, 3:]], axis=1)
    return 0.5 * np.einsum("nij,ni,nj->n", inverse, p, p)


@pytest.mark.parametrize("spin", SPINS)
def test_kerr_is_the_flow_of_its_hamiltonian(spin):
    """Central differences of step 1e-5: h^2 H''' / 6 + eps / h, below 1e-9 of H's size where r > 1.05 r+."""
    model = MODELS["kerr"](spin=spin, mass=1.3)
    x = points(model)
    p = np.random.default_rng(2).normal(size=x.shape)
    states = np.concatenate([x, p], axis=1)
    energy = model.energies(states)
    assert np.abs(hamiltonian(model, states, energy)).max() < 1e-13 * np.sum(p * p, axis=1).max()
    gradient = np.empty_like(states)
    for i in range(6):
        h = np.zeros(6)
        h[i] = 1e-5
        change = hamiltonian(model, states + h, energy) - hamiltonian(model, states - h, energy)
        gradient[:, i] = change / 2e-5
    found = model.rhs(states)
    error = max(np.abs(found[:, :3] - gradient[:, 3:]).max(), np.abs(found[:, 3:] + gradient[:, :3]).max())
    print(f"a = {spin}: {error:.1e}, bound 1e-8")
    assert error < 1e-8


@pytest.mark.parametrize("spin", SPINS)
def test_the_kerr_schild_metric_is_kerrs(spin):
    """det g = -1, and g_tt, g_tphi, g_phiphi are those of Boyer and Lindquist, with a turned round."""
    model = MODELS["kerr"](spin=spin)
    x = points(model)
    f, l_i, _, _ = model.fields(x)
    l_low = np.concatenate([np.ones((len(x), 1)), l_i], axis=1)
    g = np.diag([-1.0, 1, 1, 1]) + f[:, None, None] * l_low[:, :, None] * l_low[:, None, :]
    assert np.abs(np.linalg.det(g) + 1).max() < 1e-12
    around = np.stack([0 * x[:, 0], -x[:, 1], x[:, 0], 0 * x[:, 0]], axis=1)
    r, a = model.radius(x), -spin
    sine = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2) / np.sqrt(r * r + a * a)
    sigma = r * r + a * a * (1 - sine**2)
    t_phi = np.einsum("ni,ni->n", g[:, 0, :], around)
    phi_phi = np.einsum("nij,ni,nj->n", g, around, around)
    assert g[:, 0, 0] == pytest.approx(-(1 - 2 * r / sigma), abs=1e-12)
    assert t_phi == pytest.approx(-2 * a * r * sine**2 / sigma, abs=1e-12)
    assert phi_phi == pytest.approx((r * r + a * a + 2 * a * a * r * sine**2 / sigma) * sine**2, rel=1e-11, abs=1e-12)


def test_kerr_starts_light_in_the_directions_it_is_given():
    model = MODELS["kerr"](spin=0.9)
    x = points(model, nearest=1.6)
    d = np.random.default_rng(4).normal(size=x.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    states = model.initial_states(x, d)
    assert np.abs(model.rhs(states)[:, :3] - d).max() < 1e-12
    assert (model.energies(states) > 0).all()


@pytest.mark.parametrize("spin", [0.9, 1.0])
def test_kerr_conserves_energy_spin_and_carter(spin):
    """DOP853 at rtol 1e-12 over a length of 60 M, past the photon orbits: 1e-9 of each constant's size."""
    model = MODELS["kerr"](spin=spin)
    for d in ([1.0, 0.0, 0.02], [1.0, -0.03, 0.01], [1.0, 0.05, -0.04]):
        start = model.initial_states(np.array([[-30.0, 7.0, 3.0]]), np.array([d]) / np.linalg.norm(d))[0]
        solved = solve_ivp(lambda t, s: model.rhs(s[None])[0], (0, 60), start, "DOP853", rtol=1e-12, atol=1e-13)
        values = constants(model, solved.y.T)
        drift = np.abs(values - values[0]).max(axis=0) / np.abs(values[0]).max()
        print(f"a = {spin}: E {drift[0]:.1e}, L_z {drift[1]:.1e}, Q {drift[2]:.1e}, bound 1e-9")
        assert drift.max() < 1e-9


def constants(model, states):
    """E, L_z, Q; Q = p_theta^2 + cos^2 theta (L_z^2 / sin^2 theta - a^2 E^2), off the axis."""
    x, p = states[:, :3], states[:, 3:]
    a, r = model.traced_a, model.radius(x)
    rho = np.hypot(x[:, 0], x[:, 1])
    cosine, sine = x[:, 2] / r, rho / np.sqrt(r * r + a * a)
    p_rho = (x[:, 0] * p[:, 0] + x[:, 1] * p[:, 1]) / rho
    p_theta = np.sqrt(r * r + a * a) * cosine * p_rho - r * sine * p[:, 2]
    energy = model.energies(states)
    spin = x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0]
    return np.stack([energy, spin, p_theta**2 + cosine**2 * (spin**2 / sine**2 - (a * energy) ** 2)], axis=1)


@pytest.mark.parametrize("spin", SPINS)
def test_ingoing_principal_null_rays_are_straight(spin):
    """p = -l is dx/dlambda = -l and dp/dlambda = 0: exactly straight, through the horizon."""
    model = MODELS["kerr"](spin=spin)
    x = points(model, nearest=1.0001)
    _, l_i, _, _ = model.fields(x)
    derivative = model.rhs(np.concatenate([x, -l_i], axis=1))
    assert np.abs(derivative[:, :3] + l_i).max() < 1e-13
    assert np.abs(derivative[:, 3:]).max() < 1e-13


def test_without_mass_kerr_is_straight_and_without_spin_spherical():
    states = np.random.default_rng(3).normal(size=(50, 6)) * 5
    flat = MODELS["kerr"](mass=0.0, spin=0.9).rhs(states)
    assert np.abs(flat - MODELS["straight"]().rhs(states)).max() < 1e-15
    x, p = states[:, :3], states[:, 3:]
    turned = MODELS["kerr"](spin=0.0).rhs(np.concatenate([x, p], axis=1) @ np.kron(np.eye(2), scenes.rotation(1, 2, 3)))
    straight = MODELS["kerr"](spin=0.0).rhs(states) @ np.kron(np.eye(2), scenes.rotation(1, 2, 3))
    assert np.abs(turned - straight).max() < 1e-12


@pytest.mark.parametrize("spin", [-1.001, 1.001, float("nan")])
def test_spin_beyond_one_is_refused(spin):
    with pytest.raises(ParameterError, match="'spin'"):
        MODELS["kerr"](spin=spin)


@pytest.mark.parametrize(
    ("observer", "position", "problem"),
    [
        ("static", (1.9, 0.0, 0.0), "ergosphere"),
        ("moving", (1.9, 0.0, 0.0), "ergosphere"),
        ("chart", (1.9, 0.0, 0.0), "ergosphere"),
        ("falling", (1.9, 0.0, 0.0), None),
        ("static", (0.0, 0.0, 1.5), None),  # on the axis the ergosphere is the horizon, r+ = 1.436
        ("falling", (0.0, 0.0, 1.4), "horizon"),
        ("static", (0.0, 0.0, 0.5), "horizon"),
        ("static", (2.3, 0.0, 0.0), None),
    ],
)
def test_observers_that_cannot_exist_are_refused_by_a_sentence(observer, position, problem):
    view = scenes.camera(position=position, target=(0.1, 0.2, 9.0))
    scene = scenes.Scene(view, MODELS["kerr"](spin=0.9))
    if problem is None:
        check(scene, Settings(observer=observer))
    else:
        with pytest.raises(SceneError, match=rf"The camera is at r = .* inside the {problem}.*Move the camera out"):
            check(scene, Settings(observer=observer))


@pytest.mark.parametrize("velocity", [(1.0, 0.0, 0.0), (0.8, 0.8, 0.0), (float("nan"), 0, 0), (1, 2), None, "fast"])
def test_observers_are_slower_than_light(velocity):
    with pytest.raises(SettingsError, match=r"'observer_velocity'.*Change it"):
        Settings(observer="moving", observer_velocity=velocity)


# The wormhole


def test_the_wormhole_is_ellis():
    """l = rho - b^2 / 4 rho: dl = n drho, and b^2 + l^2 = n^2 rho^2."""
    b, rho = 1.7, np.geomspace(1e-3, 1e3, 50)
    n = 1 + b * b / (4 * rho**2)
    length = rho - b * b / (4 * rho)
    assert b * b + length**2 == pytest.approx((n * rho) ** 2, rel=1e-12)
    assert np.gradient(length, rho)[25] == pytest.approx(n[25], rel=0.1)


@pytest.mark.parametrize("h", [0.05, 0.5, 0.9, 1.1, 2.0, 10.0])
def test_wormhole_rays_keep_their_constants_and_follow_the_radial_equation(h):
    """(dl/dlambda)^2 = 1 - h^2 / (b^2 + l^2), from conserved h; against an integral over l of dphi = h dl / ..."""
    model = MODELS["wormhole"](throat_radius=1.0)
    begin = -400.0
    rho = 0.5 * (400.0 + np.sqrt(400.0**2 + 1.0))
    n = 1 + 1 / (4 * rho**2)
    sine = h / (n * rho)
    start = np.array([begin / 400 * rho, 0, 0, np.sqrt(1 - sine**2), sine, 0.0])
    solved = solve_ivp(lambda t, s: model.rhs(s[None])[0], (0, 700), start, "DOP853", rtol=1e-12, atol=1e-15)
    x, u = solved.y[:3].T, solved.y[3:].T
    rho = np.linalg.norm(x, axis=1)
    assert np.abs(np.linalg.norm(u, axis=1) - 1).max() < 1e-9
    assert (1 + 1 / (4 * rho**2)) * np.linalg.norm(np.cross(x, u), axis=1) == pytest.approx(h, rel=1e-8)
    length = rho[-1] - 1 / (4 * rho[-1])
    assert (length < 0) == (h < 1)

    def rate(along):
        return h / np.sqrt((1 + along**2) * (1 + along**2 - h * h))

    if h < 1:
        expected = quad(rate, length, 400, epsabs=1e-12, limit=500)[0]
    else:
        turn = np.sqrt(h * h - 1)  # l = turn cosh: dl / sqrt(l^2 - turn^2) = ds
        expected = sum(
            quad(lambda s: h / np.sqrt(1 + (turn * np.cosh(s)) ** 2), 0, np.arccosh(end / turn), epsabs=1e-12)[0]
            for end in (400, length)
        )
    turned = np.unwrap(np.arctan2(x[:, 1], x[:, 0]))
    assert abs(abs(turned[-1] - turned[0]) - expected) < 1e-8


def test_no_camera_at_the_infinity_of_the_far_side():
    assert MODELS["wormhole"]().observer_problem("chart", np.zeros(3)).endswith("Move the camera out.")
    assert MODELS["wormhole"]().observer_problem("chart", np.array([0.1, 0, 0])) is None
