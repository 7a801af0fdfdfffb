"""What all tests share: shader tests fail, and are not skipped, where OpenGL without a window does not work."""

import subprocess
import sys
from pathlib import Path

import pytest

SHADERS = Path(__file__).parent / "shaders"
# In a process of its own: no context of ours may be current before the code under test makes one.
MAKE_CONTEXT = "import moderngl; moderngl.create_context(standalone=True, backend='egl', require=330)"


@pytest.fixture(scope="session")
def egl():
    """Fails the tests that use it where no OpenGL 3.3 context can be made with EGL."""
    made = subprocess.run([sys.executable, "-c", MAKE_CONTEXT], capture_output=True, text=True, timeout=120)
    if made.returncode != 0:
        pytest.fail(f"No OpenGL 3.3 with EGL here. Run: make setup\n{made.stderr}", pytrace=False)


def pytest_collection_modifyitems(items):
    """Every test in tests/shaders uses the fixture `egl`."""
    for item in items:
        if SHADERS in item.path.parents and hasattr(item, "fixturenames"):
            item.fixturenames.insert(0, "egl")
