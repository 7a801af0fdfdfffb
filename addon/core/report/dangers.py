"""Which extreme cases a user's scene is near, and what to do about them, a sentence each."""

from __future__ import annotations

import numpy as np

from ..models import Model
from ..models.refraction import MEDIA
from ..settings import Settings
from ..status import Status, advice
from ..trace import trace_rays
from . import errors
from .cases import Case

SIDE = 64  # side² rays of the picture are looked at
CLOSE = 3.0  # horizon's radii: nearer cameras see the sky squeezed, and every error with it
FAST_SPIN = 0.999  # a / M: from here on light winds around the outline's flat side for thousands of steps
THIN_FRONT = 1e-3  # radii: float32 holds a thinner front in fewer than some thousand steps of x


def sentences(case: Case, settings: Settings) -> list[str]:
    """settings : that the user renders with."""
    model = case.model
    positions, directions = case.pixel_rays(SIDE, SIDE)
    distance = float(np.linalg.norm(positions[0]))
    found = []
    mass = getattr(model, "mass", 0.0) if model.has_static_frame else 0.0
    if mass > 0.0 and distance < CLOSE * 2.0 * mass:
        found.append(
            f"The camera is at {distance / mass:.3g} M from the centre, near the horizon, where small errors of a ray "
            "are large angles. Tighten the tolerance, or move the camera out."
        )
    found += _of_the_model(model)
    if settings.ray_bits == 16:
        found.append(
            "Rays are kept in 16 bit, which rounds their directions by up to 5e-4 at every segment. Set Ray Precision "
            "to 32 Bit."
        )
    near = errors.near_critical(model, positions, case.in_chart(positions, directions))
    if near.any():
        found.append(
            f"{100.0 * near.mean():.2g} % of the rays are within {errors.BAND:g} of the critical impact parameter, "
            "where errors grow without bound. Render them with more samples a pixel; no tolerance helps."
        )
    ends = trace_rays(model, positions, directions, case.seen(settings), scene=case.scene)
    counts = {status: int((ends.status == status).sum()) for status in Status}
    found += advice(counts, settings.step_limit)
    drift = ends.invariant_drift[np.isin(ends.status, (Status.ESCAPED, Status.HIT))]
    if len(drift) and drift.max() > 1e-3:
        found.append(
            f"What the model conserves drifts by up to {drift.max():.2g} of itself. Tighten the tolerance or lower the "
            "step."
        )
    return found or ["None of the extreme cases that the report knows is near."]


def _of_the_model(model: Model) -> list[str]:
    """What its parameters bring near."""
    found = []
    if model.name == "kerr" and abs(model.spin) > FAST_SPIN:
        found.append(
            f"The hole turns at {abs(model.spin):.4g} of the fastest: light along the flat side of its outline winds "
            "around it for thousands of steps. Raise Max Steps where rays reach the limit, or lower Spin a little."
        )
    fronted = model.name == "refraction" and "thickness" in MEDIA[model.medium].parameters
    if fronted and model.stepping == "continuous" and model.thickness < THIN_FRONT:
        found.append(
            f"The front is {model.thickness:.2g} radii thick, which float32 resolves badly. Set Stepping to Snell, or "
            "raise Thickness."
        )
    return found
