"""Run some tests on another OpenGL driver than this machine's, and say which: `make test-drivers`.

The other driver is Mesa's zink over lavapipe. What is not installed is named, with how to install it, and left out.
"""

import os
import subprocess
import sys

import environments
from test import run_part

HERE = ("tests/core/test_drivers.py", "tests/shaders/test_other_drivers.py")
ON_ZINK = tuple(
    f"tests/shaders/test_{name}.py"
    for name in ("functions", "intersection", "shading", "filtering", "lost_rays", "fast_math")
)
RENDERER = "from addon.core import device; print(device.describe())"


def renderer(more=None):
    """(name, what was said instead) of the driver that a child process with these variables gets."""
    command = [str(environments.python(environments.newest())), "-c", RENDERER]
    environment = environments.process_environment() | (more or {})
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    name = done.stdout.strip() if done.returncode == 0 else ""
    return name, (done.stderr.strip().splitlines() or [""])[-1]


def run_all():
    """(summary lines, True where nothing failed)."""
    version = environments.newest()
    usual, problem = renderer()
    if not usual:
        return [f"No OpenGL here: {problem}"], False
    status, numbers = run_part(f"This machine's driver: {usual}", version, ["-rs", *HERE])
    summary, passed = [f"{usual}: {numbers}"], status == 0
    name, problem = renderer(environments.ZINK)
    if not name.startswith("zink"):
        instead = f"'{name}' runs instead" if name else problem or "no driver"
        return [*summary, f"zink: not run ({instead}). {environments.ZINK_ADVICE}"], passed
    os.environ.update(environments.ZINK)
    status, numbers = run_part(f"Another driver: {name}", version, ["-rs", *ON_ZINK])
    return [*summary, f"{name}: {numbers}"], passed and status == 0


def main():
    """Exit status: 0 where none failed of those that this machine can run."""
    os.chdir(environments.REPOSITORY)
    try:
        summary, passed = run_all()
    except KeyboardInterrupt:
        return 130
    print("\n=== What ran ===", *summary, "Passed." if passed else "FAILED.", sep="\n", flush=True)
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
