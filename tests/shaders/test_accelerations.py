"""Accelerations change the time, not the picture: every pass bit for bit. Only here is the GPU its own truth."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.scene import Light, Material, Scene
from addon.core.settings import EARLY_TERMINATIONS
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders import scenes

PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps", "Error")


def curved_scene(count=30):
    """Objects all around a small hole: rays that hit, escape, and fall in."""
    return scenes.mixed(
        MODELS["schwarzschild"](mass=0.3),
        scenes.camera(40, 30, half=0.6),
        count=count,
        lights=(Light("SUN", (3.0, 3.0, 3.0), direction=(0.0, 0.6, -0.8)),),
        ambient=(0.1, 0.1, 0.1),
        materials=(Material(specular=0.5),),
    )


def identical(one, other):
    for name in one:
        different = (one[name] != other[name]).any(axis=-1)
        assert not different.any(), f"{name}: {different.sum()} pixels differ"


BASES = {
    "doubling": {"step_control": "doubling", "segments": 400, "tolerance": 1e-2},
    "constant": {"step_control": "constant", "step": 0.05, "segments": 120},
}
VARIANTS = {
    **{f"early termination {value}": {"early_termination": value} for value in EARLY_TERMINATIONS},
    "batches of 1": {"batch_size": 1},
    "batches of 7": {"batch_size": 7},
    "no group culling": {"cull_batches": False},
    "nothing": {"early_termination": "off", "batch_size": 1, "cull_batches": False},
}


@pytest.fixture(scope="module")
def reference(egl):
    """The default accelerations, for each step control."""
    found = {}
    for name, base in BASES.items():
        passes = PASSES if name == "doubling" else tuple(each for each in PASSES if each != "Error")
        found[name] = render(curved_scene(), scenes.papers(passes=passes, **base)).passes
    return found


def test_the_scene_has_rays_of_every_kind(reference):
    for passes in reference.values():
        assert {Status.HIT, Status.ESCAPED, Status.ABSORBED} <= set(np.unique(passes["Status"]))


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("variant", VARIANTS)
def test_every_acceleration_gives_the_same_picture(reference, base, variant):
    settings = scenes.papers(passes=tuple(reference[base]), **(BASES[base] | VARIANTS[variant]))
    identical(reference[base], render(curved_scene(), settings).passes)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_coincident_triangles(variant, model):
    """Three sheets in one place, in other orders: which one is seen is a matter of taste, but not of the batches."""
    sheets = [scenes.random_soup(30, smooth=False, seed=9) for _ in range(3)]
    soup = scenes.joined(*sheets)
    soup.object_index[:] = np.arange(1, 91)
    view = scenes.camera(32, 24, half=0.6)
    scene = Scene(view, MODELS[model](**({"mass": 0.3} if model == "schwarzschild" else {})), triangles=soup)
    base = {"passes": ("Depth", "Object Index"), "step_control": "constant", "step": 0.05, "segments": 60}
    # steps_per_segment 7: chords end anywhere, so that the depth's rounding matters.
    one = render(scene, scenes.papers(**base, steps_per_segment=7)).passes
    assert (one["Object Index"] > 0).mean() > 0.1
    identical(one, render(scene, scenes.papers(**base, steps_per_segment=7, **VARIANTS[variant])).passes)


@pytest.mark.parametrize("distance", [1e2, 1e4])
def test_group_culling_of_a_far_scene(distance):
    """Seen through a long lens: chords are long and everything rounds; the groups must not lose what is hit."""
    view = scenes.camera(40, 40, (0, -distance, 0.1 * distance), half=2.5 / distance)
    scene = scenes.mixed(view=view, count=80)
    passes = ("Depth", "Object Index", "Status")
    one = render(scene, scenes.papers(passes=passes)).passes
    assert (one["Status"] == Status.HIT).mean() > 0.2
    identical(one, render(scene, scenes.papers(passes=passes, cull_batches=False)).passes)


def test_a_second_render_is_the_same_picture():
    settings = scenes.papers(passes=("Combined", "Depth", "Steps"), segments=200)
    identical(render(curved_scene(), settings).passes, render(curved_scene(), settings).passes)
