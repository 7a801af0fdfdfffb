"""Every model's picture in the limit of no strength is that of the straight model: the same hits, at the same depth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.settings import Settings
from addon.core.trace import render
from tests.shaders import scenes, truth
from tests.shaders.smooth_rays import PIPELINES

CAMERA = (0.0, -8.0, 1.0)
VOXELS = np.random.default_rng(4).random((4, 4, 4)).astype(np.float32)
NEWTON = {f"f{axis}": f"-k * {axis} / (r^2 + 1)^1.5" for axis in "xyz"}

# (model, values of the law, the value that goes to its limit, the limit or the nearest that is allowed, one near it)
#
# Near it a ray is shifted by f tau^2 / 2 or turned by what the law says, 1e-6 of the distance at the most.
LIMITS = [
    ("schwarzschild", {}, "mass", 0.0, 1e-7),
    ("kerr", {"spin": 0.9}, "mass", 0.0, 1e-7),
    ("wormhole", {}, "throat_radius", 1e-6, 1e-4),
    ("lorenz", {}, "strength", 0.0, 1e-11),
    ("roessler", {}, "strength", 0.0, 1e-11),
    ("radial_potential", {"xi": "cubic"}, "strength", 0.0, 1e-8),
    ("radial_potential", {"xi": "coulomb", "core_radius": 1e-6}, "k", 0.0, 1e-9),
    ("radial_potential", {"xi": "yukawa", "core_radius": 1e-6}, "zeta", 0.0, 1e-9),
    ("radial_potential", {"xi": "expression", "core_radius": 1e-6}, "k", 0.0, 1e-9),
    ("custom", NEWTON, "parameters", {"k": 0.0}, {"k": 1e-8}),
    ("refraction", {"medium": "explosion", "radius": 3.0}, "strength", 0.0, 1e-7),
    ("refraction", {"medium": "explosion", "radius": 3.0}, "time", 0.0, 1e-12),
    ("refraction", {"medium": "shell", "radius": 3.0}, "strength", 0.0, 1e-7),
    ("refraction", {"medium": "shell", "radius": 3.0, "stepping": "snell"}, "strength", 0.0, 1e-7),
    ("refraction", {"medium": "mirage"}, "mirage_b", 0.0, -1e-12),
    ("refraction", {"medium": "linear"}, "gradient", 0.0, 1e-8),
    ("refraction", {"medium": "luneburg"}, "radius", 1e6, 1e5),
    ("refraction", {"medium": "fisheye"}, "radius", 1e6, 1e5),
    ("refraction", {"medium": "isotropic"}, "mass", 0.0, 1e-7),
    ("refraction", {"medium": "grid", "grid": VOXELS}, "strength", 0.0, 1e-7),
    ("refraction", {"medium": "expression"}, "formula", "1", "1 + 1e-8 * exp(-r^2)"),
]


def scene(model):
    """Triangles, flattened so that they face the camera more than not, and spheres before the sky."""
    corners = scenes.random_soup(40).positions
    middles = corners.mean(axis=1, keepdims=True)
    facing = scenes.triangles(middles * (1.0, 0.7, 1.0) + (corners - middles) * (1.0, 0.3, 1.0))
    return replace(scenes.mixed(model, scenes.camera(48, 36, CAMERA)), triangles=facing)


@cache
def exact():
    """(the pixels' distances, infinite without a hit; how far an error across the ray lengthens it there): float64."""
    straight = scene(scenes.STRAIGHT)
    cast, rays = truth.cast(straight), truth.camera_rays(straight.camera)[1]
    positions = straight.triangles.positions
    faces = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    normals = np.where(cast.is_sphere[..., None], cast.normal, faces[np.where(cast.is_sphere, 0, cast.index)])
    return cast.distance, 1.0 / np.abs(np.sum(normals * rays, axis=2))


@cache
def straight_objects(pipeline):
    return passes(scenes.STRAIGHT, pipeline)["Object Index"]


def passes(model, pipeline):
    settings = Settings(
        pipeline=pipeline,
        integrator="dormand_prince_54",
        step_control="embedded",
        tolerance=1e-6,
        passes=("Object Index", "Position"),
    )
    return render(scene(model), settings).passes


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("near", [False, True], ids=["at the limit", "near it"])
@pytest.mark.parametrize(("name", "law", "value", "limit", "close"), LIMITS)
def test_straight_limit(name, law, value, limit, close, near, pipeline):
    """The objects of the straight model's picture, in every pixel; depths within physics.md's 1e-5 relative on surfaces
    that face the camera within 45 degrees, and on all others but for their slant, 1 / cos.
    """
    found = passes(MODELS[name](**law, **{value: close if near else limit}), pipeline)
    differ = (found["Object Index"] != straight_objects(pipeline)).sum()
    hit = found["Object Index"][..., 0] > 0
    distance, slant = (values[hit] for values in exact())
    error = np.abs(np.linalg.norm(found["Position"].astype(float) - CAMERA, axis=2)[hit] / distance - 1.0)
    facing = slant < np.sqrt(2.0)
    print(
        f"{name} {law.get('medium', law.get('xi', ''))}, {pipeline}: {differ} of {hit.size} pixels differ; "
        f"depth: facing {error[facing].max():.1e}, all but for their slant {(error / slant).max():.1e}, bound 1e-5"
    )
    assert 0.2 < hit.mean() < 0.8 and facing.sum() > 100
    assert differ == 0
    assert error[facing].max() <= 1e-5
    assert (error / slant).max() <= 1e-5
