"""The order of every integrator, for every model and in both pipelines: log2 of e(h) / e(h/2) with constant steps.

float32 has a floor: the steps are so large that the method's error stands out of it, and so small that the first term
of the error rules. What the next term and rounding may do to the slope is derived below, and both are measured.
"""

import numpy as np
import pytest

from addon.core.rosenbrock import ROSENBROCK_METHODS
from addon.core.tableaus import TABLEAUS
from tests.shaders.model_checks import EPS
from tests.shaders.smooth_rays import PARABOLA, PIPELINES, WAYS, in_float64, root_mean_square, traced

# Integrator -> its order; its steps for one of Dormand and Prince's; by how much the slope may exceed the order.
#
# e = C h^p (1 + c h + ...) has the slope p + 0.72 c h: half an order for c h = 0.7, which the steps keep below. Another
# order is off by one. Dormand and Prince made C smaller than the terms behind it, which rule until errors are below
# what float32 can tell: only a larger slope can come of that.
METHODS = {
    "euler": (1, 16, 0.5),
    "verlet": (2, 8, 0.5),
    "bogacki_shampine_32": (3, 4, 0.5),
    "runge_kutta_4": (4, 2, 0.5),
    "dormand_prince_54": (5, 1, 3.0),
    "rosenbrock_32": (3, 4, 0.5),
}
# Where rounding, which a Rosenbrock method's differences magnify, covers the error before the slope is the order:
# tests/shaders/test_rosenbrock.py looks at the error alone.
COVERED = ("kerr", "wormhole", "luneburg", "grid")
SLOPES = [
    (name, integrator)
    for integrator in METHODS
    for name in WAYS
    if integrator != "rosenbrock_32" or name not in COVERED
]

# Laws for a Nystrom method whose forces have six derivatives: the shell's fourth derivative of n jumps.
SMOOTH = [name for name, way in WAYS.items() if way.start()[0].force_of_position() and name != "shell"]
STAGES = {name: method.stages for name, method in (TABLEAUS | ROSENBROCK_METHODS).items()} | {"verlet": 4}


@pytest.mark.parametrize(("name", "integrator"), SLOPES)
def test_slope(name, integrator):
    """Against DOP853. The GPU's errors are those of the same method in float64 but for rounding: twelve times the
    change that it makes there to round all states and derivatives, as each of these is itself a sum (of 64 products for
    the grid), and rounded several times.
    """
    way, (order, times, above) = WAYS[name], METHODS[integrator]
    exact = way.exact[:, :3]
    errors, ratios = {pipeline: [] for pipeline in ("float64", *PIPELINES)}, []
    for steps in (times * way.steps, 2 * times * way.steps):
        twin, rounded = (states[:, :3] for states in in_float64(way, integrator, steps))
        rounding = 12.0 * root_mean_square(rounded - twin)
        errors["float64"].append(root_mean_square(twin - exact))
        ratios.append(rounding / errors["float64"][-1])
        for pipeline in PIPELINES:
            position = traced(way, pipeline, integrator, steps).position.astype(float)
            assert root_mean_square(position - twin) <= rounding, pipeline
            errors[pipeline].append(root_mean_square(position - exact))
    slopes = {pipeline: np.log2(coarse / fine) for pipeline, (coarse, fine) in errors.items()}
    assert ratios[1] < 0.75  # the error stands out
    blurred = np.log2(1.0 + ratios[0]) - np.log2(1.0 - ratios[1])
    print(
        f"{name}, {integrator}: "
        + ", ".join(f"{pipeline} {slope:.2f}" for pipeline, slope in slopes.items())
        + f"; order {order}, e = {errors['fused'][0]:.1e} and {errors['fused'][1]:.1e}, rounding {blurred:.2f}"
    )
    assert order - 0.5 <= slopes["float64"] <= order + above
    for pipeline in PIPELINES:
        assert abs(slopes[pipeline] - slopes["float64"]) <= blurred


@pytest.mark.parametrize("name", SMOOTH)
def test_nystroms_slope(name):
    """A slope of six ends within a factor of four of steps in float32. So the GPU is held against the same method in
    float64, to within rounding as above, and that method's slope is taken where it is the order.
    """
    way = WAYS[name]
    exact = way.exact[:, :3]
    for steps in (way.steps, 2 * way.steps):
        twin, rounded = (states[:, :3] for states in in_float64(way, "nystrom_64", steps))
        for pipeline in PIPELINES:
            position = traced(way, pipeline, "nystrom_64", steps).position.astype(float)
            assert root_mean_square(position - twin) <= 12.0 * root_mean_square(rounded - twin), pipeline
    errors = [
        root_mean_square(in_float64(way, "nystrom_64", steps)[0][:, :3] - exact)
        for steps in (4 * way.steps, 8 * way.steps)
    ]
    slope = np.log2(errors[0] / errors[1])
    print(f"{name}: {slope:.2f}, e = {errors[0]:.1e} and {errors[1]:.1e}")
    assert 5.5 <= slope <= 7.0


@pytest.mark.parametrize("integrator", METHODS)
def test_parabolas(integrator):
    """n^2 linear: Euler's method has its order, and every other one is exact. Rounding: eps |x| a stage, at most."""
    order, times, _ = METHODS[integrator]
    exact = PARABOLA.exact[:, :3]
    floor = EPS * np.linalg.norm(exact, axis=1).max()
    for pipeline in PIPELINES:
        steps = np.array([times, 2 * times])
        errors = [
            root_mean_square(traced(PARABOLA, pipeline, integrator, int(n)).position.astype(float) - exact)
            for n in steps
        ]
        print(f"{integrator}, {pipeline}: {errors[0]:.1e}, {errors[1]:.1e}, floor {floor:.1e} a stage")
        if order == 1:
            assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.1)
        else:
            assert (errors <= floor * STAGES[integrator] * steps).all()
