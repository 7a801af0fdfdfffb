"""The laws of light, one a file. A new file with a Model subclass in it is found by itself: see CONTRIBUTING.md."""

from __future__ import annotations

import importlib
import pkgutil

from .base import Model, ParameterError
from .parameter import Option, Parameter, Text

__all__ = ["MODELS", "Model", "Option", "Parameter", "ParameterError", "Text"]


def _found() -> dict[str, type[Model]]:
    """Model name -> class, for every module of this package, in the order the menu shows them."""
    for module in pkgutil.iter_modules(__path__):
        importlib.import_module(f"{__name__}.{module.name}")
    classes = sorted(Model.__subclasses__(), key=lambda model: (model.menu_order, model.name))
    return {model.name: model for model in classes}


MODELS: dict[str, type[Model]] = _found()
