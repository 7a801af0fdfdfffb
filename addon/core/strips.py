"""Work on long arrays a strip at a time, which a processor's cache holds, and on all processors: numpy's loops let
threads run side by side.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")
STRIP = 1 << 13  # rows of some hundred bytes


def in_strips(work: Callable[[slice], Result], count: int, size: int = STRIP) -> list[Result]:
    """work(rows) for strips that cover rows 0 … count - 1, which it must treat apart; what it returned, in order."""
    strips = [slice(first, min(first + size, count)) for first in range(0, count, size)]
    return on_all_processors(work, strips)


def on_all_processors(work: Callable[[Part], Result], parts: Sequence[Part]) -> list[Result]:
    """work(part) for each part; what it returned, in order."""
    if len(parts) < 2:  # a thread takes longer than a small mesh
        return [work(part) for part in parts]
    with ThreadPoolExecutor(min(len(parts), os.cpu_count() or 1)) as pool:
        return list(pool.map(work, parts))
