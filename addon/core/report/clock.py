"""The time that tracing takes, without compiling: the least of several runs, between which others have theirs."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import replace

from ..settings import Settings
from ..trace import render
from .cases import Case

WARM_UP = 4  # pixels a side


class Clock:
    """Times tracing a case's picture with one setting.

    picture : pixels a side;  times : of the runs so far, milliseconds, without compiling
    """

    def __init__(self, case: Case, settings: Settings, picture: int):
        self.case, self.settings, self.picture = case, replace(case.seen(settings), passes=("Direction",)), picture
        self.times: list[float] = []
        self.compile_ms = float("nan")

    def warm_up(self) -> None:
        """Drivers compile at the first draw, here that of a few pixels. What only long rays need may still be compiled
        after it, so that no run counts alone.
        """
        frame = render(self.case.small(WARM_UP, WARM_UP), self.settings)
        self.compile_ms = frame.statistics.milliseconds["compile"]

    def run(self) -> None:
        frame = render(self.case.small(self.picture, self.picture), self.settings)
        self.times.append(frame.statistics.milliseconds["trace"])

    def figures(self) -> dict[str, float]:
        """The least of the runs, and their median."""
        least, rays = min(self.times), self.picture**2
        return {
            "time_min_ms": least,
            "time_median_ms": statistics.median(self.times),
            "repeats": len(self.times),
            "compile_ms": self.compile_ms,
            "rays_per_second": 1e3 * rays / least,
            "ns_per_ray": 1e6 * least / rays,
        }


def run_in_turns(
    clocks: Sequence[Clock], repeats: int, patience: float, progress: Callable[[float], None] = lambda part: None
) -> None:
    """One run of each, then the next of each, two at least: where the machine is slow for a while, it is so for all.

    patience : seconds of a clock's runs after which it is not repeated any more
    """
    for clock in clocks:
        clock.warm_up()
    for turn in range(max(repeats, 2)):
        progress(turn / max(repeats, 2))
        for clock in clocks:
            if len(clock.times) < 2 or sum(clock.times) < 1e3 * patience:
                clock.run()
