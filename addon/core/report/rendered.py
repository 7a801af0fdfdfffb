"""What a setting gives in the user's own picture, objects and all, beside the reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..reference import angles
from ..scene import Scene
from ..settings import Settings
from ..status import Status
from ..trace import render
from . import errors
from .cases import Case
from .hits import NONE, true_hits
from .work_precision import Progress

PASSES = ("Status", "Position", "Direction", "Object Index")
NAN = float("nan")


class Checked:
    """The rays through the middles of side x side pixels, of which the reference knows what they see."""

    def __init__(self, scene: Scene, case: Case, side: int, progress: Progress):
        self.case, self.scene = case, _with_surfaces_numbered(scene, case.small(side, side).camera)
        self.positions, directions = case.pixel_rays(side, side)
        finder = true_hits(self.scene, len(self.positions))
        self.truth = case.truth(
            self.positions,
            directions,
            on_step=finder.on_step,
            progress=lambda part: progress(part, "The reference, with the scene's objects"),
        )
        self.hit = finder.hits.surface != NONE
        self.hit_position = finder.hits.position
        objects = np.concatenate([self.scene.triangles.object_index, self.scene.spheres.object_index, [NONE]])
        self.object = objects[finder.hits.surface]
        self.known = self.hit | self.truth.converged
        in_chart = case.in_chart(self.positions, directions)
        self.away = ~errors.near_critical(case.model, self.positions, in_chart)

    def figures(self, settings: Settings) -> dict[str, float]:
        """99th percentiles, pixels, without the near-critical band. sky_px, objects_px : of rays that see what the
        reference sees: the angle between the directions in which they escape; how far the hit is beside the true ray,
        as an angle seen from the camera.  rendered_px : of both, and of rays that see something else, as infinite
        """
        passes = render(self.scene, replace(self.case.seen(settings), passes=PASSES)).passes
        status, position, direction, seen = (passes[name].reshape(len(self.hit), -1) for name in PASSES)
        status, placement = status[:, 0].astype(int), self.scene.placement
        position, direction = placement.points_to_model(position), placement.directions_to_model(direction)
        hits = status == Status.HIT
        same_object = hits & self.hit & (seen[:, 0] == self.object)
        same_end = ~hits & ~self.hit & (status == self.truth.status)
        counted = self.known & self.away
        angle = np.full(len(status), np.nan)
        leaves = counted & same_end & np.isin(status, (Status.ESCAPED, Status.LEFT_DOMAIN))
        angle[leaves] = angles(direction[leaves], self.truth.direction[leaves])
        met = counted & same_object
        gap = position[met] - self.hit_position[met]
        beside = gap - np.sum(gap * direction[met], axis=1, keepdims=True) * direction[met]
        way = np.linalg.norm(self.hit_position[met] - self.positions[met], axis=1)
        angle[met] = np.linalg.norm(beside, axis=1) / way
        pixels = angle / self.case.pixel
        elsewhere = ~(same_object | same_end)
        pixels[counted & elsewhere] = np.inf
        return {
            "rendered_px": _percentile(pixels[~np.isnan(pixels)]),
            "sky_px": _percentile(pixels[leaves]),
            "objects_px": _percentile(pixels[met]),
            "hit_distance_p99": _percentile(np.linalg.norm(gap, axis=1)) * placement.scale,
            "elsewhere_percent": 100.0 * float(elsewhere[counted].mean()) if counted.any() else NAN,
            "checked_rays": int(counted.sum()),
        }


def _with_surfaces_numbered(scene: Scene, camera) -> Scene:
    """With another camera, and with an object index of its own for every object and material: users leave it 0."""
    surfaces = (scene.triangles, scene.spheres)
    pairs = [np.stack([each.object_index, each.material_index], axis=1) for each in surfaces]
    _, number = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    number = number.ravel().astype(np.int32)
    triangles = replace(scene.triangles, object_index=number[: len(scene.triangles)])
    spheres = replace(scene.spheres, object_index=number[len(scene.triangles) :])
    return replace(scene, camera=camera, triangles=triangles, spheres=spheres)


def _percentile(values: np.ndarray) -> float:
    """Of values that may be infinite, the one that as many of 100 are not above."""
    return float(np.percentile(values, 99, method="higher")) if len(values) else NAN
