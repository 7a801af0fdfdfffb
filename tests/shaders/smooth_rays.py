"""Short ways of rays on which every model's right-hand side is smooth, so that a method shows its order on them; and
the integrators once more, in float64 numpy.

A front, a voxel, a cell of noise or the rim of a reach has a kink, at which no method keeps its order: these ways stay
within one piece.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from addon.core.models import MODELS
from addon.core.nystrom import NYSTROM_METHODS
from addon.core.rosenbrock import ROSENBROCK_METHODS
from addon.core.settings import Settings
from addon.core.tableaus import TABLEAUS
from addon.core.trace import trace_rays
from tests.shaders.truth import integrate

PIPELINES = ("paper", "fused")
RAYS = 8


@dataclass
class Way:
    """Rays that begin around x with directions around d, of tau = length each; within `spread` of both.

    steps : of Dormand and Prince's method, in the whole length, where its error is well above float32's rounding
    flat : all of them begin in the plane z = x[2]
    """

    model: str
    x: tuple
    d: tuple
    length: float  # of few binary digits, so that all steps are exact in float32
    values: dict = field(default_factory=dict)
    spread: float = 0.1
    steps: int = 2
    flat: bool = False

    def start(self):
        """(the model, float32 positions and directions, float64 first states)."""
        generator = np.random.default_rng(1)
        around = self.spread * generator.normal(size=(RAYS, 3)) * (1.0, 1.0, 0.0 if self.flat else 1.0)
        x = (np.array(self.x) + around).astype(np.float32)
        d = np.array(self.d) + self.spread * generator.normal(size=(RAYS, 3))
        d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)
        unit = d.astype(float) / np.linalg.norm(d.astype(float), axis=1, keepdims=True)
        model = MODELS[self.model](**self.values)
        return model, x, d, model.initial_states(x.astype(float), unit)

    @cached_property
    def exact(self):
        """(n, 6) at the end: DOP853."""
        model, _, _, states = self.start()
        return integrate(model, states, self.length)


def flow(name, x, length):
    return Way(name, x, (1, 0, 0), length, {"mode": "flow", "plane_distance": 0.0})


def potential(length, x=(-2, 2, 1), **values):
    return Way("radial_potential", x, (1, 0, 0), length, values)


def medium(name, x, d, length, spread=0.1, steps=2, **values):
    return Way("refraction", x, d, length, {"medium": name} | values, spread, steps)


MAGNETIC = {  # an attraction, a force across v, and a friction
    "fx": "-k * x / (r^2 + 1)^1.5 - w * vy",
    "fy": "-k * y / (r^2 + 1)^1.5 + w * vx",
    "fz": "-k * z / (r^2 + 1)^1.5 - t * vz",
    "time": 0.2,
    "parameters": {"k": 1.0, "w": 0.5},
}
WIDE_VOXELS = {  # the middle one of 4^3 is 2 lengths wide
    "grid": np.random.default_rng(4).random((4, 4, 4)).astype(np.float32),
    "grid_min": (-4.0,) * 3,
    "grid_max": (4.0,) * 3,
}
WAYS = {
    "schwarzschild": Way("schwarzschild", (-4, 6, 0), (1, 0, 0), 8.0),
    "kerr": Way("kerr", (-4, 5, 2), (1, 0, 0), 5.5),
    "wormhole": Way("wormhole", (-1.5, 0.5, 0.3), (1, 0, 0), 2.0),
    "lorenz, force": Way("lorenz", (-3, 2, 1), (1, 0, 0), 6.0, {"strength": 5e-3}),
    "lorenz, flow": flow("lorenz", (1, 1, 1), 0.1875),
    "roessler, force": Way("roessler", (-3, 2, 1), (1, 0, 0), 4.0, {"strength": 0.05}),
    "roessler, flow": flow("roessler", (1, 1, 1), 0.875),
    "coulomb": potential(2.75, xi="coulomb"),
    "yukawa": potential(3.0, xi="yukawa"),
    "cubic": potential(3.25, x=(-3, 2, 1), xi="cubic", strength=0.3),
    "typed potential": potential(4.0, xi="expression"),
    "custom": Way("custom", (-2, 1, 0.5), (1, 0, 0), 2.5, MAGNETIC),
    "explosion": medium(
        "explosion", (0.9, 0.2, 0.5), (-1, 1, 0), 0.3125, 0.02, frequency=0.2, thickness=0.5, strength=2.0
    ),
    "mirage": medium("mirage", (0, 0, 0.6), (1, 0, -0.5), 1.25, 0.05, 1, mirage_b=-0.5),
    "luneburg": medium("luneburg", (-1.2, 0.5, 0.2), (1, 0, 0), 2.0, 0.1, 1, radius=2.0),
    "fisheye": medium("fisheye", (-1, 0.5, 0.2), (1, 0, 0), 1.0, index=1.5),
    "isotropic": medium("isotropic", (-1, 1, 0.2), (1, 0, 0), 1.375, mass=0.1),
    "shell": medium("shell", (-0.4, 0.9, 0.2), (1, 0, 0), 0.6875, 0.02, thickness=0.5),
    "grid": medium("grid", (-0.7, 0.3, 0.2), (1, 0, 0), 0.21875, 0.05, 1, strength=12.0, **WIDE_VOXELS),
    "typed index": medium("expression", (-1, 0.5, 0.2), (1, 0, 0), 1.5),
}
PARABOLA = medium("linear", (-1, 0.5, 0.2), (1, 0, 0), 4.0, index=1.2, gradient=0.6)


def constant_steps(way, pipeline, integrator, steps):
    """Settings of so many steps in the whole length, and no more."""
    return Settings(
        pipeline=pipeline,
        integrator=integrator,
        step_control="constant",
        step=way.length / steps,
        segments=1,
        steps_per_segment=steps,
        max_steps=steps,
        escape_radius=1e4,
    )


def traced(way, pipeline, integrator, steps):
    """RayEnds after so many constant steps in the whole length."""
    model, x, d, _ = way.start()
    ends = trace_rays(model, x, d, constant_steps(way, pipeline, integrator, steps))
    assert (ends.steps == steps).all() and (ends.parameter == way.length).all()
    return ends


def in_float64(way, integrator, steps, back=False):
    """(n, 6) after the same steps in numpy; and the same where all states and derivatives are rounded to float32.

    back : as many steps of -h follow
    """
    model, _, _, states = way.start()

    def rhs(both):
        return half_rounded(model.rhs(half_rounded(both)))

    step, both, h = STEPS.get(integrator, tableau_step), np.concatenate([states, states]), way.length / steps
    for signed in [h] * steps + [-h] * (steps if back else 0):
        both = half_rounded(step(rhs, both, signed, integrator))
    return both[:RAYS], both[RAYS:]


def half_rounded(both):
    """In place: the second half to float32."""
    both[RAYS:] = both[RAYS:].astype(np.float32)
    return both


def euler_step(rhs, states, h, _):
    return states + h * rhs(states)


def verlet_step(rhs, states, h, _):
    """Velocity Verlet as integrators/verlet.glsl generalises it."""

    def at(x, v):
        return np.split(rhs(np.concatenate([x, v], axis=1)), 2, axis=1)

    x, v = np.split(states, 2, axis=1)
    force = at(x, v)[1]
    v_half = v + 0.5 * h * force
    along = at(x, v_half)[0]
    x_end = x + 0.5 * h * (along + at(x + h * along, v_half)[0])
    return np.concatenate([x_end, v_half + 0.5 * h * at(x_end, v + h * force)[1]], axis=1)


def tableau_step(rhs, states, h, integrator):
    tableau, slopes = TABLEAUS[integrator], []
    for row in tableau.a:
        slopes.append(rhs(states + h * weighted(row, slopes)))
    return states + h * weighted(tableau.b, slopes)


def rosenbrock_step(rhs, states, h, integrator):
    method, slopes = ROSENBROCK_METHODS[integrator], []
    gamma = float(method.gamma)
    first = rhs(states)
    w = half_rounded(np.eye(6) - gamma * h * jacobian(rhs, states, first, gamma * h))
    for a, c in zip(method.a, method.c, strict=True):
        rate = rhs(states + weighted(a, slopes)) if any(a) else first
        right = gamma * (h * rate + weighted(c, slopes))
        slopes.append(half_rounded(np.linalg.solve(w, right[..., None])[..., 0]))
    return states + weighted(method.m, slopes)


def jacobian(rhs, states, first, gamma_h):
    """(n, 6, 6) by the differences of integrators/linearised.glsl: their error is part of the method."""
    apart = differences(states, first, gamma_h)
    columns = []
    for j in range(6):
        beside = states.copy()
        beside[:, j] += apart[:, j]
        rate = rhs(beside)  # which rounds its argument, where all is rounded
        columns.append((rate - first) / (beside - states)[:, j : j + 1])
    return np.stack(columns, axis=2)


def differences(states, first, gamma_h):
    """(n, 6): how far to go for a difference."""
    size, moved = (np.linalg.norm(values.reshape(-1, 2, 3), axis=2) for values in (states, abs(gamma_h) * first))
    size[:, 0] = np.maximum(size[:, 0], moved[:, 0])
    return np.clip(moved / 32.0, size * 2.0**-20, size * 2.0**-12).repeat(3, axis=1)


def weighted(weights, slopes):
    return sum(float(weight) * slope for weight, slope in zip(weights, slopes, strict=True))


def nystrom_step(rhs, states, h, integrator):
    """Its stages have no velocity: they are given one that has the ray's x cross v, all that a force may ask for."""
    method, slopes = NYSTROM_METHODS[integrator], []
    x, v = np.split(states, 2, axis=1)
    momentum = np.cross(x, v)
    for c, row in zip(method.c, method.a, strict=True):
        at = x + (float(c) * h * v + h * h * weighted(row, slopes))
        turning = np.cross(momentum, at) / np.sum(at * at, axis=1, keepdims=True)
        slopes.append(rhs(np.concatenate([at, turning], axis=1))[:, 3:])
    return np.concatenate(
        [x + (h * v + h * h * weighted(method.b, slopes)), v + h * weighted(method.d, slopes)], axis=1
    )


STEPS = {
    "euler": euler_step,
    "verlet": verlet_step,
    "nystrom_64": nystrom_step,
    "rosenbrock_32": rosenbrock_step,
}


def root_mean_square(difference):
    """Over the rays, of vectors (n, any)."""
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))
