"""The settings that are compared. Nothing is left to a default: they may change, and the benchmark may not."""

from __future__ import annotations

from addon.core.settings import Settings

from .scenes import BOUNDS

WAY = 60.0  # model lengths of τ that constant steps cover together: from the camera out of the bounding sphere
ADAPTIVE_SEGMENTS = 4  # times as many may be taken where steps adapt, so that rays come to their end
MOST_STEPS = 100_000
COMMON = {
    "observer": "chart",
    "samples": 1,
    "edge_samples": 1,
    "filter_width": 1.5,  # of no matter for a single sample
    "filter_textures": True,
    "ray_bits": 32,
    "failed_rays": "environment",
}


def paper(steps: int, segments: int) -> Settings:
    """The paper's pipeline of Section 3, without any acceleration: constant steps, all rays to the end, one object a
    quad.
    """
    return Settings(
        pipeline="paper",
        integrator="euler",
        step_control="constant",
        step=WAY / steps,
        tolerance=1e-3,
        max_steps=steps,
        segments=segments,
        steps_per_segment=steps // segments,
        early_termination="off",
        escape_radius=BOUNDS,
        passes=("Combined",),
        **COMMON,
        batch_size=1,
        cull_batches=False,
    )


def accelerated(steps: int, segments: int, tolerance: float) -> Settings:
    """The same with Section 4: early ray termination and step doubling."""
    return Settings(
        pipeline="paper",
        integrator="euler",
        step_control="doubling",
        step=WAY / steps,
        tolerance=tolerance,
        max_steps=MOST_STEPS,
        segments=ADAPTIVE_SEGMENTS * segments,
        steps_per_segment=steps // segments,
        early_termination="both",
        escape_radius=BOUNDS,
        passes=("Combined",),
        **COMMON,
        batch_size=1,
        cull_batches=False,
    )


def fused(
    tolerance: float,
    chord_tolerance: float,
    escape_radius: float | None = BOUNDS,
    passes: tuple[str, ...] = ("Combined",),
    integrator: str = "automatic",
) -> Settings:
    """One program, steps by the integrator's own error estimate. escape_radius : None lets the model choose."""
    return Settings(
        pipeline="fused",
        integrator=integrator,
        step_control="embedded",
        step=None,
        tolerance=tolerance,
        chord_tolerance=chord_tolerance,
        max_steps=MOST_STEPS,
        segments=MOST_STEPS,
        steps_per_segment=1,
        escape_radius=escape_radius,
        passes=passes,
        **COMMON,
    )
