"""Times: the minimum of several after a warm-up, the median beside it; what is compared runs in turn."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from addon.core import device as gpu
from addon.core import trace
from addon.core.pipelines.tile import Stopwatch
from addon.core.scene import Scene
from addon.core.settings import Settings

Job = Callable[[], Mapping[str, float]]  # does one run and returns its milliseconds by stage


@dataclass
class Timings:
    """runs : milliseconds by stage, one mapping for each timed run."""

    runs: list[Mapping[str, float]] = field(default_factory=list)

    def best(self, *stages: str) -> float:
        """Milliseconds of these stages together: the smallest of all runs."""
        return min(self._sums(stages))

    def median(self, *stages: str) -> float:
        return statistics.median(self._sums(stages))

    def _sums(self, stages: tuple[str, ...]) -> list[float]:
        return [sum(run.get(stage, 0.0) for stage in stages) for run in self.runs]

    def as_json(self) -> dict[str, dict[str, float]]:
        """Stage -> minimum and median, milliseconds."""
        stages = {stage: None for run in self.runs for stage in run}
        return {stage: {"min": self.best(stage), "median": self.median(stage)} for stage in stages}


def interleaved(jobs: Mapping[str, Job], repeats: int, warm: bool = True) -> dict[str, Timings]:
    """Run all jobs in turn, so that whatever else the machine does meets all of them."""
    timings = {name: Timings() for name in jobs}
    if warm:
        for job in jobs.values():
            job()
    for _ in range(repeats):
        for name, job in jobs.items():
            timings[name].runs.append(job())
    return timings


def frame_job(scene: Scene, settings: Settings) -> Job:
    """A whole frame; "frame" is the time by the clock, without the compiler's."""

    def job() -> Mapping[str, float]:
        begin = time.perf_counter()
        frame = trace.render(scene, settings)
        whole = 1e3 * (time.perf_counter() - begin)
        stages = frame.statistics.milliseconds
        return {**stages, "frame": whole - stages.get("compile", 0.0)}

    return job


class KeptFrame:
    """A scene that stays on the device, so that a frame is trace and read-back.

    preparing : milliseconds of "pack" and "upload";  bytes : of textures
    """

    def __init__(self, scene: Scene, settings: Settings):
        watch = Stopwatch()
        self.size = scene.camera.size
        with watch.stage("pack"):
            packed = trace.pack_for(scene, settings)
        asked = frozenset(trace.OUTPUTS[name] for name in settings.passes if name in trace.OUTPUTS)
        request = trace.make_request(scene, settings, packed, trace.camera_uniforms(scene), asked)
        tile = (min(trace.TILE, side) for side in self.size)
        self.pipeline = trace.make_pipeline(request, self.size, *tile, watch)
        self.preparing, self.watch = dict(watch.milliseconds), watch

    @property
    def bytes(self) -> int:
        return self.pipeline.uploaded_bytes

    def __call__(self) -> Mapping[str, float]:
        self.watch.milliseconds.clear()
        for x, y, width, height, _ in trace.jobs(*self.size, 1, self.pipeline.tile_size):
            gpu.run(lambda _, x=x, y=y, width=width, height=height: self.pipeline.trace(width, height, (x, y)))
        return dict(self.watch.milliseconds)


def wall_job(work: Callable[[], object]) -> Job:
    """Any work; its stage is "frame"."""

    def job() -> Mapping[str, float]:
        begin = time.perf_counter()
        work()
        return {"frame": 1e3 * (time.perf_counter() - begin)}

    return job
