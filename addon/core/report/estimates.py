"""How well the integrator's own estimate, the pass Error, tracks the true error, law by law."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..settings import TOLERANCES
from .errors import ROUNDING
from .rounding import TYPICAL

OWN = ("nystrom_64", "dormand_prince_54")  # the first that a law allows is the product's own method
WHY = (
    "The Error pass adds up what each step may be wrong by. It is no bound: what a step did wrong is magnified where "
    "the ray is bent after it (the column says by how much the law magnifies, at worst); float32's rounding is not in "
    "it, which counts where tolerances are small; and where the law's slope jumps, as at the rim of a lens, the two "
    "results that the estimate compares are wrong alike. Its factor tells what to multiply it by to be above the truth "
    f"for 99 of 100 rays. Errors below {ROUNDING:.1g} rad, float32's rounding of a direction, are not counted."
)


def of_every_case(rows: Sequence[Mapping], pixels: Mapping[str, float]) -> list[dict]:
    """A record for every case: the product's own method at the tried tolerance that is next to its own.

    rows : of work_precision;  pixels : radians by case
    """
    found = []
    for case in dict.fromkeys(row["case"] for row in rows):
        own = [
            row
            for row in rows
            if row["case"] == case
            and (row["pipeline"], row["step_control"]) == ("fused", "embedded")
            and row["integrator"] in OWN
        ]
        if not own:
            continue
        row = min(own, key=lambda row: (OWN.index(row["integrator"]), _away(row["value"])))
        found.append(
            {
                "model": row["model"],
                "case": case,
                "integrator": row["integrator"],
                "tolerance": row["value"],
                "estimate_exceeded_percent": row["estimate_exceeded_percent"],
                "estimate_factor_p99": row["estimate_factor_p99"],
                "magnification_p99": row["rounding_px"] * pixels[case] / TYPICAL,
            }
        )
    return found


def _away(tolerance: float) -> float:
    return abs(math.log(tolerance / TOLERANCES["fused"]))
