"""How well the integrator's own estimate, the pass Error, tracks the true error, law by law."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..settings import TOLERANCES
from .errors import ROUNDING
from .rounding import TYPICAL

OWN = ("nystrom_64", "dormand_prince_54")  # the first that a law allows is the product's own method
TRIED = (TOLERANCES["fused"], 1e-5)  # radians
WHY = (
    "The Error pass adds up what each step may be wrong by, with float32's rounding, and lets it grow by e for each "
    "radian that the ray is turned after it, as errors do on a photon orbit (the last column says by how much the law "
    "magnifies, at worst). It is meant to be exceeded by at most 5 % of the rays; where a law is smooth it is far "
    "above the truth, since the two results that it compares are both more precise than it says. Errors below "
    f"{ROUNDING:.1g} rad, float32's rounding of a direction, are not counted."
)


def of_every_case(rows: Sequence[Mapping], pixels: Mapping[str, float]) -> list[dict]:
    """A record for every case and tolerance of TRIED: the product's own method at the measured one that is next to it.

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
        best = min(OWN.index(row["integrator"]) for row in own)
        own = [row for row in own if row["integrator"] == OWN[best]]
        nearest = {id(row): row for row in (min(own, key=lambda row, t=t: _apart(row["value"], t)) for t in TRIED)}
        found += [
            {
                "model": row["model"],
                "case": case,
                "integrator": row["integrator"],
                "tolerance": row["value"],
                "estimate_exceeded_percent": row["estimate_exceeded_percent"],
                "estimate_over_median": row["estimate_over_median"],
                "estimate_factor_p99": row["estimate_factor_p99"],
                "magnification_p99": row["rounding_px"] * pixels[case] / TYPICAL,
            }
            for row in nearest.values()
        ]
    return found


def _apart(tolerance: float, other: float) -> float:
    return abs(math.log(tolerance / other))
