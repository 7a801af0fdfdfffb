"""What the page says about error and time: what to choose, then every case by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from . import precision_diagram
from .cases import Case
from .columns import CHOICE_COLUMNS, WORK_COLUMNS
from .methods import LABELS, Method
from .page import Page
from .plots import Diagram
from .recommend import GOALS, TIE, recommendation, sentence
from .work_precision import Effort

Measured = Sequence[tuple[Case, list[dict]]]  # each case with its rows of work_precision
HOW_TO_READ = (
    "How to read a diagram: every point is a setting; left is more precise, down is faster. Along a curve, from right "
    "to left, the step or the tolerance becomes smaller. Grey: the front of settings that no other beats in both. A "
    "ring marks the paper's default: Euler, n_integration 10, step doubling.",
    "The higher a method's order, the flatter its curve: a tenth of the error costs Euler (order 1) ten times the "
    "steps, Verlet (2) three times, Bogacki–Shampine (3) twice, RK4 (4) 1.8 times, Dormand–Prince (5) 1.6 times.",
    "A curve turns straight up where smaller steps no longer help. That is near the dashed line 'float32's floor', "
    "what rounding a ray's beginning to float32 does to its end, computed in float64; or, with constant steps, where "
    "the bounding sphere cuts off what little a ray still turns outside.",
    "A ray is cut within its last step, where the law's region ends, on a cubic whose direction is right to third "
    "order: where light still bends there (Lorenz, Rössler), errors of constant steps fall with that order at most.",
)


def write(page: Page, effort: Effort, measured: Measured) -> list[Diagram]:
    """Returns the diagrams, one a case."""
    page.section("In short")
    page.text(*_choice(measured), advice=True)
    page.table([_chosen(case, rows, goal) for case, rows in measured for goal in GOALS], CHOICE_COLUMNS)
    page.section("Work and precision")
    page.text(_what_is_measured(effort, measured[0][0].pixel))
    page.text(*HOW_TO_READ)
    drawn = []
    for case, rows in measured:
        diagram = precision_diagram.diagram(case.title, rows)
        page.heading(case.title)
        page.text(*(sentence(rows, goal) for goal in GOALS), advice=True)
        page.text(*_notes(rows))
        page.raw(diagram.as_svg())
        readable = [row | {"integrator": LABELS[row["integrator"]]} for row in rows]
        page.table(readable, WORK_COLUMNS, folded=f"All {len(rows)} settings")
        drawn.append(diagram)
    return drawn


def _choice(measured: Measured) -> list[str]:
    """What to choose in general: what is recommended most often, and the tightest tolerance with which it is."""
    said = []
    for goal in GOALS:
        found = [recommendation(rows, goal) for case, rows in measured if case.model.curved]
        found = [row for row in found if row]
        if len(found) < 2:  # one scene: the table says it
            continue
        (method, times), *_ = Counter(_method(row) for row in found).most_common(1)
        finest = min(row["value"] for row in found if _method(row) == method)
        what = "a step" if method.step_control == "constant" else "a tolerance"
        unit = "model lengths" if method.step_control == "constant" else "radians"
        said.append(
            f"For errors below {goal:g} pixel choose {method.label}, with {what} of {finest:g} {unit}: the cheapest in "
            f"{times} of {len(found)} pictures."
        )
    return said or ["What to choose for this scene's sky (for its objects, too: 'Recommended, rendered', below):"]


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


def _what_is_measured(effort: Effort, pixel: float) -> str:
    return (
        f"The error: {effort.side**2} rays of each picture, one at random in each of as many equal parts, are held "
        "against DOP853 in float64 (tolerance 1e-12, and again with 1e-10: a ray on which the two differ by more than "
        "1e-7 rad counts as unresolved and is left out). It is the angle between the directions in which the two "
        f"leave, in pixels (of {1e3 * pixel:.3g} mrad in the first picture). The time is that of tracing "
        f"{effort.picture}² pixels: the least of several runs after a warm-up, between which all others have theirs; "
        f"of settings whose times differ by less than {100.0 * (TIE - 1.0):.0f} %, the most precise is recommended."
    )


def _notes(rows: Sequence[Mapping]) -> list[str]:
    first = rows[0]
    notes = [f"{first['unresolved']} of {first['rays']} rays have no converged reference."]
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


def _method(row: Mapping) -> Method:
    return Method(row["pipeline"], row["integrator"], row["step_control"])
