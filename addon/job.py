"""Work in the background: a thread for each job, which Blender's main thread asks how far it is."""

from __future__ import annotations

import threading
import time
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from .core import trace
from .core.frame import Statistics
from .core.scene import Scene
from .core.settings import Settings

if TYPE_CHECKING:
    from .recommended import Recommendation

Progress = Callable[[float, str], None]
Work = Callable[[Progress, Callable[[], bool]], object]

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
    """Starts at once. When `done`, either `result`, `error` or `was_cancelled` is set."""

    def __init__(self, work: Work):
        """work(progress, cancelled) gives the result, or raises trace.Cancelled where cancelled() says so."""
        self.fraction = 0.0
        self.result: object = None
        self.error: Exception | None = None
        self.was_cancelled = False
        self._clock = Clock()
        self._cancel = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(work,), name="Nonlinear Rays", daemon=True)
        _running.add(self)
        self._thread.start()

    def _run(self, work: Work) -> None:
        try:
            self.result = work(self._progress, self._cancel.is_set)
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


def render_job(scene: Scene, settings: Settings) -> Job:
    """A picture; its result is the Frame."""
    return Job(lambda progress, cancelled: trace.render(scene, settings, progress=progress, cancelled=cancelled))


class LastRender(NamedTuple):
    """What the panel says of the last picture, kept without its pixels."""

    statistics: Statistics
    warnings: tuple[str, ...]


class Button:
    """What the panel's buttons run, one thing at a time, and what was made last."""

    job: Job | None = None
    last: LastRender | None = None
    recommended: tuple[Recommendation, ...] = ()


def stop_all() -> None:
    """Cancel every job and wait for it."""
    jobs = list(_running)
    for job in jobs:
        job.cancel()
    for job in jobs:
        job.wait(STOP_SECONDS)
    Button.job = Button.last = None
    Button.recommended = ()
