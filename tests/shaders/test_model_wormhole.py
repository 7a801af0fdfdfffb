"""The Ellis wormhole on the GPU: complete elliptic integrals, the far side's directions and its sky."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from addon.core.environment_cube import face_directions
from addon.core.models import MODELS
from addon.core.scene import Environment
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import render, trace_rays
from tests.shaders import scenes, truth

EPS = 2.0**-24
FAR = 1e4
FINE = Settings(integrator="dormand_prince_54", step_control="embedded", tolerance=1e-6, escape_radius=FAR)
IMPACTS = np.array([0.05, 0.3, 0.6, 0.9, 0.95, 1.05, 1.1, 1.5, 3.0, 10.0, 100.0])


def turn(h, b=1.0):
    """Radians that the polar angle grows by from infinity to infinity, near to near (h > b) or near to far (h < b):

    dphi = h dl / sqrt((b^2 + l^2) (b^2 + l^2 - h^2)):   2 K(b^2 / h^2)   or   2 (h / b) K(h^2 / b^2)
    """
    h, b = mpmath.mpf(float(h)), mpmath.mpf(b)
    return float(2 * mpmath.ellipk((b / h) ** 2) if h > b else 2 * h / b * mpmath.ellipk((h / b) ** 2))


@pytest.mark.parametrize("h", [0.5, 0.9, 1.1, 3.0])
def test_the_elliptic_integrals_are_the_integral(h):
    def rate(length):
        return h / mpmath.sqrt((1 + length**2) * (1 + length**2 - h * h))

    if h < 1:
        found = 2 * mpmath.quad(rate, [0, 1, 10, mpmath.inf])
    else:
        lowest = mpmath.sqrt(h * h - 1)
        # l = lowest cosh s
        found = 2 * mpmath.quad(lambda s: h / mpmath.sqrt(1 + (lowest * mpmath.cosh(s)) ** 2), [0, 1, 5, 40])
    assert float(found) == pytest.approx(turn(h), abs=1e-10)


def beam(h, b=1.0, distance=FAR):
    """Parallel rays along +x at y = h: at this distance h is n |x cross u| to h b^2 / distance^2."""
    h = np.asarray(h, float)
    return np.stack([np.full_like(h, -distance), h, 0 * h], axis=1), np.tile([1.0, 0.0, 0.0], (len(h), 1))


def off_circle(angle):
    return np.abs(np.mod(angle + np.pi, 2 * np.pi) - np.pi)


@pytest.mark.parametrize("b", [1.0, 0.25])
def test_deflection_and_passage(b):
    """Each ray ends in the direction of its polar angle, pi - turn: on the near side that is a turn by 2K - pi, on
    the far side the direction away from the throat in the far chart. 100 eps times the condition number h dturn/dh.
    """
    h = b * IMPACTS
    ends = trace_rays(MODELS["wormhole"](throat_radius=b), *beam(h, b), FINE)
    assert (ends.status == Status.ESCAPED).all()
    through = np.linalg.norm(ends.position, axis=1) < b / 2
    assert through.tolist() == (h < b).tolist()
    angle = np.arctan2(ends.direction[:, 1].astype(float), ends.direction[:, 0].astype(float))
    expected = np.array([np.pi - turn(value, b) for value in h])
    error = off_circle(angle - expected)
    condition = 1 + np.abs([(turn(x * 1.0001, b) - turn(x * 0.9999, b)) / 0.0002 for x in h])
    for values in zip(h, ["far" if side else "near" for side in through], error, 100 * EPS * condition, strict=True):
        print("b = {}: h = {:g}, {} side: {:.1e} rad, bound {:.1e}".format(b, *values))
    assert (error <= 100 * EPS * condition).all()


def test_rays_keep_their_constants():
    """|u| = 1 and h: angles' rounding times the distance of 100 b, where h is read off, as a part of the largest."""
    ends = trace_rays(MODELS["wormhole"](), *beam(IMPACTS[:9], distance=50.0), replace(FINE, escape_radius=100.0))
    print(f"largest drift {ends.invariant_drift.max():.1e}, bound {10 * 100 * EPS:.1e}")
    assert ends.invariant_drift.max() <= 10 * 100 * EPS


def test_a_ray_at_the_throats_middle_goes_straight_through():
    """h = 0: it comes out opposite, running away from the throat, and its place is the mirrored one."""
    ends = trace_rays(MODELS["wormhole"](), [[-5.0, 0, 0], [0, 3.0, 4.0]], [[1.0, 0, 0], [0, -0.6, -0.8]], FINE)
    assert (ends.status == Status.ESCAPED).all()
    assert ends.direction == pytest.approx(np.array([[-1.0, 0, 0], [0, 0.6, 0.8]]), abs=1e-5)
    own = 0.25 * ends.position / np.sum(ends.position.astype(float) ** 2, axis=1, keepdims=True)
    assert (np.linalg.norm(own, axis=1) > FAR).all()
    assert np.cross(own, ends.direction) == pytest.approx(np.zeros((2, 3)), abs=1e-2)


def test_forward_and_back():
    """Near rays from their ends; far rays from their ends in the near chart, where the direction is reflected again."""
    positions, directions = beam(IMPACTS[:10], distance=100.0)
    settings = replace(FINE, escape_radius=100.0)
    there = trace_rays(MODELS["wormhole"](), positions, directions, settings)
    ends = there.position.astype(float)
    outward = ends / np.linalg.norm(ends, axis=1, keepdims=True)
    through = np.linalg.norm(ends, axis=1) < 0.5
    own = ends * np.where(through, 0.25 / np.sum(ends**2, axis=1), 1.0)[:, None]  # in the chart of their own side
    way = truth.directions_there(MODELS["wormhole"](), own, there.direction)
    way[through] -= 2 * np.sum(way * outward, axis=1, keepdims=True)[through] * outward[through]
    back = trace_rays(MODELS["wormhole"](), ends, -way, settings)
    assert (back.status == Status.ESCAPED).all()
    left = truth.directions_there(MODELS["wormhole"](), back.position, back.direction)
    error = np.linalg.norm(left + directions, axis=1)
    # An angle's rounding at 100 b changes h by 100 eps, and that the angle by the slope of turn(). The steps of both
    # ways may be wrong by the tolerance.
    slope = np.abs([(turn(x * 1.0001) - turn(x * 0.9999)) / (0.0002 * x) for x in IMPACTS[:10]])
    bound = 8 * EPS * (1 + IMPACTS[:10] * slope) * (1 + 100 * slope) + 2 * FINE.tolerance
    print(f"largest {error.max():.1e} rad, {(error / bound).max():.2f} of its bound")
    assert (error <= bound).all()


def test_right_hand_side_is_float64s(glsl):
    model = MODELS["wormhole"](throat_radius=1.3)
    generator = np.random.default_rng(1)
    x = generator.normal(size=(1000, 3))
    x *= np.geomspace(1e-4, 1e3, 1000)[:, None] / np.linalg.norm(x, axis=1, keepdims=True)
    u = generator.normal(size=(1000, 3))
    states = np.concatenate([x, u], axis=1).astype(np.float32)
    found = glsl(
        ["models/wormhole"],
        "RayState d = rhs(RayState(x.xyz, v.xyz)); out_dx = vec4(d.x, 0.0); out_dv = vec4(d.v, 0.0);",
        {"x": states[:, :3], "v": states[:, 3:]},
        ("dx", "dv"),
        {"u_throat_radius": 1.3},
    )
    exact = model.rhs(states.astype(float))
    rho = np.linalg.norm(x, axis=1)
    n = 1 + 1.3**2 / (4 * rho**2)
    assert (np.linalg.norm(found["dx"][:, :3] - exact[:, :3], axis=1) <= 10 * EPS / n).all()
    assert (np.linalg.norm(found["dv"][:, :3] - exact[:, 3:], axis=1) <= 40 * EPS * 2 * (n - 1) / (rho * n * n)).all()


@pytest.mark.parametrize("throat", [1e-6, 1e-3])
def test_a_small_throat_leaves_rays_straight(throat):
    positions, directions = beam(np.linspace(0.5, 5, 10), distance=50.0)
    ends = trace_rays(
        MODELS["wormhole"](throat_radius=throat), positions, directions, replace(FINE, escape_radius=100.0)
    )
    # alpha = 2 K(m) - pi = pi m / 4 for small m = (b / h)^2
    assert np.abs(ends.direction - directions).max() <= np.pi / 4 * (throat / 0.5) ** 2 + 1e-6


def test_nothing_is_nan():
    """Cameras on both sides, at the throat and near the far side's infinity, looking everywhere."""
    n = np.random.default_rng(9).normal(size=(300, 3))
    for place in ([0.5, 0, 0], [0.2, 0.1, 0], [0.001, 0, 0], [3.0, 0, 0]):
        for settings in (replace(FINE, escape_radius=None), Settings()):
            ends = trace_rays(MODELS["wormhole"](), np.tile(place, (300, 1)), n, settings)
            for values in (ends.position, ends.direction, ends.parameter, ends.invariant_drift):
                assert np.isfinite(values).all()
            assert (ends.status == Status.ESCAPED).mean() > 0.99


# Its two skies

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def picture(near=None, pipeline="paper", **options):
    """64 x 64 pixels of the throat, seen from 4 b away along +y. near : its sky; red without it"""
    view = scenes.camera(64, 64, position=(0.0, -4.0, 0.0))
    scene = scenes.Scene(view, MODELS["wormhole"](), environment=near or Environment(RED), **options)
    settings = Settings(pipeline, integrator="dormand_prince_54", step_control="embedded", tolerance=1e-4)
    return render(scene, settings)


def test_the_far_sky_is_seen_through_the_throat():
    """The mouth's edge is h = b: sin psi = b / (n rho), n rho = 4 + 1/16 at the camera. Its area, sub-pixel."""
    frame = picture(far_environment=Environment(BLUE))
    colors = frame.passes["Combined"][..., :3]
    far = (colors == np.array(BLUE)).all(axis=-1)
    near = (colors == np.array(RED)).all(axis=-1)
    assert (far | near).all()
    angle = np.arcsin(1 / (4 + 1 / 16))
    radius = np.sqrt(far.sum() / np.pi)
    print(f"radius {radius:.2f} pixels, expected {64 * np.tan(angle):.2f}")
    assert radius == pytest.approx(64 * np.tan(angle), abs=0.3)
    assert "sky of the far side" not in frame.statistics.left_out


def test_without_a_far_sky_the_same_sky_is_everywhere():
    frame = picture()
    assert (frame.passes["Combined"][..., :3] == np.array(RED)).all()
    assert "sky of the far side" in frame.statistics.left_out


def test_a_far_cube_is_looked_up_in_the_far_charts_directions():
    """A sky that is the direction itself: at the mouth's middle it shows the side that the rays go to, -y."""
    faces = (0.5 + 0.5 * face_directions(32)).astype(np.float32)
    colors = picture(far_environment=Environment(faces=faces)).passes["Combined"]
    middle = colors[31:33, 31:33, :3].mean(axis=(0, 1))
    assert 2 * middle - 1 == pytest.approx([0.0, -1.0, 0.0], abs=0.05)


@pytest.mark.parametrize("pipeline", ["paper", "fused"])
def test_both_skies_may_be_cubes(pipeline):
    """Two textures in one program: the far one in the middle, the near one at the rim."""
    far = (0.5 + 0.5 * face_directions(32)).astype(np.float32)
    red = np.broadcast_to(np.float32(RED), (6, 4, 4, 3)).copy()
    colors = picture(Environment(faces=red), pipeline, far_environment=Environment(faces=far)).passes["Combined"]
    assert 2 * colors[31:33, 31:33, :3].mean(axis=(0, 1)) - 1 == pytest.approx([0.0, -1.0, 0.0], abs=0.05)
    assert colors[0, 0, :3] == pytest.approx(RED)


def test_far_objects_stand_inside_the_ball_and_near_ones_do_not_show_through():
    """A sphere around the near camera's back is not met on the far side; one inside the ball is."""
    view = scenes.camera(16, 16, position=(0.0, -4.0, 0.0), half=0.05)
    settings = Settings(
        integrator="dormand_prince_54", step_control="embedded", tolerance=1e-4, passes=("Combined", "Status")
    )
    scene = scenes.Scene(view, MODELS["wormhole"](), spheres=scenes.spheres([[0, -8.0, 0]], [2.0]))
    assert (render(scene, settings).passes["Status"] == Status.ESCAPED).all()
    inside = scenes.spheres([[0, -0.05, 0]], [0.02])  # at 0.25 / 0.05 = 5 on the far side
    assert (render(replace(scene, spheres=inside), settings).passes["Status"] == Status.HIT).any()
