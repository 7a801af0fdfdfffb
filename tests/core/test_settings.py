"""Every setting that cannot work is refused by name, before anything else happens."""

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from addon.core.settings import (
    EARLY_TERMINATIONS,
    FAILED_RAYS,
    INTEGRATORS,
    OBSERVERS,
    PASS_CHANNELS,
    PASSES,
    PIPELINES,
    STEP_CONTROLS,
    WITH_ERROR_ESTIMATE,
    Settings,
    SettingsError,
)

LENGTHS = {"step": (1e-9, 1e9), "escape_radius": (1e-9, 1e12), "tolerance": (1e-9, math.pi)}
COUNTS = {
    "max_steps": (1, 10_000_000),
    "segments": (1, 1_000_000),
    "steps_per_segment": (1, 1000),
    "samples": (1, 4096),
    "batch_size": (1, 65536),
}
CHOICES = {
    "pipeline": PIPELINES,
    "integrator": INTEGRATORS,
    "step_control": STEP_CONTROLS,
    "observer": OBSERVERS,
    "early_termination": EARLY_TERMINATIONS,
    "failed_rays": FAILED_RAYS,
    "ray_bits": (16, 32),
}
FOLLOWING = ("integrator", "step_control", "tolerance")  # None is the pipeline's own choice
BAD_NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, "1", None, 1j, [1.0]])


def refused(name, value):
    with pytest.raises(SettingsError) as caught:
        Settings(**{name: value})
    assert f"'{name}'" in str(caught.value) and repr(value) in str(caught.value)


@pytest.mark.parametrize("name", LENGTHS)
@given(data=st.data())
def test_lengths_and_angles_out_of_range(name, data):
    low, high = LENGTHS[name]
    below = st.floats(max_value=low, exclude_max=True)
    above = st.floats(min_value=high, exclude_min=True)
    value = data.draw(below | above | BAD_NUMBERS)
    if value is None:
        return  # None is a choice: the model's own, or the pipeline's
    refused(name, value)


@pytest.mark.parametrize("name", COUNTS)
@given(data=st.data())
def test_counts_out_of_range(name, data):
    low, high = COUNTS[name]
    value = data.draw(st.integers(max_value=low - 1) | st.integers(min_value=high + 1) | st.floats() | BAD_NUMBERS)
    if value is None and name == "batch_size":
        return  # None is a choice: as many as keep a draw short
    refused(name, value)


@pytest.mark.parametrize("name", [*LENGTHS, *COUNTS])
def test_true_is_no_number(name):
    refused(name, True)


@pytest.mark.parametrize("name", CHOICES)
@given(value=st.text() | st.integers(33) | st.floats(allow_nan=True) | st.none())
def test_unknown_choices(name, value):
    if value not in CHOICES[name] and not (value is None and name in FOLLOWING):
        refused(name, value)


@given(name=st.text())
def test_unknown_pass(name):
    if name not in PASSES:
        with pytest.raises(SettingsError, match="'passes'"):
            Settings(passes=("Combined", name))


def test_no_pass_at_all():
    with pytest.raises(SettingsError, match="'passes'"):
        Settings(passes=())


@pytest.mark.parametrize("name", [*LENGTHS, *COUNTS])
@given(data=st.data())
def test_the_whole_range_is_accepted(name, data):
    low, high = (LENGTHS | COUNTS)[name]
    numbers = st.floats(low, high) if name in LENGTHS else st.integers(low, high)
    value = data.draw(numbers)
    assert getattr(Settings(**{name: value}), name) == value


@pytest.mark.parametrize("name", CHOICES)
def test_every_choice_is_accepted(name):
    for value in CHOICES[name]:
        needed = {"integrator": WITH_ERROR_ESTIMATE[0]} if value == "embedded" else {}
        assert getattr(Settings(**{name: value}, **needed), name) == value


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name not in WITH_ERROR_ESTIMATE])
def test_embedded_control_needs_an_estimate(integrator):
    with pytest.raises(SettingsError, match="'step_control' is 'embedded'"):
        Settings(step_control="embedded", integrator=integrator)


def test_defaults_are_in_range():
    settings = Settings()
    assert Settings(**{field.name: getattr(settings, field.name) for field in dataclasses.fields(Settings)}) == settings


@pytest.mark.parametrize(
    ("given", "followed"),
    [
        ({}, ("automatic", "embedded", 5e-5)),
        ({"integrator": "runge_kutta_4"}, ("runge_kutta_4", "doubling", 5e-5)),
        ({"pipeline": "paper"}, ("euler", "doubling", 1e-3)),
        ({"pipeline": "paper", "step_control": "embedded"}, ("automatic", "embedded", 1e-3)),
        ({"pipeline": "paper", "integrator": "dormand_prince_54"}, ("dormand_prince_54", "doubling", 1e-3)),
        ({"step_control": "constant", "tolerance": 0.5}, ("automatic", "constant", 0.5)),
    ],
)
def test_the_rest_follows_the_pipeline(given, followed):
    settings = Settings(**given)
    assert (settings.integrator, settings.step_control, settings.tolerance) == followed


def test_settings_are_a_key():
    """Frozen and hashable, also where passes come as a list, as Blender's side collects them."""
    assert hash(Settings(passes=["Combined", "Depth"])) == hash(Settings(passes=("Combined", "Depth")))
    with pytest.raises(dataclasses.FrozenInstanceError):
        Settings().step = 1.0


def test_early_termination_takes_true_and_false():
    assert Settings(early_termination=True).early_termination == "both"
    assert Settings(early_termination=False).early_termination == "off"


def test_every_pass_has_channels():
    assert tuple(PASS_CHANNELS) == PASSES


@pytest.mark.parametrize(
    ("options", "limit"),
    [
        ({"segments": 20, "steps_per_segment": 5}, 100),
        ({"segments": 20, "steps_per_segment": 5, "step_control": "doubling"}, 300),
        ({"segments": 20, "steps_per_segment": 5, "max_steps": 7}, 7),
    ],
)
def test_the_step_limit_is_that_of_all_limits(options, limit):
    """Step doubling tries h, and twice h / 2."""
    assert Settings(**options).step_limit == limit
