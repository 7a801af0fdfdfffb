"""Rejected steps are counted on the GPU: none where nothing is wrong, all where nothing stands."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.pipelines import fused as fused_pipeline
from addon.core.settings import PIPELINES, Settings
from addon.core.status import Status
from addon.core.trace import trace_rays

CONTROLS = ("doubling", "embedded")
N = 16


def rays():
    """Side by side, along y past the centre."""
    positions = np.column_stack([np.linspace(1.0, 9.0, N), np.full(N, -20.0), np.full(N, 0.5)])
    return positions, np.tile((0.0, 1.0, 0.0), (N, 1))


def settings(pipeline, control, integrator="dormand_prince_54", **more):
    return Settings(pipeline=pipeline, integrator=integrator, step_control=control, segments=5000, **more)


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("pipeline", PIPELINES)
def test_without_a_force_every_step_stands(egl, pipeline, control):
    ends = trace_rays(MODELS["schwarzschild"](mass=0.0), *rays(), settings(pipeline, control, escape_radius=30.0))
    assert (ends.status == Status.ESCAPED).all() and (ends.steps > 0).all()
    assert (ends.rejected == 0).all()


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("pipeline", PIPELINES)
def test_where_the_force_is_no_number_no_step_stands(egl, pipeline, control):
    """The root of a negative number: no attempt's result is a number, whatever its step."""
    nowhere = MODELS["custom"](fx="sqrt(-1 - x^2)", fy="0", fz="0")
    ends = trace_rays(nowhere, *rays(), settings(pipeline, control, step=1e-2))
    assert (ends.status == Status.STEP_TOO_SMALL).all() and (ends.steps > 0).all()
    assert np.array_equal(ends.rejected, ends.steps)


def test_constant_steps_are_never_rejected(egl):
    hole = MODELS["schwarzschild"]()
    for pipeline in PIPELINES:
        ends = trace_rays(hole, *rays(), settings(pipeline, "constant", step=1.0))
        assert (ends.steps > 0).all() and (ends.rejected == 0).all()


@pytest.mark.parametrize(("integrator", "control"), [("verlet", "doubling"), ("dormand_prince_54", "embedded")])
def test_the_count_goes_on_in_the_next_draw(egl, integrator, control, monkeypatch):
    """To the bit, and there is something to count: near the hole rays need shorter steps than their first."""
    chosen = settings("fused", control, integrator, tolerance=1e-6, step=8.0)
    whole = trace_rays(MODELS["schwarzschild"](), *rays(), chosen)
    monkeypatch.setattr(fused_pipeline, "STEPS_A_DRAW", 7)
    parts = trace_rays(MODELS["schwarzschild"](), *rays(), chosen)
    assert whole.steps.max() > 21 and whole.rejected.max() > 0 and (whole.rejected < whole.steps).all()
    assert np.array_equal(whole.rejected, parts.rejected) and np.array_equal(whole.steps, parts.steps)
