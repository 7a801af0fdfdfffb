"""Make the samples: python sample_blends/build.py [--output DIR] [NAME …], with bpy 4.5, so that 4.5 and 5.2 open them.

Nothing is downloaded; pictures are packed into the files. The content is the same each time, down to the pictures'
bytes; the files are not. Blender writes memory addresses into them, random numbers of nodes, and in each mesh the
time of day (Mesh.face_sets_color_seed), which Python cannot set. Fixed addresses and a single processor (setarch -R,
taskset) were tried: 17 to 850 of 1100 to 1900 blocks still moved.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
SAMPLES = (  # functions in scenes.py
    "test_scene",
    "lorenz",
    "potential",
    "explosion",
    "schwarzschild",
    "neutron_star",
    "suzanne",
    "kerr",
    "wormhole",
    "mirage",
    "luneburg",
    "volume_refraction",
)


def build(name, folder):
    """Write folder/name.blend; returns its path. Blender runs in a process apart, for its environment."""
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="nonlinear-rays-") as scratch:
        environment = {
            **os.environ,
            "HOME": "/",  # the start of the file browser's path, which is in the file
            "TMPDIR": scratch,
            "GLIBC_TUNABLES": "glibc.malloc.perturb=85",  # uninitialised memory is written too: make it "U"
        }
        command = [sys.executable, __file__, "--here", name]
        child = subprocess.run(command, cwd=scratch, env=environment, capture_output=True, text=True, timeout=300)
        written = Path(scratch, f"{name}.blend")
        if child.returncode != 0 or not written.exists():
            sys.exit(f"{name}.blend was not written. Mend this error:\n{child.stdout}{child.stderr}")
        return Path(shutil.move(written, folder / written.name))


def write_here(name):
    """Make the sample and write it into the current folder. Imports Blender."""
    sys.path[:0] = [str(HERE), str(HERE.parent / "tools")]
    import bpy_extension

    bpy_extension.link()
    import bpy
    import scenes

    if bpy.app.version[:2] != (4, 5):
        sys.exit(f"This is bpy {bpy.app.version_string}, but 4.5 makes the samples. Use .venv/3.11/bin/python.")
    bpy_extension.enable()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "NONLINEAR_RAYS"
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    scene.render.resolution_percentage = 100
    scene.render.filepath = "//out/"
    scene.view_settings.view_transform = "Standard"
    scene.nonlinear_rays.samples = 4
    scene.frame_end = 1
    getattr(scenes, name)(scene)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(f"{name}.blend"), compress=True)


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"out of {', '.join(SAMPLES)}; all by default")
    parser.add_argument("--output", type=Path, default=HERE, metavar="DIR", help="default: the folder of this program")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for name in arguments.names:
        if name not in SAMPLES:
            parser.error(f"there is no sample '{name}'. Choose out of {', '.join(SAMPLES)}.")
    for name in arguments.names or SAMPLES:
        if arguments.here:
            write_here(name)
        else:
            path = build(name, arguments.output)
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
