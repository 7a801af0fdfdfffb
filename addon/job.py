"""A picture being made in the background: one thread, which Blender's main thread asks how far it is."""

from __future__ import annotations

import threading
import time
import weakref
from typing import NamedTuple

from .core import trace
from .core.frame import Frame, Statistics
from .core.scene import Scene
from .core.settings import Settings

STOP_SECONDS = 10.0  # a draw in progress cannot be interrupted

_running: weakref.WeakSet[Job] = weakref.WeakSet()


def duration(seconds: float) -> str:
    """0:07, 12:34 or 1:02:03."""
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


class Clock:
    """Fraction done -> seconds left, from the time since the start."""

    def __init__(self):
        self.start = time.monotonic()

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self.start

    def left(self, fraction: float) -> float | None:
        """Seconds; None while too little is done to tell."""
        return self.elapsed * (1.0 - fraction) / fraction if fraction > 0.01 else None

    def text(self, fraction: float) -> str:
        """ "42 %, 0:12 left"."""
        left = self.left(fraction)
        return f"{100 * fraction:.0f} %" + (f", {duration(left)} left" if left is not None else "")


class Job:
    """Starts at once. When `done`, either `frame`, `error` or `was_cancelled` is set."""

    def __init__(self, scene: Scene, settings: Settings):
        self.fraction = 0.0
        self.frame: Frame | None = None
        self.error: Exception | None = None
        self.was_cancelled = False
        self.warnings = scene.warnings
        self._clock = Clock()
        self._cancel = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(scene, settings), name="Nonlinear Rays", daemon=True)
        _running.add(self)
        self._thread.start()

    def _run(self, scene: Scene, settings: Settings) -> None:
        try:
            self.frame = trace.render(scene, settings, progress=self._progress, cancelled=self._cancel.is_set)
        except trace.Cancelled:
            self.was_cancelled = True
        except Exception as error:  # shown by whoever waits for the job
            self.error = error

    def _progress(self, fraction: float, _sentence: str) -> None:
        self.fraction = fraction

    @property
    def done(self) -> bool:
        return not self._thread.is_alive()

    @property
    def text(self) -> str:
        return "Cancelling" if self._cancel.is_set() else self._clock.text(self.fraction)

    def cancel(self) -> None:
        self._cancel.set()

    def wait(self, seconds: float | None = None) -> bool:
        """True where it ended in time."""
        self._thread.join(seconds)
        return self.done


class Report(NamedTuple):
    """What the panel says of the last picture, kept without its pixels."""

    statistics: Statistics
    warnings: tuple[str, ...]


class Button:
    """What the Render button runs, and what it made last."""

    job: Job | None = None
    last: Report | None = None


def stop_all() -> None:
    """Cancel every job and wait for it."""
    jobs = list(_running)
    for job in jobs:
        job.cancel()
    for job in jobs:
        job.wait(STOP_SECONDS)
    Button.job = Button.last = None
