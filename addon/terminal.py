"""The command line's progress bar, and its Ctrl-C."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator

from .job import Clock

INTERRUPTED = 130  # the exit status that a shell reports for Ctrl-C
BAR_WIDTH = 30


class Progress:
    """A line that is drawn again on a terminal; elsewhere a line each tenth of a frame."""

    def __init__(self, stream=None):
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._clock = Clock()
        self._last = -1

    def show(self, fraction: float, label: str) -> None:
        tenths = int(fraction * (1000 if self._terminal else 10))
        if tenths == self._last:
            return
        self._last = tenths
        if self._terminal:
            done = int(BAR_WIDTH * fraction)
            bar = "█" * done + "·" * (BAR_WIDTH - done)
            self._stream.write(f"\r{label} {bar} {self._clock.text(fraction)}\x1b[K")
        else:
            self._stream.write(f"{label}: {self._clock.text(fraction)}\n")
        self._stream.flush()

    def clear(self) -> None:
        if self._terminal:
            self._stream.write("\r\x1b[K")
            self._stream.flush()


class Interrupt:
    """Ctrl-C sets a flag that the renderer asks for; a second one ends the process at once."""

    def __init__(self):
        self.requested = False

    def __call__(self) -> bool:
        return self.requested

    def _handle(self, _number, _frame) -> None:
        if self.requested:
            os._exit(INTERRUPTED)
        self.requested = True

    @contextlib.contextmanager
    def listening(self) -> Iterator[Interrupt]:
        before = signal.signal(signal.SIGINT, self._handle)
        try:
            yield self
        finally:
            signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)
