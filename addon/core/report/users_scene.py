"""What the report says of a user's scene: which settings to use, and what it is near."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..scene import Scene
from ..settings import Settings
from ..trace import render
from .cases import Case
from .clock import WARM_UP
from .recommend import GOALS, recommendation, settings_of
from .rendered import Checked
from .work_precision import Effort, Progress

AGAIN = 0.5  # of the goal: the 99th percentiles of two samples of a picture differ by up to a factor of two
TRIES = 8  # settings that are rendered for a goal
MORE = 8  # rays a side, more than the settings were measured with


def recommended(scene: Scene, case: Case, rows: Sequence[dict], effort: Effort, progress: Progress) -> list[dict]:
    """A record for every goal that a setting reaches. What was measured without the objects is checked on other rays of
    the picture with them: where it does not keep what it promised, the next dearer one is tried.
    """
    checked = Checked(scene, case, effort.side + MORE, lambda part, text: progress(0.6 * part, text))
    found = []
    for index, goal in enumerate(GOALS):

        def told(part: float, text: str, index: int = index) -> None:
            progress(0.6 + 0.4 * (index + part) / len(GOALS), text)

        row = _kept(checked, list(rows), goal, effort, told)
        if row is not None:
            chosen = case.seen(settings_of(row, effort.most_steps))
            found.append(row | stages(scene, chosen, lambda part, text, told=told: told(0.5 + 0.5 * part, text)))
    return found


def _kept(checked: Checked, rows: list[dict], goal: float, effort: Effort, progress: Progress) -> dict | None:
    """The first recommendation that keeps within the goal."""
    for index in range(TRIES):
        row = recommendation(rows, goal)
        if row is None:
            return None
        progress(0.5 * index / TRIES, "What is recommended, with the scene's objects")
        figures = checked.figures(settings_of(row, effort.most_steps))
        if figures["rendered_px"] <= AGAIN * goal:
            kept = ("model", "pipeline", "integrator", "step_control", "value", "steps_per_segment", "ns_per_ray")
            promised = {"goal_px": goal, "promised_px": row["error_p99_px_outside_band"]}
            return {key: row[key] for key in kept} | promised | figures
        rows = [other for other in rows if other is not row]
    return None


def stages(scene: Scene, settings: Settings, progress: Callable[[float, str], None]) -> dict[str, float]:
    """Milliseconds of every stage of rendering the scene once. compile_ms : with the first draw, of a few pixels, in
    which drivers go on compiling; the other stages are those of the next picture
    """
    few = replace(scene.camera, width=WARM_UP, height=WARM_UP, region=None)
    first = render(replace(scene, camera=few), settings).statistics.milliseconds
    then = render(scene, settings, progress=lambda part, _: progress(part, "The recommended setting"))
    milliseconds = then.statistics.milliseconds | {"compile": first["compile"] + first["trace"]}
    return {f"{stage}_ms": value for stage, value in milliseconds.items()}
