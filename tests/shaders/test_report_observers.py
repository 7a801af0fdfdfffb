"""The report's observers, in float64 from the metric, look where those of the shaders do."""

import numpy as np
import pytest

from addon.core.models import MODELS
from addon.core.observers import chart_directions
from addon.core.reference import true_ends
from addon.core.report.cases import of_scene
from addon.core.report.work_precision import precision
from addon.core.scene import Placement, Scene
from addon.core.settings import Settings
from tests.shaders.scenes import camera, rotation

EPS = 2.0**-24
VELOCITY = (0.3, -0.5, 0.2)
HOLES = (("schwarzschild", {}), ("kerr", {"spin": 0.9}), ("kerr", {"spin": -0.6}))


def looks(n, seed):
    """Places between 3 and 30 model lengths, and directions; float32's numbers, unit in float64."""
    generator = np.random.default_rng(seed)
    x, d = generator.normal(size=(2, n, 3))
    x *= generator.uniform(3.0, 30.0, n)[:, None] / np.linalg.norm(x, axis=1, keepdims=True)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d = d.astype(np.float32).astype(float)
    return x.astype(np.float32).astype(float), d / np.linalg.norm(d, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("name", "values", "observer"),
    [
        *((name, values, observer) for name, values in HOLES for observer in ("chart", "static", "moving")),
        *(("kerr", {"spin": spin}, "falling") for spin in (0.9, -0.6)),
        ("wormhole", {}, "moving"),
    ],
)
def test_the_same_direction(glsl, name, values, observer):
    """Within some ten roundings, which the boosts at most double."""
    model = MODELS[name](**values)
    x, d = looks(300, 3)
    flat = [] if model.has_static_frame else ["observers/flat"]
    found = glsl(
        [f"observers/{observer}", *flat, f"models/{name}"],
        "out_result = vec4(chart_direction(x.xyz, d.xyz), 0.0);",
        {"x": x, "d": d},
        uniforms=model.uniforms() | {"u_observer_velocity": VELOCITY},
    )["result"][:, :3].astype(float)
    expected = chart_directions(model, observer, VELOCITY, x, d)
    error = np.abs(found - expected).max()
    print(f"{name}, {observer}: {error:.1e}, bound {20 * EPS:.1e}")
    assert error < 20 * EPS
    if observer != "chart":
        assert np.abs(expected - d).max() > 0.01  # something was turned


@pytest.mark.parametrize(
    ("model", "observer"),
    [(MODELS["schwarzschild"](), "static"), (MODELS["kerr"](), "falling"), (MODELS["schwarzschild"](), "moving")],
)
def test_errors_are_those_of_what_the_observer_sees(egl, model, observer):
    """Eight masses from the hole, in a model that is turned in the world: in the chart's directions rays would be whole
    degrees away; held against the reference as the observer's they are right to a hundredth of a pixel.
    """
    placement = Placement(rotation=rotation(0.3, -0.2, 0.9), scale=2.0)
    settings = Settings(observer=observer, observer_velocity=VELOCITY, tolerance=1e-5, segments=20_000)
    case = of_scene(Scene(camera(64, 64, position=(0.0, -16.0, 4.0), half=1.5), model, placement), settings)
    positions, directions = case.rays(8)
    found = precision(case, settings, positions, directions, case.truth(positions, directions))
    assert found["error_p99_px"] < 0.01 and found["misclassified_percent"] == 0.0
    wrong = precision(case, settings, positions, directions, true_ends(model, positions, directions))
    assert wrong["error_median_px"] > 1.0
