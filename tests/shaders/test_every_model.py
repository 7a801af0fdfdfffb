"""What every model must do, a new one too, with nothing but its defaults."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.shaders.model_checks import EPS, derivatives, parallel_rays, states


@pytest.mark.parametrize("name", MODELS)
def test_right_hand_side_is_float64s(glsl, name):
    """At 1000 random states: 200 roundings, each of the size of a term, for which the derivative along every component
    times the component stands (its condition). Outside of 3 lengths, where no default model is singular.
    """
    model, given = MODELS[name](), states(nearest=3.0)
    found, exact = derivatives(glsl, model, given)
    used = np.abs(found - exact).max(axis=1) / (200 * EPS * condition(model, given.astype(np.float64)))
    print(f"{name}: {used.max():.2f} of the bound")
    assert (used <= 1).all()


@pytest.mark.parametrize("name", [name for name in MODELS if MODELS[name]().force_of_position()])
def test_acceleration_is_the_force_elsewhere_on_the_ray(glsl, name):
    """At another place in the plane of x and v, against the right-hand side for a velocity with the same x cross v,
    which is all that such a force may ask of it. Outside of 6 lengths, so that these places are outside of 3; bound as
    above.
    """
    model, given = MODELS[name](), states(nearest=6.0)
    x, v = np.split(given.astype(np.float64), 2, axis=1)
    place = (1.2 * x + 0.5 * np.linalg.norm(x, axis=1, keepdims=True) * v).astype(np.float32)
    y = place.astype(np.float64)
    elsewhere = np.concatenate([y, np.cross(np.cross(x, v), y) / np.sum(y * y, axis=1, keepdims=True)], axis=1)
    found = glsl(
        [*model.borders().files, *model.shader_files()],
        "out_result = vec4(acceleration(y.xyz, RayState(x.xyz, v.xyz)), 0.0);",
        {"x": given[:, :3], "v": given[:, 3:], "y": place},
        ("result",),
        model.uniforms(),
        model.textures(),
        model.flags(),
        model.generated(),
    )["result"][:, :3]
    error = np.abs(found - model.rhs(elsewhere)[:, 3:]).max(axis=1)
    used = error / (200 * EPS * condition(model, elsewhere))
    print(f"{name}: {used.max():.2f} of the bound")
    assert (used <= 1).all()


def condition(model, s):
    """(n, 6) -> (n,): what a relative rounding of a component, or of a term, changes in the right-hand side."""
    total = np.abs(model.rhs(s)).max(axis=1) + np.abs(s[:, 3:]).max(axis=1)
    for column in range(6):
        step = np.zeros(6)
        step[column] = 1e-6
        slope = (model.rhs(s * (1 + step)) - model.rhs(s * (1 - step))) / 2e-6
        total += np.abs(slope).max(axis=1)
    return total


@pytest.mark.parametrize("pipeline", ["paper", "fused"])
@pytest.mark.parametrize("name", MODELS)
def test_every_ray_ends_in_a_named_status_with_finite_numbers(name, pipeline):
    settings = Settings(
        pipeline=pipeline, integrator="automatic", step_control="embedded", tolerance=1e-4, segments=500
    )
    ends = trace_rays(MODELS[name](), *parallel_rays(np.geomspace(0.1, 15.0, 40)), settings)
    assert set(ends.status.tolist()) <= {status.value for status in Status} - {Status.RUNNING, Status.NOT_FINITE}
    for array in (ends.position, ends.direction, ends.parameter, ends.steps, ends.invariant_drift, ends.error):
        assert np.isfinite(array).all()
