"""Forces and indices at the edge: singular centres, thin fronts, stiff flows and stiff damping."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from ...models import MODELS
from ...reference import angles, true_ends
from ...status import FAILURES, Status
from ...trace import RayEnds, trace_rays
from .record import EPSILON, EXACT, counted, ended_well, record, worst

EXPLICIT, L_STABLE = "dormand_prince_54", "rosenbrock_32"
AUTOMATICS = "nystrom_64"  # what Automatic takes for media
METHODS = (EXPLICIT, L_STABLE)
STEPS_OF_ACCURACY = 100.0 ** (1 / 5)  # times as many that a method of fifth order needs for a tolerance of a hundredth
RESTS = 1e-4  # of a damped ray's way: where it counts as having come to rest at the right place


def head_on(quick: bool) -> list[dict]:
    """Rays straight at a singular centre and just beside it, attracted and repelled."""
    records = []
    for xi in ("coulomb", "yukawa"):
        for kind, strength in (("attractive", 1.0), ("repulsive", -1.0)):
            model = MODELS["radial_potential"](xi=xi, k=strength, zeta=-strength)
            b = np.array([0.0, 1e-6, 1e-3])
            positions = np.stack([np.full(3, -10.0), b, np.zeros(3)], axis=1)
            ends = trace_rays(model, positions, np.tile([1.0, 0.0, 0.0], (3, 1)), EXACT)
            for row in range(3):
                records.append(
                    record(
                        model.name,
                        f"{xi}, {kind}, b = {b[row]:g}",
                        "a named status; drift reported",
                        "drift of energy and angular momentum",
                        ends.invariant_drift[row],
                        holds=ended_well(ends),
                        statuses=counted(ends.status[row : row + 1]),
                    )
                )
    return records


def thin_fronts(quick: bool) -> list[dict]:
    """A ball of n = 1.5 behind a front that becomes thinner, against Snell's law at a sharp one; and an explosion,
    against DOP853. The bound allows four standard deviations of float32's rounding, rounding_walk(), for Dormand and
    Prince's method, which passes thinner fronts than Nystrom's; what that one does is reported.
    """
    b = np.linspace(0.02, 0.95, 20 if quick else 80)
    positions = np.stack([np.full(len(b), -5.0), b, np.zeros(len(b))], axis=1).astype(np.float32).astype(float)
    directions = np.tile([1.0, 0.0, 0.0], (len(b), 1))
    snell = 2.0 * (np.arcsin(positions[:, 1]) - np.arcsin(positions[:, 1] / 1.5))
    records = []
    for method, thickness in product((EXPLICIT, AUTOMATICS), (1e-1, 1e-2, 1e-3, 1e-4)):
        model = MODELS["refraction"](medium="shell", strength=0.5, thickness=thickness)
        ends = trace_rays(model, positions, directions, replace(EXACT, integrator=method))
        out = ends.status == Status.ESCAPED
        well = ended_well(ends) and not (ends.status == Status.STEP_LIMIT).any()
        turned = np.arctan2(-ends.direction[out, 1].astype(float), ends.direction[out, 0].astype(float))
        walk = rounding_walk(positions[:, 1], thickness, 0.5, ends.steps - ends.rejected).max()
        records.append(
            record(
                model.name,
                thickness,
                "Snell's law to the thickness / R and float32's floor; no ray at the step limit"
                if method == EXPLICIT
                else "a named status, no ray at the step limit; error reported",
                "largest error of rays that escape, rad",
                worst(np.abs(turned - snell[out])),
                thickness + 4.0 * walk if method == EXPLICIT else None,
                also=well,
                holds=well,
                statuses=counted(ends.status),
                integrator=method,
                mean_step=_mean_step(ends),
                steps_max=int(ends.steps.max()),
            )
        )
    few = slice(None, None, len(b) // 5)
    for thickness in (1e-1, 1e-2, 1e-3, 1e-4):
        model = MODELS["refraction"](medium="explosion", strength=0.5, thickness=thickness)
        ends = trace_rays(model, positions[few], directions[few], EXACT)
        error, measure = float("nan"), "not compared in float64, which takes minutes"
        if thickness >= 1e-2 and not quick:
            measure = "largest error of rays that escape, rad"
            truth = true_ends(model, positions[few], directions[few])
            out = (ends.status == Status.ESCAPED) & truth.converged & (truth.status == Status.ESCAPED)
            error = worst(angles(ends.direction[out].astype(float), truth.direction[out]))
        records.append(
            record(
                model.name,
                f"explosion, {thickness:g}",
                "a named status, no ray at the step limit; error reported",
                measure,
                error,
                holds=ended_well(ends) and not (ends.status == Status.STEP_LIMIT).any(),
                statuses=counted(ends.status),
                integrator=AUTOMATICS,
                mean_step=_mean_step(ends),
                steps_max=int(ends.steps.max()),
            )
        )
    return records


def rounding_walk(b: np.ndarray, thickness: float, strength: float, steps: np.ndarray) -> np.ndarray:
    """The standard deviation of a ray's deflection, radians, that float32 is to blame for: behind a front of a ball of
    radius 1. b, steps : (n,), impact parameters, and steps that stood -> (n,)

    Every step rounds the coordinates, which are below 1 there, by EPSILON / 2 at most and EPSILON / √12 in the mean
    square; with x, n changes by Δn / thickness of it, times √(10/7), the mean square of the quintic's slope; with n,
    the direction turns by tan ψ of that. The steps' roundings are independent. Counting only the steps in the front,
    numpy's float32 beside float64 along the same steps has 0.8 to 1.7 of this, for b from 0.3 to 0.95 and 1e-3 to
    1e-1 R; the GPU has 0.7 to 0.9 of this with all steps that stood, from 3e-4 to 1e-3 R.
    """
    slope = np.sqrt(10.0 / 7.0) * strength / thickness
    return slope * EPSILON * np.sqrt(steps / 12.0) * b / np.sqrt(1.0 - b**2)


def stiff_flows(quick: bool) -> list[dict]:
    """Rössler with γ = 100 and Lorenz with ρ = 1000, as a flow and as a force.

    A tolerance a hundred times tighter takes a method of fifth order 100^(1/5) = 2.5 times the steps, and one whose
    estimate is of third order 100^(1/3) = 4.6 times. Where it takes fewer, stability and not accuracy keeps the steps
    short, as it does those of the explicit method in Rössler's flow. The others are steep, but not stiff.
    """
    generator = np.random.default_rng(12)
    positions = generator.uniform(-1.0, 1.0, (16, 3)) + 1.0
    directions = generator.normal(size=(16, 3))
    records = []
    for name, values in (("roessler", {"gamma": 100.0}), ("lorenz", {"rho": 1000.0})):
        for mode in ("flow", "force"):
            model = MODELS[name](mode=mode, plane_distance=0.0, **values)
            for method in METHODS:
                loose, tight = (
                    trace_rays(model, positions, directions, replace(EXACT, integrator=method, tolerance=tolerance))
                    for tolerance in (1e-2, 1e-4)
                )
                limited = any((ends.status == Status.STEP_LIMIT).any() for ends in (loose, tight))
                well = ended_well(loose) and ended_well(tight) and not limited
                shown = (name, mode, method) == ("roessler", "flow", EXPLICIT)
                records.append(
                    record(
                        name,
                        f"{mode}, {', '.join(f'{key} = {value:g}' for key, value in values.items())}",
                        "a named status within the step limit; "
                        + ("stability limits steps" if shown else "ratio reported"),
                        "steps at tolerance 1e-4 / steps at 1e-2",
                        float(tight.steps.sum() / loose.steps.sum()),
                        STEPS_OF_ACCURACY if shown else None,
                        also=well,
                        holds=well,
                        statuses=counted(tight.status),
                        integrator=method,
                        mean_step=_mean_step(loose),
                        steps_max=int(tight.steps.max()),
                    )
                )
    return records


def damping(quick: bool) -> list[dict]:
    """dv/dτ = −κ v comes to rest at x = d / κ: x(τ) = d (1 − exp(−κτ)) / κ. It begins at the centre, where float32 has
    digits for so short a way, and never escapes: it ends where its steps no longer move it.
    """
    directions = np.random.default_rng(3).normal(size=(8, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    records = []
    for kappa in 10.0 ** np.arange(7):
        forces = {f"f{axis}": f"-kappa * v{axis}" for axis in "xyz"}
        model = MODELS["custom"](**forces, parameters={"kappa": float(kappa)})
        for method in METHODS:
            settings = replace(EXACT, integrator=method, tolerance=1e-5, max_steps=2000)
            ends = trace_rays(model, np.zeros((8, 3)), directions, settings)
            error = np.linalg.norm(ends.position * kappa - directions, axis=1)
            named = np.isin(ends.status, FAILURES)
            records.append(
                record(
                    "custom",
                    f"kappa = {kappa:g}",
                    "rests within 1e-4 of its way, or a counted, named failure",
                    "largest error of the way / the way",
                    error.max(),
                    holds=ended_well(ends) and bool((named | (error <= RESTS)).all()),
                    statuses=counted(ends.status),
                    integrator=method,
                    kappa=float(kappa),
                    off=int(np.sum(error > RESTS)),
                    mean_step=_mean_step(ends),
                    steps_max=int(ends.steps.max()),
                )
            )
    return records


def _mean_step(ends: RayEnds) -> float:
    """τ"""
    return float(np.sum(ends.parameter, dtype=float) / np.sum(ends.steps))
