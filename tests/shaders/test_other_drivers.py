"""Drivers of Mesa's, each in its own process: zink renders what llvmpipe does, and softpipe comes to an end."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tools.environments import ZINK, ZINK_ADVICE

REPOSITORY = Path(__file__).resolve().parents[2]
LLVMPIPE = {"LIBGL_ALWAYS_SOFTWARE": "1"}
SOFTPIPE = {"LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": "softpipe"}
RENDERER = "from addon.core import device; print(device.describe())"

# Roundings differ, and with them the estimates that step sizes follow. Measured: 1.2e-5. Both are right to TOLERANCES.
ALLOWED = 1e-4
# Of a frame's pixels. A rounding may turn a decision of the step control round, and the ray takes other steps, which
# are as right. Where Euler's method grazes the lens's rim, as the paper's default does, 1 to 2 % of the rays part by
# 0.02 rad.
DECIDED_OTHERWISE = 0.03

TWO_TRIANGLES = """
from addon.core.scene import Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import render
from tests.shaders import scenes

scene = Scene(scenes.camera(16, 12), scenes.STRAIGHT, triangles=scenes.quad((0, 0, 0), (1, 0, 0), (0, 0, 1)))
status = render(scene, Settings(pipeline="fused", passes=("Status",))).passes["Status"]
print({Status(int(number)).name for number in set(status.ravel().tolist())})
"""


def python(*arguments, **variables):
    """What a child process with these environment variables prints; None where it fails."""
    command, environment = [sys.executable, *arguments], os.environ | variables
    done = subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=300)
    return done.stdout.strip() if done.returncode == 0 else None


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """name/pass -> pixels of llvmpipe and of zink."""
    name = python("-c", RENDERER, **ZINK)
    if not (name or "").startswith("zink"):
        pytest.skip(f"zink does not run here ({name or 'no driver'}). {ZINK_ADVICE}")
    folder = tmp_path_factory.mktemp("frames")
    files = [folder / f"{driver}.npz" for driver in ("llvmpipe", "zink")]
    for path, variables in zip(files, (LLVMPIPE, ZINK), strict=True):
        assert python("-m", "tests.shaders.driver_frames", str(path), **variables) is not None
    frames = [dict(np.load(path)) for path in files]
    assert [str(of_driver.pop("driver")).split()[0] for of_driver in frames] == ["llvmpipe", "zink"]
    return frames


def test_rays_end_alike_on_zink(both):
    llvmpipe, zink = both
    assert llvmpipe.keys() == zink.keys() and len(zink) > 50
    for name, pixels in zink.items():
        if name.endswith(("Status", "Object Index")):
            assert np.array_equal(pixels, llvmpipe[name]), name


def test_pictures_are_alike_on_zink(both):
    """Lengths as parts of themselves; the rest as it is."""
    llvmpipe, zink = both
    for name, pixels in zink.items():
        size = np.abs(pixels) if name.endswith("Depth") else 1.0
        alike = (np.abs(pixels - llvmpipe[name]) <= ALLOWED * size).all(axis=-1)
        assert np.mean(~alike) <= DECIDED_OTHERWISE, name


def test_rays_end_by_name_on_softpipe():
    """It goes wrong in the tree's loop, which it never left before the loop had a bound; rays are lost there."""
    if python("-c", RENDERER, **SOFTPIPE) != "softpipe":
        pytest.skip("Mesa's softpipe is not installed.")
    ends = python("-c", TWO_TRIANGLES, **SOFTPIPE)
    assert ends is not None and "ESCAPED" in ends and "RUNNING" not in ends
