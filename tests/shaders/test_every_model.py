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
    s = given.astype(np.float64)
    condition = np.abs(exact).max(axis=1) + np.abs(s[:, 3:]).max(axis=1)
    for column in range(6):
        step = np.zeros(6)
        step[column] = 1e-6
        slope = (model.rhs(s * (1 + step)) - model.rhs(s * (1 - step))) / 2e-6
        condition += np.abs(slope).max(axis=1)
    error = np.abs(found - exact).max(axis=1)
    used = error / (200 * EPS * condition)
    print(f"{name}: {used.max():.2f} of the bound")
    assert (used <= 1).all()


@pytest.mark.parametrize("pipeline", ["paper", "fused"])
@pytest.mark.parametrize("name", MODELS)
def test_every_ray_ends_in_a_named_status_with_finite_numbers(name, pipeline):
    settings = Settings(
        pipeline=pipeline, integrator="dormand_prince_54", step_control="embedded", tolerance=1e-4, segments=500
    )
    ends = trace_rays(MODELS[name](), *parallel_rays(np.geomspace(0.1, 15.0, 40)), settings)
    assert set(ends.status.tolist()) <= {status.value for status in Status} - {Status.RUNNING, Status.NOT_FINITE}
    for array in (ends.position, ends.direction, ends.parameter, ends.steps, ends.invariant_drift, ends.error):
        assert np.isfinite(array).all()
