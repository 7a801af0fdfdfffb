"""What is compared in Table 1 and Figure 5: the paper's pipeline without acceleration, and others with no more error.

Each of the others takes the loosest tolerance that keeps the 99th percentile of the direction's error at that of
the first; the fused pipeline takes the integrator that is faster in a small picture.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from addon.core.models import Model
from addon.core.scene import Scene
from addon.core.settings import Settings

from . import scenes, settings
from .errors import Rays
from .measure import frame_job, interleaved
from .mode import Mode

LONGEST = 8.0 * settings.WAY  # the truth is needed as far as the longest last step goes
NOISY = 1e-6  # DOP853's tolerance for a refraction whose noise has no high derivatives
SMOOTH = 1e-9
TRIAL_SIZE = (128, 96)
TRIALS = 2
INTEGRATORS = ("bogacki_shampine_32", "dormand_prince_54", "nystrom_64")


@dataclass(frozen=True)
class Chosen:
    """error : radians, the 99th percentile."""

    settings: Settings
    error: float

    @property
    def label(self) -> str:
        """What was chosen, in words."""
        return f"{self.settings.integrator}, {self.settings.tolerance:.2g}"


def matched(
    model: Model, mode: Mode, size: tuple[int, int], steps: int, segments: int, spheres: int
) -> dict[str, Chosen]:
    """unaccelerated, accelerated, fused : Chosen."""
    noisy = model.name == "refraction"
    sampled, relative = (mode.noisy_rays, NOISY) if noisy else (mode.rays, SMOOTH)
    rays = Rays(model, scenes.camera(size), sampled, LONGEST, relative)
    plain = settings.paper(steps, segments)
    bound = rays.error(plain)

    def fused(integrator: str) -> Chosen:
        # A chord may be as far from the ray as the ray is from the truth.
        chord = min(bound, 1.0)
        return Chosen(*rays.loosest(lambda value: settings.fused(value, chord, integrator=integrator), bound))

    scene = scenes.sphere_scene(model, TRIAL_SIZE, spheres)
    return {
        "unaccelerated": Chosen(plain, bound),
        "accelerated": Chosen(*rays.loosest(lambda value: settings.accelerated(steps, segments, value), bound)),
        "fused": fastest(scene, map(fused, INTEGRATORS)),
    }


def fastest(scene: Scene, candidates: Iterable[Chosen]) -> Chosen:
    """Of those that keep the bound; the first where none does, with its error of NaN."""
    candidates = list(candidates)
    keeping = [one for one in candidates if math.isfinite(one.error)] or candidates[:1]
    jobs = {str(i): frame_job(scene, one.settings) for i, one in enumerate(keeping)}
    timings = interleaved(jobs, TRIALS)
    return min(enumerate(keeping), key=lambda item: timings[str(item[0])].best("trace"))[1]
