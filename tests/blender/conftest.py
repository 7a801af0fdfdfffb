"""The extension enabled in the bpy package.

The modules that Blender loads (bl_ext.user_default.nonlinear_rays.…) are not those that `import addon` loads:
tests here reach them through the fixture only, `extension("addon.export")`.
"""

import pytest

from tools import bpy_extension

# Before any test module imports bpy.
bpy_extension.link()


@pytest.fixture(scope="session")
def extension():
    """extension("addon.export") is the module of that name in the enabled extension."""
    yield bpy_extension.enable()
    bpy_extension.disable()


@pytest.fixture
def empty_file(extension):
    """A new file with nothing in it, the extension enabled; the value is its scene."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene
