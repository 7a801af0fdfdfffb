"""python -m tests.shaders.driver_frames FILE: frames of this process's driver, and its name, into an .npz file."""

import sys

import numpy as np

from addon.core import device as gpu
from addon.core.models import MODELS
from addon.core.scene import Environment, Image, Light, Material
from addon.core.settings import PIPELINES, Settings
from addon.core.trace import render
from tests.shaders import scenes

PASSES = ("Combined", "Depth", "Normal", "Object Index", "Direction", "Status")


def frames():
    """Of laws of all kinds, with a little of everything to be seen: name -> Frame."""
    generator = np.random.default_rng(4)
    voxels = generator.random((4, 4, 4), np.float32)
    models = {
        "straight": scenes.STRAIGHT,
        "hole": MODELS["schwarzschild"](mass=0.3),
        "rotating hole": MODELS["kerr"](mass=0.3),
        "lens": MODELS["refraction"](medium="luneburg", radius=2.0),
        "volume": MODELS["refraction"](medium="grid", grid=voxels, strength=0.1),
        "formula": MODELS["refraction"](medium="expression", formula="1 + 0.1*exp(-r^2)"),
        "ball of force": MODELS["radial_potential"](xi="cubic"),
    }
    parts = {
        "materials": (Material(base_image=0, specular=0.5),),
        "images": (Image("noise", generator.random((9, 16, 4), np.float32), "MIRROR"),),
        "lights": (Light("POINT", (90.0, 80.0, 70.0), (3.0, -5.0, 4.0)),),
        "environment": Environment(faces=generator.random((6, 8, 8, 3), np.float32)),
    }
    for name, model in models.items():
        scene = scenes.mixed(model, scenes.camera(32, 24), **parts)
        for pipeline in PIPELINES:
            yield f"{name}, {pipeline}", render(scene, Settings(pipeline=pipeline, passes=PASSES))


if __name__ == "__main__":
    found = {f"{name}/{each}": pixels for name, frame in frames() for each, pixels in frame.passes.items()}
    np.savez(sys.argv[1], driver=gpu.describe(), **found)
