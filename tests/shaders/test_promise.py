"""What the report recommends for a scene, rendered, is as right as it promised: scenes made at random, whose laws,
cameras, observers, objects and places nobody has looked at.
"""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.reference import angles
from addon.core.report import work_precision
from addon.core.report.cases import of_scene
from addon.core.report.hits import NONE, true_hits
from addon.core.report.methods import Method
from addon.core.report.recommend import settings_of
from addon.core.report.users_scene import recommended
from addon.core.report.work_precision import QUICK, run_case
from addon.core.scene import Placement, Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders.scenes import camera, rotation, spheres, triangles

TRIED = (
    Method("fused", "runge_kutta_4", "doubling"),
    Method("fused", "bogacki_shampine_32", "embedded"),
    Method("fused", "dormand_prince_54", "embedded"),
    Method("fused", "nystrom_64", "embedded"),
)
RAYS = 600
MOST_BEYOND = 15  # where 1 in 100 is beyond, 6 of 600 are; more than 15 with a probability of 5e-4 (Poisson)


def laws(generator):
    yield MODELS["schwarzschild"](mass=generator.uniform(0.5, 1.5))
    yield MODELS["kerr"](spin=generator.uniform(-0.95, 0.95))
    yield MODELS["wormhole"](throat_radius=generator.uniform(0.5, 2.0))
    yield MODELS["radial_potential"](xi="yukawa")


def random_scene(seed):
    """Four spheres and thirty triangles around the centre of a law, somewhere in the world, and their observer."""
    generator = np.random.default_rng(seed)
    laws_to_draw = list(laws(generator))
    model = laws_to_draw[seed % len(laws_to_draw)]
    turned = rotation(*generator.uniform(-3.0, 3.0, 3))
    placement = Placement(generator.uniform(-50.0, 50.0, 3), turned, generator.uniform(0.3, 3.0))

    def around(n, near, far):
        way = generator.normal(size=(n, 3))
        way *= generator.uniform(near, far, n)[:, None] / np.linalg.norm(way, axis=1, keepdims=True)
        return placement.position + placement.scale * way

    corners = around(30, 4.0, 9.0)[:, None] + placement.scale * generator.normal(size=(30, 3, 3))
    balls = spheres(around(4, 4.0, 9.0), placement.scale * generator.uniform(0.4, 1.2, 4), object_index=[0] * 4)
    eye = around(1, 12.0, 20.0)[0]
    view = camera(160, 120, eye, around(1, 0.0, 2.0)[0], half=generator.uniform(0.3, 0.6))
    scene = Scene(view, model, placement, triangles(corners, object_index=[0] * 30), balls)
    observer = generator.choice([name for name in model.observers if name != "falling"])
    return scene, Settings(observer=str(observer), observer_velocity=tuple(generator.uniform(-0.4, 0.4, 3)))


def beyond(scene, case, settings, goal, seed):
    """How many of RAYS pixels of the whole picture, drawn at random, are not within the goal, pixels: the direction in
    which the ray escapes, or its hit beside the true ray, against float64; or something else is seen there.
    """
    columns, rows = scene.camera.size
    chosen = np.random.default_rng([seed, 1]).choice(columns * rows, RAYS, replace=False)
    passes = render(scene, replace(case.seen(settings), passes=("Status", "Position", "Direction"))).passes
    status, position, direction = (
        passes[name].reshape(columns * rows, -1)[chosen] for name in ("Status", "Position", "Direction")
    )
    origins, looks = (rays[chosen] for rays in case.pixel_rays(columns, rows))
    finder = true_hits(scene, RAYS)
    truth = case.truth(origins, looks, on_step=finder.on_step)
    met = finder.hits.surface != NONE
    true_status = np.where(met, Status.HIT, truth.status)
    error = np.where(true_status == status[:, 0], 0.0, np.inf)
    direction = scene.placement.directions_to_model(direction)
    escaped = (error == 0.0) & (true_status == Status.ESCAPED)
    error[escaped] = angles(direction, truth.direction)[escaped]
    hit = (error == 0.0) & met
    gap = scene.placement.points_to_model(position) - finder.hits.position
    across = np.linalg.norm(np.cross(gap, direction), axis=1)
    error[hit] = (across / np.linalg.norm(finder.hits.position - origins, axis=1))[hit]
    known = met | truth.converged
    assert known.mean() > 0.99 and met.sum() > 10 and escaped.sum() > 10  # there is something to be right about
    return int((error[known] > goal * case.pixel).sum())


@pytest.mark.parametrize("seed", [101, 202, 303, 404])
def test_the_recommended_settings_keep_what_the_report_promised(egl, monkeypatch, seed):
    """The report is made in its quick form, and checked on pixels that it has not seen."""
    monkeypatch.setattr(work_precision, "METHODS", TRIED)
    scene, settings = random_scene(seed)
    case = of_scene(scene, settings)
    rows = run_case(case, QUICK, lambda fraction, text: None)
    found = recommended(scene, case, rows, QUICK, lambda fraction, text: None)
    assert [row["goal_px"] for row in found] == [1.0, 0.1]
    for row in found:
        number = beyond(scene, case, settings_of(row, QUICK.most_steps), row["goal_px"], seed)
        print(
            f"{scene.model.label}, {settings.observer}: {row['integrator']} {row['value']:g}: "
            f"{number} of {RAYS} rays beyond {row['goal_px']:g} pixel; promised {row['rendered_px']:.2g}"
        )
        assert number <= MOST_BEYOND
