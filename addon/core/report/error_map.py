"""Where in the picture the error is, and how well the integrator's own estimate tracks it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..settings import Settings
from ..status import Status
from ..trace import trace_rays
from . import errors
from .cases import Case, camera_rays

LOW, HIGH = -4.0, 1.0  # log10 of pixels: the ends of the colours
RAMP = np.array(  # from dark to light, so that it reads in grey, too
    [[13, 8, 60], [84, 15, 109], [158, 42, 99], [212, 72, 66], [245, 125, 21], [250, 193, 39], [252, 255, 200]], float
)
WHOLE = (0.0, 1.0, 0.0, 1.0)
CLOSE_UP = 0.01  # of the picture: its part around the shadow's edge that is shown beside it
ABSORBED, UNKNOWN, ELSEWHERE = (0, 0, 0), (128, 128, 128), (0, 220, 220)


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """true, estimated : uint8, (rows, columns, 3), row 0 at the bottom;  figures : for the table"""

    true: np.ndarray
    estimated: np.ndarray
    figures: dict[str, float]


def measure(
    case: Case,
    settings: Settings,
    columns: int,
    rows: int,
    progress: Callable[[float], None],
    part: tuple[float, float, float, float] = WHOLE,
) -> ErrorMap:
    """Every pixel's ray against the reference. settings : with a step control that estimates its error;  part : as
    Case.pixel_rays() has it
    """
    positions, directions = case.pixel_rays(columns, rows, part)
    truth = case.truth(positions, directions, progress=progress)
    ends = trace_rays(case.model, positions, directions, case.seen(settings), scene=case.scene)
    found = errors.compare(case.model, ends, truth)
    measured = np.isfinite(found.angle)
    band = errors.near_critical(case.model, positions, case.in_chart(positions, directions))
    swallowed = (truth.status == Status.ABSORBED) & ~found.elsewhere
    true = _colors(found.angle / case.pixel)
    estimated = _colors(ends.error / case.pixel)
    for picture in (true, estimated):
        picture[swallowed] = ABSORBED
    true[~found.known] = UNKNOWN
    true[found.known & found.elsewhere] = ELSEWHERE
    figures = {
        "model": case.name,
        "case": case.title,
        "part_of_the_picture": part[1] - part[0],
        "rays": len(positions),
        "near_critical": int(band.sum()),
        "unresolved": int((~found.known).sum()),
        "truth_exceeds_estimate_percent": _percent(found.exceeds, measured),
        "truth_exceeds_estimate_percent_in_band": _percent(found.exceeds, measured & band),
        "truth_exceeds_tolerance_percent": _percent(found.angle > settings.tolerance, measured),
        "estimate_over_truth_median": _ratio(ends.error, found.angle, measured),
    }
    figures |= errors.summary(found, case.pixel, np.ones(len(positions), bool))
    shape = (rows, columns, 3)
    return ErrorMap(true.reshape(shape), estimated.reshape(shape), figures)


def shadows_edge(case: Case) -> tuple[float, float, float, float] | None:
    """A small part of the picture around an edge of the shadow, where the near-critical rays are: found along the line
    through the middle. None where that line has no absorbed ray.
    """
    middle = 0.5

    def absorbed(x: np.ndarray) -> np.ndarray:
        rays = camera_rays(case.scene, x, np.full_like(x, middle))
        return case.truth(*rays).status == Status.ABSORBED

    x = np.linspace(0.0, 1.0, 33)
    found = absorbed(x)
    edges = np.flatnonzero(found[1:] != found[:-1])
    if not len(edges):
        return None
    low, high = x[edges[0]], x[edges[0] + 1]
    for _ in range(3):  # each finds the edge to a sixteenth
        inner = np.linspace(low, high, 17)
        edge = np.flatnonzero(np.diff(absorbed(inner).astype(int)))[0]
        low, high = inner[edge], inner[edge + 1]
    at, half = 0.5 * (low + high), 0.5 * CLOSE_UP
    return at - half, at + half, middle - half, middle + half


def legend(columns: int, rows: int) -> np.ndarray:
    """The colours from 10^LOW to 10^HIGH pixels, from left to right."""
    return np.broadcast_to(_colors(np.logspace(LOW, HIGH, columns))[None], (rows, columns, 3)).astype(np.uint8)


def ticks() -> dict[str, float]:
    """Label -> its place in the legend, from 0 to 1."""
    powers = range(int(LOW), int(HIGH) + 1)
    return {f"{10.0**power:g}" + " pixels" * (power == HIGH): (power - LOW) / (HIGH - LOW) for power in powers}


def _colors(pixels: np.ndarray) -> np.ndarray:
    """(n,) -> uint8, (n, 3); what is not a number is unknown."""
    with np.errstate(divide="ignore", invalid="ignore"):
        place = (np.log10(pixels.astype(np.float64)) - LOW) / (HIGH - LOW) * (len(RAMP) - 1)
    known = ~np.isnan(place)
    place = np.clip(np.where(known, place, 0.0), 0.0, len(RAMP) - 1)
    colors = np.stack([np.interp(place, np.arange(len(RAMP)), RAMP[:, channel]) for channel in range(3)], axis=1)
    colors[~known] = UNKNOWN
    return (colors + 0.5).astype(np.uint8)


def _percent(flags: np.ndarray, chosen: np.ndarray) -> float:
    return 100.0 * float(flags[chosen].mean()) if chosen.any() else float("nan")


def _ratio(estimate: np.ndarray, angle: np.ndarray, chosen: np.ndarray) -> float:
    chosen = chosen & (angle > 0.0)
    return float(np.median(estimate[chosen] / angle[chosen])) if chosen.any() else float("nan")
