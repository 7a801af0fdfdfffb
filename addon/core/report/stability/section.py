"""What the page says about the extreme cases: how many expectations hold, then each case by itself."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...models import MODELS
from ..methods import LABELS
from ..page import Page
from ..plots import Diagram
from .diagrams import diagrams

VERDICTS = {True: "yes", False: "NO", None: "reported"}
COLUMNS = {
    "model": "model",
    "value": "value",
    "integrator": "integrator",
    "expectation": "expectation",
    "measure": "measured",
    "figure": "figure",
    "bound": "bound",
    "holds": "holds",
    "statuses": "rays",
    "off": "rays that are off",
    "pixels_changed": "pixels that show another object",
    "pixels_on_outlines": "pixels on outlines",
    "steps_max": "most steps of a ray",
    "step": "constant step, τ",
    "mean_step": "mean step, τ",
}
NEVER_SHARED = ("value", "figure", "bound", "holds")  # a column each, even where all rows agree
MEANING = {
    "near-critical rays": (
        "The critical impact parameter b_c = 3√3 M parts the rays that a hole swallows from those that escape. A ray "
        "near it winds around the hole, and its end depends on b as 1 / |b/b_c − 1|: float32 cannot know on which side "
        "of critical a ray is that is within 100 roundings of it. value: b/b_c − 1. To do about it: more samples a "
        "pixel; no tolerance helps."
    ),
    "near camera": (
        "A camera at rest just above the horizon sees the sky shrink to a small disc. value: its distance, M, where "
        "the horizon is at 2 and light circles at 3."
    ),
    "far camera": "A camera a million M away, with a lens to match: does float32 still hit the hole? Pixels of 256.",
    "near-extremal Kerr": (
        "Holes that turn nearly as fast as a hole can: the outline gets a flat side. Pixels of 1024 across 16 M."
    ),
    "head-on singularity": "Rays into the singular point of a potential, and by it at a distance b, model lengths.",
    "thin front": (
        "An index that jumps from 1 to 1.5 within a fraction of R must bend light as Snell's law does. A thinner front "
        "is nearer to Snell's, until float32 no longer resolves a place within it. value: thickness / R. Nyström's "
        "method, which Automatic takes here, needs more steps in a thin front than Dormand–Prince's, and gives up at "
        "thicker ones (step too small). To do about it: Stepping: Snell, or a front of at least 0.001 R."
    ),
    "stiff Rössler and Lorenz": (
        "If a method's steps hardly become more numerous at a tighter tolerance, it is stability and not accuracy that "
        "keeps them short: the law is stiff for that method."
    ),
    "stiff damping": (
        "dv/dτ = −κ v: a ray comes to rest after the way 1/κ. 'Step too small' is how such a ray ends: nothing moves "
        "it any more."
    ),
    "scale": "The same scene, all lengths times a factor, beside the scene itself.",
    "offset": "The same scene, far from the world's origin.",
    "long run": (
        "A closed orbit, with constant steps. Verlet's method is symplectic: its energy swings and does not drift. The "
        "others lose or gain energy with every turn, those of higher order less. value: steps."
    ),
    "half floats": "The paper's finding: rays in textures of 16 bit are too coarse.",
    "degenerate geometry": "Meshes and spheres that nobody should give, each alone in a picture of 16 x 12 pixels.",
    "settings": "Settings that nobody should give: a clear message, or a right picture.",
}


def write(page: Page, records: Sequence[Mapping]) -> list[Diagram]:
    """records : of stability.run().  Returns the diagrams of swept values."""
    judged = [row for row in records if row["holds"] is not None]
    failed = [row for row in judged if not row["holds"]]
    page.section("Stability: stiff and extreme cases")
    page.text(
        f"{len(judged) - len(failed)} of {len(judged)} expectations hold.",
        *(f"Does not hold: {row['case']}, {row['model']}, {row['value']}: {row['expectation']}." for row in failed),
        advice=True,
    )
    by_case = {name: [row for row in records if row["case"] == name] for name in MEANING}
    page.table([_overview(name, rows) for name, rows in by_case.items() if rows], OVERVIEW_COLUMNS)
    drawn = []
    for name, rows in by_case.items():
        if not rows:
            continue
        page.heading(name[0].upper() + name[1:])
        page.text(MEANING[name])
        for diagram in diagrams(name, rows):
            page.raw(diagram.as_svg())
            drawn.append(diagram)
        _table(page, rows)
    return drawn


OVERVIEW_COLUMNS = {
    "case": "case",
    "rows": "rows",
    "hold": "hold",
    "fail": "do not hold",
    "reported": "reported only",
    "nearest": "the worst, % of its bound",
}


def _overview(name: str, rows: Sequence[Mapping]) -> dict:
    verdicts = [row["holds"] for row in rows]
    parts = [100.0 * row["figure"] / row["bound"] for row in rows if row["bound"]]
    return {
        "case": name,
        "rows": len(rows),
        "hold": verdicts.count(True),
        "fail": verdicts.count(False),
        "reported": verdicts.count(None),
        "nearest": max(parts, default=None),
    }


def _table(page: Page, rows: Sequence[Mapping]) -> None:
    """What is the same in all rows is said once, above them."""
    shared = {
        key: rows[0].get(key)
        for key in COLUMNS
        if key not in NEVER_SHARED and len({str(row.get(key)) for row in rows}) == 1
    }
    said = [f"{COLUMNS[key].capitalize()}: {shared[key]}." for key in ("expectation", "measure") if key in shared]
    if said:
        page.text(" ".join(said))
    columns = {
        key: title
        for key, title in COLUMNS.items()
        if any(_there(row.get(key)) for row in rows) and (key not in shared or key == "statuses")
    }
    page.table([dict(row) | _readable(row) for row in rows], columns)


def _readable(row: Mapping) -> dict:
    return {
        "model": MODELS[row["model"]].label if row["model"] in MODELS else row["model"],
        "holds": VERDICTS[row["holds"]],
        "integrator": LABELS.get(row.get("integrator", ""), None),
    }


def _there(value: object) -> bool:
    return value is not None and not (isinstance(value, float) and math.isnan(value))
