"""Operators whose work goes on in the background, with progress in the panel and Esc to stop it."""

from __future__ import annotations

from .job import Button, Job

TICK = 0.1  # seconds between two looks at the job
SHOWN_AREAS = {"VIEW_3D", "PROPERTIES"}


def redraw(context) -> None:
    """Draw the panels that show the progress."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in SHOWN_AREAS:
                area.tag_redraw()


class Background:
    """Beside Operator: start() begins the job, and finish() takes what it made."""

    when_cancelled = "Cancelled."
    _job = None
    _timer = None

    def start(self, context) -> Job:
        """What it raises is shown to the user."""
        raise NotImplementedError

    def finish(self, context, result) -> None:
        """On the main thread. What it raises is shown to the user."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context):
        if Button.job is not None:
            cls.poll_message_set("Nonlinear Rays is at work already. Wait for it, or cancel it.")
            return False
        return context.scene is not None

    def execute(self, context):
        """From scripts: returns when the work is done."""
        if not self._start(context):
            return {"CANCELLED"}
        self._job.wait()
        return self._finish(context)

    def invoke(self, context, _event):
        if not self._start(context):
            return {"CANCELLED"}
        Button.job = self._job
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if self._job.done:
            self._leave(context)
            return self._finish(context)
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            context.workspace.status_text_set(f"Nonlinear Rays: {self._job.text}. Esc cancels.")
            redraw(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """Blender is closing or opens another file."""
        self._job.cancel()
        self._leave(context)

    def _start(self, context) -> bool:
        try:
            self._job = self.start(context)
        except Exception as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _leave(self, context) -> None:
        Button.job = None
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        redraw(context)

    def _finish(self, context):
        job = self._job
        if job.was_cancelled:
            self.report({"INFO"}, self.when_cancelled)
            return {"CANCELLED"}
        try:
            if job.error is not None:
                raise job.error
            self.finish(context, job.result)
        except Exception as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}
