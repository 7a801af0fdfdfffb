"""How wrong rays are, against float64: SciPy's DOP853 on the model's own right-hand side."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from addon.core.models import Model
from addon.core.scene import Camera
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays

from .settings import fused

PERCENTILE = 99.0
TOLERANCES = np.geomspace(1.0, 1e-6, 37)  # radians, loosest first, six to a decade
ACCURATE = fused(tolerance=1e-5, chord_tolerance=1e-5, escape_radius=None)


class Rays:
    """A sample of a camera's rays, and the truth about them: their ways in float64.

    model : in the world's axes;  count : of rays through random places of the picture
    longest : τ that the truth is known to; a ray that went on is compared there
    relative : DOP853's tolerance. Its norm is a mean over all rays, a single one may be some √(6 count) times worse
    """

    def __init__(
        self, model: Model, camera: Camera, count: int, longest: float, relative: float = 1e-9, seed: int = 7
    ) -> None:
        self.model, self.longest = model, longest
        left, right, bottom, top = camera.window
        generator = np.random.default_rng(seed)
        x, y = generator.uniform(left, right, count), generator.uniform(bottom, top, count)
        directions = np.stack([x, y, -np.ones(count)], axis=1) @ camera.world_from_camera[:3, :3].T
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        origins = np.broadcast_to(camera.world_from_camera[:3, 3], directions.shape)
        # Rays that fall into something have no direction that anything is looked up with, and no truth in the end.
        self.absorbed = trace_rays(model, origins, directions, ACCURATE).status == Status.ABSORBED
        self.origins, self.directions = origins, directions
        self._way = self._integrate(relative)

    def _integrate(self, relative: float):
        """τ -> states (n, 6) of the rays that are not absorbed."""
        kept = ~self.absorbed
        # The shaders are given float32.
        origins = self.origins[kept].astype(np.float32).astype(np.float64)
        directions = self.directions[kept].astype(np.float32).astype(np.float64)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        first = self.model.initial_states(origins, directions)

        def rhs(_: float, flat: np.ndarray) -> np.ndarray:
            return self.model.rhs(flat.reshape(-1, 6)).ravel()

        solved = solve_ivp(
            rhs, (0.0, self.longest), first.ravel(), "DOP853", rtol=relative, atol=relative, dense_output=True
        )
        if not solved.success:
            raise RuntimeError(f"DOP853 finds no truth for '{self.model.name}': {solved.message}. Change the rays.")
        return solved.sol

    def error(self, settings: Settings) -> float:
        """99th percentile, radians, of the angle between a ray's last direction and the true one at the same τ, over
        the rays that nothing absorbs.
        """
        ends = trace_rays(self.model, self.origins, self.directions, settings)
        going = np.isin(ends.status, (Status.ESCAPED, Status.STEP_LIMIT))
        counted = np.flatnonzero(going[~self.absorbed])  # rows of the truth
        parameters = np.minimum(ends.parameter[~self.absorbed][counted].astype(np.float64), self.longest)
        states = np.empty((len(counted), 6))
        for start in range(0, len(counted), 64):  # the interpolant gives all rays for every τ
            part = slice(start, start + 64)
            found = self._way(parameters[part]).reshape(-1, 6, len(parameters[part]))
            states[part] = found[counted[part], :, np.arange(len(parameters[part]))]
        true = self.model.ray_directions(states)
        chord = np.linalg.norm(ends.direction[~self.absorbed][counted] - true, axis=1)
        return float(np.percentile(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)), PERCENTILE))

    def loosest(self, settings_at: Callable[[float], Settings], bound: float) -> tuple[Settings, float]:
        """The settings with the largest tolerance that keeps the error within the bound, radians, and that error.

        settings_at : tolerance -> Settings. Errors grow with the tolerance, so that halving the list finds it; where
        even the smallest tolerance is not enough, the error that comes with it is NaN.
        """
        low, high = 0, len(TOLERANCES)  # the first that keeps the bound is in [low, high]
        found, error = settings_at(float(TOLERANCES[-1])), math.nan
        while low < high:
            middle = (low + high) // 2
            settings = settings_at(float(TOLERANCES[middle]))
            measured = self.error(settings)
            if measured <= bound:
                high, found, error = middle, settings, measured
            else:
                low = middle + 1
        return found, error
