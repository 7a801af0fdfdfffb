"""Every model, told nothing but a tolerance: directions within 1e-4 rad at the default, 1e-5 rad at the high one, in
both pipelines, away from rays at the edge of chaos. Against DOP853 from the rays' first points to their ends, or where
what is known is the direction far away, to there.
"""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from addon.core.models import MODELS
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.shaders.model_checks import parallel_rays
from tests.shaders.smooth_rays import PIPELINES
from tests.shaders.truth import at_infinity

ACCURACIES = {"default": (Settings().tolerance, 1e-4), "high": (1e-6, 1e-5)}  # tolerance, and the bound: radians
EXPLOSION = {  # the preset's
    "medium": "explosion",
    "radius": 8.0,
    "strength": 0.12,
    "thickness": 0.15,
    "roughness": 0.12,
    "frequency": 2.5,
    "rarefaction": 0.5,
}
# model, values, distances of the rays from the axis, distance at which they begin
CASES = {
    "schwarzschild": ("schwarzschild", {}, [-30.0, -7.0, 6.0, 8.0], 20.0),
    "kerr": ("kerr", {}, [-30.0, -9.0, 8.0, 15.0], 20.0),
    "wormhole": ("wormhole", {}, [0.1, 0.5, 1.5, 3.0], 20.0),
    "lorenz": ("lorenz", {"strength": 2e-5, "reach": 60.0}, [-10.0, -3.0, 1.0, 5.0], 20.0),
    "roessler": ("roessler", {"strength": 1e-4, "reach": 60.0}, [-10.0, -3.0, 1.0, 5.0], 20.0),
    "cubic": ("radial_potential", {"xi": "cubic"}, [0.5, 2.0, 3.0, 4.5], 20.0),
    "coulomb": ("radial_potential", {"xi": "coulomb"}, [1.0, 2.0, 4.0, 8.0], 20.0),
    "yukawa": ("radial_potential", {"xi": "yukawa"}, [1.0, 2.0, 4.0, 8.0], 20.0),
    "typed potential": ("radial_potential", {"xi": "expression"}, [1.0, 2.0, 4.0, 8.0], 20.0),
    "custom": ("custom", {}, [2.0, 3.0, 8.0], 20.0),
    "mirage": ("refraction", {"medium": "mirage", "mirage_b": -1e-2}, [0.5, 1.0, 2.0], 3.0),
    "linear": ("refraction", {"medium": "linear"}, [-3.0, 1.0, 8.0], 3.0),
    "isotropic": ("refraction", {"medium": "isotropic"}, [7.0, 10.0, 15.0], 20.0),
    "luneburg": ("refraction", {"medium": "luneburg", "radius": 2.0}, [0.1, 0.5, 1.0, 1.6], 20.0),
    "explosion": ("refraction", EXPLOSION, [1.0, 3.0, 6.0, 9.0], 20.0),
    "typed index": ("refraction", {"medium": "expression"}, [0.1, 0.5, 1.0, 2.0], 3.0),
}
COMPACT = ("cubic", "luneburg", "explosion", "typed index")  # a long step could miss them


@cache
def traced(name):
    """(the rays' ends by pipeline and accuracy; by the same, the exact directions there)."""
    model, x, d = rays(name)
    ends = {}
    for pipeline in PIPELINES:
        for accuracy, (tolerance, _) in ACCURACIES.items():
            settings = Settings(
                pipeline=pipeline,
                step_control="embedded",
                tolerance=tolerance,
                segments=20_000,
            )
            ends[pipeline, accuracy] = trace_rays(model, x, d, settings)
    lengths = sorted({float(length) for end in ends.values() for length in end.parameter})
    states = model.initial_states(x.astype(float), d.astype(float))
    solved = solve_ivp(
        lambda tau, flat: model.rhs(flat.reshape(-1, 6)).ravel(),
        (0.0, lengths[-1]),
        states.ravel(),
        "DOP853",
        t_eval=lengths,
        rtol=1e-11,
        atol=1e-12,
        max_step=1.0 if name in COMPACT else np.inf,
    )
    way = solved.y.T.reshape(len(lengths), len(x), 6)
    exact = {}
    for key, end in ends.items():
        at = np.searchsorted(lengths, end.parameter.astype(float))
        exact[key] = model.ray_directions(way[at, np.arange(len(x))])
    if model.far_files() != ("far/none",):
        exact = dict.fromkeys(ends, at_infinity(model, x, d))
    return ends, exact


def rays(name):
    model, values, b, start = CASES[name]
    return MODELS[model](**values), *parallel_rays(np.array(b), start)


@pytest.mark.parametrize("accuracy", ACCURACIES)
@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("name", CASES)
def test_directions(name, pipeline, accuracy):
    ends, exact = (values[pipeline, accuracy] for values in traced(name))
    error = np.linalg.norm(ends.direction - exact, axis=1)
    bound = ACCURACIES[accuracy][1]
    print(f"{name}, {pipeline}, {accuracy}: {error.max():.1e} rad, bound {bound:.1e}; up to {ends.steps.max()} steps")
    assert (ends.status == Status.ESCAPED).all()
    assert (error <= bound).all()
