"""How a ray ends, with a sentence and an advice each. The numbers are those of shaders/common/status.glsl."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum


class Status(IntEnum):
    RUNNING = 0  # only while a ray is traced
    HIT = 1
    ESCAPED = 2
    ABSORBED = 3
    LEFT_DOMAIN = 4
    STEP_LIMIT = 5
    STEP_TOO_SMALL = 6
    NOT_FINITE = 7
    LOST = 8


FAILURES = (Status.STEP_LIMIT, Status.STEP_TOO_SMALL, Status.NOT_FINITE, Status.LOST)

MEANINGS = {
    Status.RUNNING: "were not finished",
    Status.HIT: "hit an object",
    Status.ESCAPED: "escaped to the sky",
    Status.ABSORBED: "were absorbed",
    Status.LEFT_DOMAIN: "left the model's domain",
    Status.STEP_LIMIT: "reached the step limit",
    Status.STEP_TOO_SMALL: "needed a step below the smallest",
    Status.NOT_FINITE: "became infinite or not a number",
    Status.LOST: "were lost in the tree of objects",
}

ADVICE = {
    Status.STEP_LIMIT: "Raise Segments and Max Steps, or loosen the tolerance; with constant steps, raise Step Size.",
    Status.STEP_TOO_SMALL: "Loosen the tolerance, or keep the camera and the rays away from the singular point.",
    Status.NOT_FINITE: "Lower Step Size; check the model's parameters and the meshes near the centre.",
    Status.LOST: "The graphics driver is at fault: update it, or set Pipeline to Paper, which needs no tree.",
}


def patience(rays: int, steps: int) -> str:
    """A sentence for rays that were let beyond the step limit."""
    return f"{rays} rays were given up to {steps} steps, since only few take so many: they wind around before they end."


def advice(counts: Mapping[Status, int], limit: int | None = None) -> list[str]:
    """A sentence for each kind of failure. counts: rays by status; limit: steps a ray was allowed."""
    total = sum(counts.values())
    sentences = []
    for status in FAILURES:
        if count := counts.get(status, 0):
            bound = f" ({limit})" if limit and status is Status.STEP_LIMIT else ""
            sentences.append(f"{count} of {total} rays {MEANINGS[status]}{bound}. {ADVICE[status]}")
    return sentences
