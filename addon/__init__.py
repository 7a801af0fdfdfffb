"""Blender's side: what is registered, in this order, and unregistered in the opposite one.

Imports wait for register(), so that `addon.core` serves scripts and tests without Blender.
"""

from importlib import import_module

PARTS = (
    "properties",
    "preferences",
    "status_colors",
    "engine",
    "operators",
    "presets",
    "report_operators",
    "panels",
    "commands",
)


def parts():
    return [import_module(f".{name}", __package__) for name in PARTS]


def register():
    registered = []
    try:
        for part in parts():
            part.register()
            registered.append(part)
    except Exception:
        for part in reversed(registered):
            part.unregister()
        raise


def unregister():
    """Stops what runs in the background first."""
    from .core import device
    from .job import stop_all

    stop_all()
    for part in reversed(parts()):
        part.unregister()
    device.shutdown()
