"""What the tests of the models share: their right-hand side on the GPU, and rays against DOP853 in float64."""

import numpy as np

from addon.core import device as gpu
from addon.core.pipelines.tile import ROUNDING_OF_A_STEP
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.shaders.truth import at_infinity, integrate

EPS = 2.0**-24  # half an ulp of float32, relative
HIGH = Settings(integrator="dormand_prince_54", step_control="embedded", tolerance=1e-6)


def states(n=1000, seed=1, nearest=0.5, farthest=60.0):
    """(n, 6) in float32's numbers: radii spread evenly in log r, unit directions; some radial, some tangential."""
    generator = np.random.default_rng(seed)
    x = generator.normal(size=(n, 3))
    x *= np.geomspace(nearest, farthest, n)[:, None] / np.linalg.norm(x, axis=1, keepdims=True)
    v = generator.normal(size=(n, 3))
    v[:10] = -x[:10]
    v[10:20] = np.cross(x[10:20], v[10:20])
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return np.concatenate([x, v], axis=1).astype(np.float32)


def on_gpu(glsl, model, body, given, outputs=("result",)):
    """The model's functions as the pipeline composes them. given : (n, 6); x and v in the body."""
    return glsl(
        [*model.borders().files, *model.shader_files()],
        body,
        {"x": given[:, :3], "v": given[:, 3:]},
        outputs,
        model.uniforms(),
        model.textures(),
        model.flags(),
        model.generated(),
    )


def derivatives(glsl, model, given):
    """rhs() of the shader, (n, 6), beside the float64 one."""
    body = "hold(x.xyz); RayState d = rhs(RayState(x.xyz, v.xyz)); out_dx = vec4(d.x, 0.0); out_dv = vec4(d.v, 0.0);"
    found = on_gpu(glsl, model, body, given, ("dx", "dv"))
    return np.concatenate([found["dx"][:, :3], found["dv"][:, :3]], axis=1), model.rhs(given.astype(np.float64))


def parallel_rays(b, start=20.0):
    """Along +X from x = -start, at distances b of the X axis, turned around it by the golden angle each."""
    turn = 2.399963 * np.arange(len(b))
    x = np.stack([np.full(len(b), -start), b * np.cos(turn), b * np.sin(turn)], axis=1)
    return x.astype(np.float32), np.tile(np.float32((1.0, 0.0, 0.0)), (len(b), 1))


def exact_end(model, position, direction, length, change=1e-6):
    """(the final unit direction; by how much it turns, at most, for each radian that the ray is wrong by underway).

    Wrong by a radian as the step control counts it: a turn of v, or a shift of x by |x|; at its start, or after a
    quarter, a half or three quarters of its way.
    """
    state = model.initial_states(np.array([position], float), np.array([direction], float))
    finals, turned = [], []
    for rest in (1.0, 0.75, 0.5, 0.25):
        x, v = state[0, :3], state[0, 3:]
        across = np.linalg.svd(v[None])[2][1:]
        steps = [(0.0 * axis, np.linalg.norm(v) * axis) for axis in across]
        steps += [(np.linalg.norm(x) * axis, 0.0 * axis) for axis in across]
        states = np.concatenate([state, state + change * np.array(steps).reshape(4, 6)])
        ends = model.ray_directions(integrate(model, states, rest * length))
        finals.append(ends[0])
        turned.append(np.linalg.norm(ends[1:] - ends[0], axis=1).max() / change)
        state = integrate(model, state, length / 4)
    return finals[0], max(turned)


def errors(model, positions, directions, settings=HIGH):
    """(the ends; each ray's angle from DOP853, radians; what it may be).

    May be: the tolerance, or what is accepted of each step at least, where these sum up to more; and an eps for each
    step's rounding; all magnified as the ray magnifies what goes wrong.
    """
    ends = trace_rays(model, positions, directions, settings)
    found, allowed = np.zeros(len(positions)), np.zeros(len(positions))
    for i, length in enumerate(ends.parameter.astype(float)):
        exact, magnified = exact_end(model, positions[i], directions[i], length)
        if model.far_files() != ("far/none",) and ends.status[i] == Status.ESCAPED:
            exact = at_infinity(model, positions[i : i + 1], directions[i : i + 1])[0]
        found[i] = np.linalg.norm(ends.direction[i] - exact)
        accepted = max(settings.tolerance, ROUNDING_OF_A_STEP * ends.steps[i])
        allowed[i] = max(1.0, magnified) * (accepted + EPS * ends.steps[i])
    return ends, found, allowed


def all_finite(ends):
    return all(np.isfinite(values).all() for values in vars(ends).values())


def programs():
    """How many the device has compiled."""
    return gpu.run(lambda device: device.program_count)
