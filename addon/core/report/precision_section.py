"""What the page says about error and time: what to choose, then every case by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from . import precision_diagram
from .cases import Case
from .columns import CHOICE_COLUMNS, WORK_COLUMNS
from .errors import BAND
from .methods import LABELS, Method
from .page import Page
from .plots import Diagram
from .recommend import GOALS, MARGIN, TIE, recommendation, sentence
from .work_precision import Effort

Measured = Sequence[tuple[Case, list[dict]]]  # each case with its rows of work_precision
HOW_TO_READ = (
    "How to read a diagram: every point is a setting; left is more precise, down is faster. Along a curve, from right "
    "to left, the step or the tolerance becomes smaller. Grey: the front of settings that no other beats in both. A "
    "ring marks the paper's default: Euler, n_integration 10, step doubling.",
    "The higher a method's order, the flatter its curve: a tenth of the error costs Euler (order 1) ten times the "
    "steps, Verlet (2) three times, Bogacki–Shampine and Rosenbrock (3) twice, RK4 (4) 1.8 times, Dormand–Prince (5) "
    "1.6 times, Nyström (6) 1.5 times.",
    "A curve turns straight up where smaller steps no longer help. That is near the dashed line 'float32's floor', "
    "what rounding a ray's beginning to float32 does to its end, computed in float64; or, with constant steps, where "
    "the bounding sphere cuts off what little a ray still turns outside.",
    "A ray is cut within its last step, where the law's region ends, on a cubic whose direction is right to third "
    "order: where light still bends there (Lorenz, Rössler), errors of constant steps fall with that order at most.",
)
AUTOMATIC = (
    "Nyström's method is for laws whose force depends on the position alone. The panel's Automatic takes it there, and "
    "Dormand–Prince 5(4) elsewhere (Kerr, wormholes, flows, typed forces of the velocity)."
)


def in_short(page: Page, measured: Measured) -> None:
    """What to choose in general."""
    page.section("In short")
    page.text(*_most_often(measured), AUTOMATIC, advice=True)
    page.table([_chosen(case, rows, goal) for case, rows in measured for goal in GOALS], CHOICE_COLUMNS)


def choice(goal: float, row: Mapping | None) -> str:
    """What to choose for a user's scene. row : as users_scene.recommended() gives it, of this goal"""
    if row is None:
        return f"No setting tried keeps safely below {goal:g} pixel in this scene."
    what, unit = _step_or_tolerance(row)
    return f"For errors below {goal:g} pixel choose {_method(row).label}, with {what} of {row['value']:g} {unit}."


def write(page: Page, effort: Effort, measured: Measured, *, objects: bool = False) -> list[Diagram]:
    """Returns the diagrams, one a case. objects : there are some, which these figures leave out"""
    page.section("Work and precision")
    page.text(*_what_is_measured(effort, measured[0][0].pixel))
    page.text(*HOW_TO_READ)
    drawn = []
    for case, rows in measured:
        diagram = precision_diagram.diagram(case.title, rows)
        page.heading(case.title)
        cheapest = [sentence(rows, goal) for goal in GOALS]
        page.text(*["Of the sky alone, without the scene's objects:"] * objects, *cheapest, advice=not objects)
        page.text(*_notes(rows))
        page.raw(diagram.as_svg())
        readable = [row | {"integrator": LABELS[row["integrator"]]} for row in rows]
        page.table(readable, WORK_COLUMNS, folded=f"All {len(rows)} settings")
        drawn.append(diagram)
    return drawn


def _most_often(measured: Measured) -> list[str]:
    """What is recommended most often, with the finest of its steps or tolerances."""
    said = []
    for goal in GOALS:
        found = [recommendation(rows, goal) for case, rows in measured if case.model.curved]
        found = [row for row in found if row]
        if not found:
            said.append(f"No setting tried keeps safely below {goal:g} pixel.")
            continue
        (method, times), *_ = Counter(_method(row) for row in found).most_common(1)
        finest = min((row for row in found if _method(row) == method), key=lambda row: row["value"])
        what, unit = _step_or_tolerance(finest)
        said.append(
            f"For errors below {goal:g} pixel choose {method.label}, with {what} of {finest['value']:g} {unit}: the "
            f"cheapest in {times} of {len(found)} pictures."
        )
    return said


def _chosen(case: Case, rows: list[dict], goal: float) -> dict:
    row = recommendation(rows, goal)
    named = {"case": case.title, "goal": goal}
    if row is None:
        return named | {"method": "none of the settings tried"}
    default = next((each["ns_per_ray"] for each in rows if each["papers_default"]), None)
    return named | {
        "method": _method(row).label,
        "value": row["value"],
        "error_p99_px_outside_band": row["error_p99_px_outside_band"],
        "ns_per_ray": row["ns_per_ray"],
        "faster": default / row["ns_per_ray"] if default else None,
    }


def _what_is_measured(effort: Effort, pixel: float) -> tuple[str, ...]:
    return (
        f"The error: {effort.side**2} rays of each picture, one at random in each of as many equal parts, are held "
        "against DOP853 in float64 (tolerance 1e-12, and again with 1e-10: a ray on which the two differ by more than "
        "1e-7 rad counts as unresolved and is left out). It is the angle between the directions in which the two "
        f"leave, in pixels (of {1e3 * pixel:.3g} mrad in the first picture). The time is that of tracing "
        f"{effort.picture}² pixels: the least of several runs after a warm-up, between which all others have theirs.",
        "Diagrams and recommendations leave out the near-critical band: rays whose impact parameter is within "
        f"{BAND:g} of that at which Schwarzschild's hole swallows light. They wind around it and magnify every error.",
        f"Safely below a goal is a 99th percentile below {MARGIN:g} of it, for on other rays of the same picture it "
        "may be nearly four times as large. Of settings whose times differ by less than "
        f"{100.0 * (TIE - 1.0):.0f} %, the most precise is recommended. NaN in a table: there is nothing to measure, "
        "or the setting failed, at half of the rays or more or by taking too many steps.",
    )


def _notes(rows: Sequence[Mapping]) -> list[str]:
    first = rows[0]
    notes = [f"The reference has converged for {first['rays'] - first['unresolved']} of {first['rays']} rays."]
    if first["rounding_px"] > 0.0:
        notes.append(f"float32's floor: {first['rounding_px']:.2g} pixel.")
    if first["bounding_sphere_px"] > 0.1 * first["rounding_px"]:
        notes.append(
            "With constant steps a ray ends at the bounding sphere, where it has still to turn by "
            f"{first['bounding_sphere_px']:.2g} pixel (99th percentile)."
        )
    orders = [f"{LABELS[name]} {order:.1f}" for name, order in precision_diagram.orders(rows).items()]
    if orders:
        notes.append(
            f"Order measured where a constant step is halved, between coarse steps and the floor: {', '.join(orders)}."
        )
    return notes


def _step_or_tolerance(row: Mapping) -> tuple[str, str]:
    return ("a step", "model lengths") if row["step_control"] == "constant" else ("a tolerance", "radians")


def _method(row: Mapping) -> Method:
    return Method(row["pipeline"], row["integrator"], row["step_control"])
