"""The virtual environments of this repository: where they are, and which Blender each one holds.

Standard library only, and Python 3.8 or newer: it runs before anything is installed.
"""

import os
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent

# Oldest first: "the newest" below is the last that is set up.
BLENDER_BY_PYTHON = {"3.11": "Blender 4.5 LTS", "3.13": "Blender 5.2 LTS"}

# For child processes: Mesa's zink, which makes Vulkan of OpenGL, over lavapipe, which is Vulkan on the processor.
ZINK = {"LIBGL_ALWAYS_SOFTWARE": "1", "MESA_LOADER_DRIVER_OVERRIDE": "zink"}
ZINK_ADVICE = "Debian, Ubuntu: sudo apt-get install mesa-vulkan-drivers"


def folder(version):
    """The virtual environment for a Python version such as "3.13"."""
    return REPOSITORY / ".venv" / version


def python(version):
    """The interpreter inside that virtual environment."""
    return folder(version) / "bin" / "python"


def stamp(version):
    """Written last by setup.py: without it, the environment is not complete."""
    return folder(version) / "setup-stamp"


def ready():
    """Versions that are set up, oldest first."""
    return [version for version in BLENDER_BY_PYTHON if python(version).exists() and stamp(version).exists()]


def newest():
    """The newest version that is set up; exits with an advice where there is none."""
    versions = ready()
    if not versions:
        sys.exit("No virtual environment is complete in .venv. Run: make setup")
    return versions[-1]


def process_environment():
    """Environment for child processes: the environment's own packages only, and output as it comes."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    return {**kept, "PYTHONUNBUFFERED": "1", "PYTHONNOUSERSITE": "1"}


if __name__ == "__main__":
    print(python(newest()))
