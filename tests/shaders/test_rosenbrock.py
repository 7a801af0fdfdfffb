"""The L-stable Rosenbrock method on the GPU: every law's 6 x 6 system, and friction that stops explicit methods."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.reference import angles
from addon.core.report import stiff
from addon.core.report.stiff_cases import RADIUS, rest, whirl, whirl_directions
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import trace_rays
from tests.shaders.model_checks import EPS, all_finite, errors
from tests.shaders.smooth_rays import PIPELINES, WAYS, differences, jacobian

STIFF = Settings(
    integrator="rosenbrock_32", step_control="embedded", tolerance=1e-3, segments=2000, escape_radius=RADIUS
)
FALL = 3.31  # h kappa, to which Dormand and Prince's method is stable on the negative real axis
KAPPAS = [1e2, 1e4, 1e5]


@pytest.mark.parametrize("name", WAYS)
def test_the_system_is_solved(glsl, name):
    """W k = b against numpy's solution with the same differences in float64. The shader's right-hand sides are rounded
    by 12 EPS, as test_orders has it, two of them in a difference; and its elimination by some EPS for each of 36 terms.
    """
    way = WAYS[name]
    model, _, _, states = way.start()
    states = states.astype(np.float32).astype(float)
    step = way.length / 16
    body = f"""
        hold(x.xyz);
        RayState s = RayState(x.xyz, v.xyz);
        RayState first = rhs(s);
        RayState k = solve(linearise(s, first, {step!r}), first.x, first.v);
        out_kx = vec4(k.x, 0.0);
        out_kv = vec4(k.v, 0.0);
    """
    found = glsl(
        [*model.borders().files, *model.shader_files(), "integrators/linearised"],
        body,
        {"x": states[:, :3], "v": states[:, 3:]},
        ("kx", "kv"),
        model.uniforms(),
        model.textures(),
        model.flags(),
        model.generated(),
    )
    first = model.rhs(states)
    w = np.eye(6) - step * jacobian(model.rhs, states, first, step)
    inverse = np.linalg.inv(w)
    k = (inverse @ first[..., None])[..., 0]
    sizes = np.linalg.norm(first.reshape(-1, 2, 3), axis=2).repeat(3, axis=1)
    off = 24.0 * EPS * step * sizes[:, :, None] / differences(states, first, step)[:, None, :] + 36.0 * EPS * np.abs(w)
    bound = (np.abs(inverse) @ (off @ np.abs(k)[..., None] + 12.0 * EPS * sizes[..., None]))[..., 0]
    error = np.abs(np.concatenate([found["kx"][:, :3], found["kv"][:, :3]], axis=1) - k)
    print(f"{name}: {(error / bound).max():.2f} of the bound, which is {(bound / np.abs(k).max()).max():.1e} of k")
    assert (error <= bound).all() and (bound < 0.05 * np.abs(k).max()).all()


@pytest.mark.parametrize("name", ["kerr", "wormhole", "luneburg"])
@pytest.mark.parametrize("pipeline", PIPELINES)
def test_directions(name, pipeline):
    """Of the laws whose slope rounding covers: within the tolerance of DOP853."""
    model, x, d, _ = WAYS[name].start()
    settings = replace(STIFF, pipeline=pipeline, escape_radius=None)
    ends, error, allowed = errors(model, x, d, settings)
    print(f"{name}, {pipeline}: {error.max():.1e}, {(error / allowed).max():.2f} of what is allowed")
    assert (error <= allowed).all() and all_finite(ends)


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_rounding_does_not_stop_it(pipeline):
    """A tolerance that float32 cannot meet: the ray arrives all the same, and is right to EPS for each of its steps;
    with as few steps as if it had been asked for less. (At 1e5 the first decay, so resolved, is too thin for float32.)
    """
    for kappa in KAPPAS[:2]:
        case = whirl(kappa)
        settings = replace(STIFF, pipeline=pipeline, tolerance=1e-7)
        ends = trace_rays(case.model, case.positions, case.directions, settings)
        error = case.error(ends).max()
        print(f"kappa = {kappa:g}, {pipeline}: {error:.1e}, {ends.steps.max()} steps")
        assert (ends.status == Status.ESCAPED).all() and (case.error(ends) <= EPS * ends.steps).all()
        assert ends.steps.max() < 1200


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_stiff_friction_takes_no_more_steps(pipeline):
    """In a wind, against the closed form: as right as was asked, and with steps that do not know kappa. Only the first
    decay takes more of them, a factor of 5 in h each: log5(1e3) = 4 for a thousand times kappa, and as many back.
    """
    steps = []
    for kappa in KAPPAS:
        case = whirl(kappa)
        ends = trace_rays(case.model, case.positions, case.directions, replace(STIFF, pipeline=pipeline))
        truth = whirl_directions(kappa, case.positions, case.directions, ends.parameter.astype(float))
        error = angles(ends.direction.astype(float), truth).max()
        steps.append(ends.steps.mean())
        print(f"kappa = {kappa:g}, {pipeline}: {error:.1e}, {steps[-1]:.0f} steps")
        assert (ends.status == Status.ESCAPED).all() and error <= STIFF.tolerance and all_finite(ends)
    assert max(steps) <= 1.1 * min(steps)


def test_stability_holds_explicit_steps_short():
    """Dormand and Prince's steps are as long as they are stable, however coarse the tolerance: it does not arrive."""
    for kappa in KAPPAS[1:]:
        case = whirl(kappa)
        settings = replace(STIFF, integrator="dormand_prince_54", tolerance=0.1, max_steps=2000)
        ends = trace_rays(case.model, case.positions, case.directions, settings)
        mean = kappa * ends.parameter.max() / 2000
        print(f"kappa = {kappa:g}: mean step {mean:.2f} / kappa")
        assert (ends.status == Status.STEP_LIMIT).all() and 0.5 * FALL < mean < 1.1 * FALL


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("kappa", [1.0, 1e3, 1e6])
def test_rays_come_to_rest(kappa, pipeline):
    """At 1 / kappa, within the tolerance, in 150 steps."""
    case = rest(kappa)
    settings = replace(STIFF, pipeline=pipeline, tolerance=1e-2, max_steps=150, escape_radius=None)
    ends = trace_rays(case.model, case.positions, case.directions, settings)
    error = case.error(ends).max()
    print(f"kappa = {kappa:g}, {pipeline}: {error:.1e} of the way, {ends.steps.max()} steps")
    assert error <= settings.tolerance and (ends.status > Status.RUNNING).all() and all_finite(ends)


def test_the_report_says_where_it_wins(egl, monkeypatch):
    """By far in a wind with kappa = 1000, where explicit steps are ten times as many; not where a ray comes to rest."""
    monkeypatch.setattr(stiff, "all_cases", lambda quick: [whirl(1e3), rest(1e3)])
    records = stiff.run(True)
    wind, still = ({row["integrator"]: row for row in part} for part in (records[:3], records[3:]))
    assert all(row["reached"] and row["error_p99_rad"] <= stiff.GOAL for row in records)
    assert wind["rosenbrock_32"]["steps_mean"] < 0.1 * wind["dormand_prince_54"]["steps_mean"]
    assert still["rosenbrock_32"]["steps_mean"] >= still["dormand_prince_54"]["steps_mean"]
    won, lost = stiff.sentences(records)
    assert "wind, kappa = 1000: Rosenbrock 3(2) is" in won and "times as fast" in won
    assert lost.startswith("Friction at rest, kappa = 1000")
