"""The device: errors that say what to install, one thread, a fresh start after a shutdown."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from addon.core import device as gpu
from addon.core.compose import Choice, ShaderError, Source
from addon.core.trace import render
from tests.shaders import scenes

REPOSITORY = Path(__file__).resolve().parents[2]


def test_without_egl_the_error_says_what_to_install():
    """In a process whose EGL finds no driver, as on a machine without Mesa."""
    program = """
from addon.core import device
try:
    device.describe()
except device.DeviceError as error:
    print("DeviceError:", error)
"""
    environment = os.environ | {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("DeviceError: No OpenGL 3.3 device"), done.stdout + done.stderr
    assert "apt install libegl1 libgl1 libgl1-mesa-dri" in done.stdout


def test_all_jobs_run_in_one_thread_of_its_own():
    threads = {gpu.run(lambda device: threading.get_ident()) for _ in range(3)}
    assert len(threads) == 1 and threading.get_ident() not in threads


def test_what_a_job_raises_reaches_the_caller_and_the_next_job_works():
    def broken(device):
        raise KeyError("the job's own")

    with pytest.raises(KeyError, match="the job's own"):
        gpu.run(broken)
    assert gpu.describe()


def test_shutdown_and_a_fresh_start():
    scene = scenes.mixed(view=scenes.camera(4, 4))
    before = render(scene, scenes.papers()).passes["Combined"]
    gpu.shutdown()
    gpu.shutdown()  # nothing to do
    assert (render(scene, scenes.papers()).passes["Combined"] == before).all()


def test_a_rejected_shader_names_file_and_line():
    source = Source("#version 330 core\n#line 1 0\nvoid main() {\n    nonsense;\n}\n", ("passes/broken",), ())
    with pytest.raises(ShaderError, match=r"(?s)The driver rejects a shader:.*passes/broken\.glsl:2"):
        gpu.run(lambda device: gpu.Program(device.ctx, source, device._vertex_text))


def test_a_program_is_compiled_once():
    choice = Choice("passes/cull")

    def twice(device):
        return device.program(choice) is device.program(choice)

    assert gpu.run(twice)
