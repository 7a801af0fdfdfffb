"""Render a .blend without a window: `make render BLEND=file.blend FRAMES=1-10 OUT=folder`.

The extension's own command does the work, inside the bpy package instead of a Blender program.
"""

import argparse
import os
import sys

import bpy_extension


def open_file(path):
    """Open the .blend; exits with one line where that cannot be done."""
    import bpy

    try:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(path), load_ui=False)
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1].removeprefix("Error: ")
        sys.exit(f"Blender cannot open {path}: {reason}")


def main():
    """Exit status: 0 where every frame was written."""
    parser = argparse.ArgumentParser(prog="make render", description=__doc__.splitlines()[0])
    parser.add_argument("blend", help="the .blend file")
    parser.add_argument("--frames", default="1", help='such as "1" or "1-10"')
    parser.add_argument("--output", default="out", help="folder for the pictures")
    arguments = parser.parse_args()
    if not os.path.isfile(arguments.blend):
        sys.exit(f"{arguments.blend}: there is no such file. Name a .blend: make render BLEND=path/to/file.blend")

    bpy_extension.link()
    extension = bpy_extension.enable()
    open_file(arguments.blend)
    command = ["render", "--frames", arguments.frames, "--output", os.path.abspath(arguments.output)]
    try:
        return extension("addon.commands").main(command)
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
