"""The extension in the bpy package, enabled from this repository the way Blender enables an installed one.

    folder = link()             # before the first `import bpy`
    modules = enable()          # modules("addon.export") is bl_ext.user_default.nonlinear_rays.addon.export

Nothing is read from or written to the user's own Blender settings.
"""

import atexit
import importlib
import os
import shutil
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
NAME = "nonlinear_rays"
MODULE = f"bl_ext.user_default.{NAME}"


def link():
    """Make a scratch BLENDER_USER_RESOURCES that links to this repository; removed when Python exits."""
    if "bpy" in sys.modules:
        raise RuntimeError("bpy is imported already and has read the user's settings. Call link() before `import bpy`.")
    folder = Path(tempfile.mkdtemp(prefix="nonlinear-rays-"))
    extensions = folder / "extensions" / "user_default"
    extensions.mkdir(parents=True)
    (extensions / NAME).symlink_to(REPOSITORY, target_is_directory=True)
    os.environ["BLENDER_USER_RESOURCES"] = str(folder)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def modules(name=""):
    """The extension's module of that name, such as "addon.export"; the root module without a name."""
    return importlib.import_module(f"{MODULE}.{name}" if name else MODULE)


def enable():
    """Enable the extension and return `modules`. It is disabled again when Python exits: Blender 4.5 hangs
    there while panels or operators are registered."""
    import bpy  # makes addon_utils importable

    # isort: split
    import addon_utils

    def fail(error):
        raise RuntimeError(f"The extension {NAME} could not be enabled. Mend the error above.") from error

    bpy.context.preferences.use_preferences_save = False
    if addon_utils.enable(MODULE, default_set=True, handle_error=fail) is None:
        raise RuntimeError(f"Blender refused the extension {NAME}. Its message is above.")
    atexit.register(disable)
    return modules


def disable():
    """Disable the extension where it is enabled."""
    import addon_utils

    if addon_utils.check(MODULE)[1]:
        addon_utils.disable(MODULE, default_set=True)
