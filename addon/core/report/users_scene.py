"""What the report says of a user's scene: which settings to use, and what it is near."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..scene import Scene
from ..settings import Settings
from ..trace import render
from .cases import Case
from .clock import WARM_UP, Clock, run_in_turns
from .recommend import CONTENDER, GOALS, cheapest, near_the_cheapest, recommendation, settings_of
from .rendered import Checked
from .work_precision import Effort, Progress

AGAIN = 0.5  # of the goal: the 99th percentiles of two samples of a picture differ by up to a factor of two
TRIES = 8  # settings that are rendered for a goal
MORE = 8  # rays a side, more than the settings were measured with
RIVALS = 6  # settings that are timed with the objects, for a goal
PATIENCE = 0.5  # seconds of the runs of each
KEPT = ("model", "pipeline", "integrator", "step_control", "value", "steps_per_segment", "ns_per_ray")
TIMING = "Time, with the scene's objects"


def recommended(scene: Scene, case: Case, rows: Sequence[dict], effort: Effort, progress: Progress) -> list[dict]:
    """A record for every goal that a setting reaches. rows : as measured without the objects

    What these rows promise is checked on other rays of the picture with the objects; a setting that does not keep it
    gives way to the next dearer one. That one and its near rivals are timed again with the objects, which cost more
    where the tolerance is small and rays are cut into many chords.
    """
    checked = Checked(scene, case, effort.side + MORE, lambda part, text: progress(0.6 * part, text))
    with_objects = replace(case, scene=checked.scene)
    found = []
    for index, goal in enumerate(GOALS):

        def told(part: float, text: str, index: int = index) -> None:
            progress(0.6 + 0.4 * (index + part) / len(GOALS), text)

        kept = _kept(checked, list(rows), goal, effort, cheapest, told)
        if kept is None:
            continue
        rivals = [row for row in rows if row["ns_per_ray"] >= kept[0]["ns_per_ray"]]
        rivals = sorted(near_the_cheapest(rivals, goal, CONTENDER), key=lambda row: row["ns_per_ray"])[:RIVALS]
        clocks = [Clock(with_objects, settings_of(row, effort.most_steps), effort.picture) for row in rivals]
        run_in_turns(clocks, effort.repeats + effort.again, PATIENCE, lambda part: told(0.4 * part, TIMING))
        timed = [row | clock.figures() for row, clock in zip(rivals, clocks, strict=True)]
        row, figures = _kept(checked, timed, goal, effort, recommendation, told)
        record = {key: row[key] for key in KEPT} | {"goal_px": goal, "promised_px": row["error_p99_px_outside_band"]}
        chosen = case.seen(settings_of(row, effort.most_steps))
        rendered = stages(scene, chosen, lambda part, text, told=told: told(0.5 + 0.5 * part, text))
        found.append(record | figures | rendered)
    return found


def _kept(
    checked: Checked,
    rows: list[dict],
    goal: float,
    effort: Effort,
    choose: Callable[[list[dict], float], dict | None],
    progress: Progress,
) -> tuple[dict, dict] | None:
    """The first of the rows chosen that keeps within the goal, and its figures."""
    for _ in range(TRIES):
        row = choose(rows, goal)
        if row is None:
            return None
        progress(0.0, "What may be recommended, with the scene's objects")
        figures = checked.figures(settings_of(row, effort.most_steps))
        if figures["rendered_px"] <= AGAIN * goal:
            return row, figures
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
