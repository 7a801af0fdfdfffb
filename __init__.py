"""Nonlinear Rays: what Blender loads. Blender's modules are imported on register only."""


def register():
    from .addon import register

    register()


def unregister():
    from .addon import unregister

    unregister()
