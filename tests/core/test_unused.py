"""What the panel hides: only what does nothing with the chosen options."""

import itertools

import numpy as np
import pytest

from addon.core.models import MODELS

CHOICES = [
    (name, dict(zip([option.name for option in model.options], keys, strict=True)))
    for name, model in MODELS.items()
    for keys in itertools.product(*[[key for key, _, _ in option.choices] for option in model.options])
]


@pytest.mark.parametrize(("name", "chosen"), CHOICES, ids=str)
def test_a_hidden_parameter_changes_nothing(name, chosen):
    model = MODELS[name]
    hidden = model.unused(chosen)
    known = {entry.name: entry for entry in (*model.parameters, *model.texts)}
    assert hidden <= known.keys()
    states = np.random.default_rng(1).uniform(0.3, 1.5, (20, 6))
    extras = {"grid": np.ones((3, 3, 3))} if chosen.get("medium") == "grid" else {}
    plain = model(**chosen, **extras).rhs(states)
    for parameter in model.parameters:
        if parameter.name in hidden:
            other = parameter.default + 0.25 * (parameter.default + 1.0)
            changed = model(**chosen, **extras, **{parameter.name: min(other, parameter.maximum)}).rhs(states)
            assert np.array_equal(plain, changed, equal_nan=True), parameter.name
