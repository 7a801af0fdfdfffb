"""RayEnds.error is a promise: at most 5 % of a law's rays may be wrong by more, at the default tolerance and below it.

The truth is DOP853's in float64. The rays: parallel ones at all distances from the centre, or ones from all over a
sphere to all sides; and those next to what magnifies errors most, the photon orbits.
"""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.reference import angles, true_ends
from addon.core.settings import TOLERANCES, Settings
from addon.core.status import Status
from addon.core.trace import trace_rays

REFRACTION, POTENTIAL = MODELS["refraction"], MODELS["radial_potential"]
COUNT = 80
MOST_ABOVE = 0.05
ROUNDING = 2.0**-23  # radians: of a direction, at the camera and at the end
SANE = 1000.0  # an estimate so many times too large, in the median, would say nothing


def beam(start, nearest, farthest):
    """Along +X, at distances from nearest to farthest of the X axis."""
    generator = np.random.default_rng(1)
    b, turn = generator.uniform(nearest, farthest, COUNT), generator.uniform(0, 2 * np.pi, COUNT)
    x = np.stack([np.full(COUNT, -start), b * np.cos(turn), b * np.sin(turn)], axis=1)
    return x, np.tile([1.0, 0.0, 0.0], (COUNT, 1))


def from_all_sides(radius):
    generator = np.random.default_rng(2)
    x, d = generator.normal(size=(2, COUNT, 3))
    return radius * x / np.linalg.norm(x, axis=1, keepdims=True), d / np.linalg.norm(d, axis=1, keepdims=True)


def nearly_level():
    dip = np.linspace(-0.05, 0.03, COUNT)
    return np.tile([0.0, 0.0, 1.5], (COUNT, 1)), np.stack([np.cos(dip), 0 * dip, np.sin(dip)], axis=1)


def refraction(medium, **values):
    return REFRACTION(medium=medium, **values)


LAWS = {
    "Luneburg": (refraction("luneburg"), beam(5, 0, 0.98)),
    "shell, 0.1 R": (refraction("shell", strength=0.5), beam(5, 0, 0.95)),
    "shell, 0.001 R": (refraction("shell", strength=-0.3, thickness=1e-3), beam(5, 0, 0.6)),
    "explosion": (refraction("explosion"), beam(5, 0, 1.0)),
    "mirage": (refraction("mirage"), nearly_level()),
    "linear": (refraction("linear", index=1.2, gradient=0.1), from_all_sides(2)),
    "typed index": (refraction("expression", formula="1 + 0.5 / (1 + r^2)", grain=0.3), beam(10, 0, 3)),
    "isotropic": (refraction("isotropic"), beam(500, 5.3, 20)),
    "Schwarzschild": (MODELS["schwarzschild"](), from_all_sides(15)),
    "Schwarzschild, near critical": (MODELS["schwarzschild"](), beam(500, 5.197, 5.4)),
    "Kerr": (MODELS["kerr"](), from_all_sides(15)),
    "Kerr, near critical": (MODELS["kerr"](), beam(100, 5, 7.5)),
    "wormhole": (MODELS["wormhole"](), from_all_sides(5)),
    "wormhole, near critical": (MODELS["wormhole"](), beam(50, 1.0, 1.1)),
    "cubic": (POTENTIAL(), beam(20, 0, 6)),
    "Yukawa": (POTENTIAL(xi="yukawa"), beam(20, 0.3, 6)),
    "Yukawa, three centres": (POTENTIAL(xi="yukawa", centres=[[0, 0, 0], [1, 0.5, 0], [-1, 0, 0.5]]), beam(20, 0, 3)),
    "Coulomb": (POTENTIAL(xi="coulomb"), beam(20, 0.3, 6)),
    "typed force": (POTENTIAL(xi="expression"), beam(20, 0.3, 6)),
    "custom": (MODELS["custom"](), beam(10, 0, 5)),
    "Lorenz": (MODELS["lorenz"](strength=1e-4), from_all_sides(60)),
    "Rössler": (MODELS["roessler"](strength=1e-3), from_all_sides(30)),
}


@pytest.mark.parametrize("law", LAWS)
def test_the_estimate_is_above_the_truth(law):
    model, (x, d) = LAWS[law]
    x, d = (rays.astype(np.float32).astype(np.float64) for rays in (x, d))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    truth = true_ends(model, x, d)
    for tolerance in (TOLERANCES["fused"], 1e-5):
        ends = trace_rays(model, x, d, Settings(tolerance=tolerance))
        both = (ends.status == Status.ESCAPED) & (truth.status == Status.ESCAPED) & truth.converged
        error = angles(ends.direction[both].astype(np.float64), truth.direction[both])
        estimate = ends.error[both] + ROUNDING
        above, over = np.mean(error > estimate), np.median(estimate / np.maximum(error, ROUNDING))
        print(f"{law}, {tolerance:g}: {100 * above:.1f} % of {both.sum()} above it; {over:.0f} times the truth")
        assert both.sum() > COUNT / 3 and above <= MOST_ABOVE and over < SANE
