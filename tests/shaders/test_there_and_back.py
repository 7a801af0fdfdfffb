"""Forward and back returns to the start, for every model: by steps of h and then of -h, and by light that turns round.

Light that comes from far away and goes back there is in the files of Schwarzschild's, Kerr's and the wormhole's tests.
"""

from functools import cache

import numpy as np
import pytest

from addon.core.tableaus import TABLEAUS
from addon.core.trace import trace_rays
from tests.shaders.smooth_rays import PARABOLA, PIPELINES, WAYS, constant_steps, in_float64, root_mean_square

INTEGRATOR, STEPS = "dormand_prince_54", 16
ALL = WAYS | {"linear": PARABOLA}
MEDIA = {name: way for name, way in ALL.items() if way.model == "refraction"}


@cache
def bounds(name):
    """(positions', velocities', both's): what float64 misses the start by with the same steps, and twelve times what it
    changes there to round all states and derivatives to float32, each of which is a sum that rounds several times.
    """
    states = ALL[name].start()[3]
    twin, rounded = in_float64(ALL[name], INTEGRATOR, STEPS, back=True)
    parts = (slice(0, 3), slice(3, 6), slice(0, 6))
    return [
        root_mean_square((twin - states)[:, part]) + 12.0 * root_mean_square((rounded - twin)[:, part])
        for part in parts
    ]


@pytest.mark.parametrize("name", ALL)
def test_steps_of_h_and_of_minus_h(glsl, name):
    way = ALL[name]
    model, x, d, states = way.start()
    body = f"""RayState s = initial_state(x.xyz, v.xyz);
    for (int i = 0; i < {STEPS}; ++i) s = advance(s, {way.length / STEPS}).state;
    out_turn = vec4(s.x, 0.0);
    for (int i = 0; i < {STEPS}; ++i) s = advance(s, -{way.length / STEPS}).state;
    out_x = vec4(s.x, 0.0);
    out_v = vec4(s.v, 0.0);"""
    found = glsl(
        [*model.borders().files, *model.shader_files()],
        body,
        {"x": x, "v": d},
        ("x", "v", "turn"),
        model.uniforms(),
        model.textures(),
        model.flags(),
        (*model.generated(), (INTEGRATOR, TABLEAUS[INTEGRATOR].as_glsl())),
    )
    ends = np.concatenate([found["x"][:, :3], found["v"][:, :3]], axis=1)
    error, bound = root_mean_square(ends - states), bounds(name)[2]
    print(f"{name}: {error:.1e}, bound {bound:.1e}")
    assert root_mean_square(found["turn"][:, :3] - states[:, :3]) > 100 * bound  # it went away
    assert error <= bound


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("name", MEDIA)
def test_light_turns_round(name, pipeline):
    """In a medium |v| = n everywhere, so that the way back is as long in tau."""
    way = MEDIA[name]
    model, x, d, states = way.start()
    settings = constant_steps(way, pipeline, INTEGRATOR, STEPS)
    there = trace_rays(model, x, d, settings)
    back = trace_rays(model, there.position, -there.direction, settings)
    assert (there.parameter == way.length).all() and (back.parameter == way.length).all()
    places, velocities, _ = bounds(name)
    angles = velocities / np.linalg.norm(states[:, 3:], axis=1).min()
    missed, turned = root_mean_square(back.position - x), root_mean_square(back.direction + d)
    print(f"{name}, {pipeline}: {missed:.1e}, bound {places:.1e}; direction {turned:.1e} rad, bound {angles:.1e}")
    assert root_mean_square(there.position - x) > 100 * places
    assert missed <= places and turned <= angles
