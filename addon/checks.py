"""What is wrong with the scene and its settings, found before the press and cheap enough for a panel's draw."""

from __future__ import annotations

import bpy

from .core.models import ParameterError
from .core.settings import SettingsError
from .core.trace import integrator_for
from .export import find_problems
from .model_properties import model_and_placement
from .properties import settings_from


def problems(scene: bpy.types.Scene) -> list[str]:
    """Sentences, each with its next action: what stops a render first, then what the picture would lack."""
    return list(dict.fromkeys(_settings_problems(scene) + find_problems(scene)))


def _settings_problems(scene: bpy.types.Scene) -> list[str]:
    chosen = scene.nonlinear_rays
    if chosen.scale <= 0.0:
        return ["The model's scale is zero. Set Scale above zero."]
    found = []
    if chosen.pass_error and chosen.step_control == "constant":
        found.append("Pass 'Error' needs a step control that estimates it. Set Step Control to Step Doubling.")
    try:
        model, placement = model_and_placement(scene)
        settings = settings_from(scene, None)
        if model.curved:
            integrator_for(model, settings)
    except (ParameterError, SettingsError) as error:
        return [*found, str(error)]
    if scene.camera is not None:
        position = placement.points_to_model(scene.camera.matrix_world.translation)
        problem = model.observer_problem(settings.observer, position)
        found += [problem] if problem else []
    return found
