"""Which of the settings tried is the cheapest that is precise enough, and how to say so."""

from __future__ import annotations

from ..settings import Settings
from .methods import SEGMENTS, Method

GOALS = (1.0, 0.1)  # pixels, of the 99th percentile
MARGIN = 0.25  # of the goal: measured, the 99th percentile of other rays of the picture was 3.7 times as large
MISCLASSIFIED = 0.5  # percent of the rays that a recommended setting may end elsewhere
TIE = 1.15  # times the least time: what the least of several runs differs by from one report to the next
CONTENDER = 1.5  # times the least time: what is timed again before one of them is recommended


def near_the_cheapest(rows: list[dict], goal: float, factor: float) -> list[dict]:
    """A case's rows with a 99th percentile safely below the goal, pixels, where hardly a ray ends elsewhere, that take
    at most `factor` times the time of the cheapest of them.
    """
    good = [
        row
        for row in rows
        if row["error_p99_px_outside_band"] < MARGIN * goal
        and row["misclassified_percent_outside_band"] <= MISCLASSIFIED
        and row["failed_percent"] == 0.0
    ]
    least = min((row["ns_per_ray"] for row in good), default=float("nan"))
    return [row for row in good if row["ns_per_ray"] <= factor * least]


def cheapest(rows: list[dict], goal: float) -> dict | None:
    """Of the rows that keep within the goal, pixels."""
    return min(near_the_cheapest(rows, goal, 1.0), key=lambda row: row["ns_per_ray"], default=None)


def recommendation(rows: list[dict], goal: float) -> dict | None:
    """The cheapest of the rows that keep within the goal, pixels; of those whose times are a tie the most precise, for
    errors come again in every report, and an order by time does not.
    """
    tied = near_the_cheapest(rows, goal, TIE)
    return min(tied, key=lambda row: row["error_p99_px_outside_band"], default=None)


def settings_of(row: dict, most_steps: int) -> Settings:
    """The settings of a row."""
    tried = Method(row["pipeline"], row["integrator"], row["step_control"])
    value = {"step" if row["step_control"] == "constant" else "tolerance": row["value"]}
    return Settings(
        pipeline=tried.pipeline,
        integrator=tried.integrator,
        step_control=tried.step_control,
        steps_per_segment=row["steps_per_segment"],
        segments=SEGMENTS,
        max_steps=most_steps,
        **value,
    )


def sentence(rows: list[dict], goal: float) -> str:
    """A recommendation in words."""
    row = recommendation(rows, goal)
    if row is None:
        return f"No setting tried has errors safely below {goal:g} pixel."
    method = Method(row["pipeline"], row["integrator"], row["step_control"])
    what = "step" if row["step_control"] == "constant" else "tolerance"
    unit = "model lengths" if row["step_control"] == "constant" else "radians"
    return (
        f"Cheapest safely below {goal:g} pixel: {method.label}, {what} {row['value']:.3g} {unit}: "
        f"{row['error_p99_px_outside_band']:.2g} pixel (99th percentile), {row['ns_per_ray']:.0f} ns a ray."
    )
