"""Diagrams of the cases in which a value is swept."""

from __future__ import annotations

from collections.abc import Sequence

from ..plots import Curve, Diagram


def diagrams(records: Sequence[dict]) -> list[Diagram]:
    return [_near_critical(records), _long_run(records), _front_error(records), _front_step(records)]


def _near_critical(records: Sequence[dict]) -> Diagram:
    outside = [row for row in _of(records, "near-critical rays") if row["value"] > 0 and row["bound"] is not None]
    return Diagram(
        "Near-critical rays",
        "b / b_c - 1",
        "radians",
        [
            Curve("largest error", [(row["value"], row["figure"]) for row in outside]),
            Curve(
                "100 roundings x condition number", [(row["value"], row["bound"]) for row in outside], color=1, dash=1
            ),
        ],
    )


def _long_run(records: Sequence[dict]) -> Diagram:
    rows = _of(records, "long run")
    curves = [
        Curve(
            integrator.replace("_", " "),
            [(row["value"], row["figure"]) for row in rows if row["integrator"] == integrator],
            color=index,
        )
        for index, integrator in enumerate(dict.fromkeys(row["integrator"] for row in rows))
    ]
    return Diagram("A closed orbit", "steps", "drift of energy and angular momentum, relative", curves)


def _front_error(records: Sequence[dict]) -> Diagram:
    return Diagram(
        "A ball behind a thin front: the error",
        "thickness / R",
        "radians",
        [
            Curve("off Snell's law", _swept(records, "figure")),
            Curve("thickness, and float32's floor", _swept(records, "bound"), color=1, dash=1),
        ],
    )


def _front_step(records: Sequence[dict]) -> Diagram:
    return Diagram(
        "A ball behind a thin front: the step",
        "thickness / R",
        "lengths",
        [Curve("mean step", _swept(records, "mean_step"))],
    )


def _of(records: Sequence[dict], case: str) -> list[dict]:
    return [row for row in records if row["case"] == case]


def _swept(records: Sequence[dict], key: str) -> list[tuple[float, float]]:
    rows = [row for row in _of(records, "thin front") if isinstance(row["value"], float)]
    return [(row["value"], row[key]) for row in rows]
