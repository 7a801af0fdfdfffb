"""Everything that the other commands need, from nothing: `make setup`.

For each of Python 3.11 and 3.13 on this machine: a virtual environment in `.venv`, the pinned packages of
`tools/requirements-*.txt`, and the system's libraries for Blender (as the Python package bpy) and for OpenGL without
a window (EGL with Mesa's software driver). Each is tried by using it. Done again, it costs nothing.

Standard library only.
"""

import argparse
import glob
import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import environments

TOOLS = Path(__file__).resolve().parent

# What Debian and Ubuntu call the libraries behind EGL with Mesa, and behind `import bpy`.
EGL_PACKAGES = ["libegl1", "libgl1", "libgl1-mesa-dri", "libgles2"]
BPY_PACKAGES = [
    *("libgl1", "libice6", "libsm6", "libx11-6", "libxext6", "libxfixes3", "libxi6"),
    *("libxkbcommon0", "libxrender1", "libxxf86vm1"),
]

PROBE_INTERPRETER = "import sys, ssl, zlib, ctypes, venv; print('%d.%d' % sys.version_info[:2])"
PROBE_BPY = "import bpy; print('Blender ' + bpy.app.version_string, flush=True)"
PROBE_EGL = (
    "import moderngl; context = moderngl.create_context(standalone=True, backend='egl', require=330);"
    "print(context.info['GL_RENDERER'] + ', OpenGL ' + context.info['GL_VERSION'])"
)


def say(message):
    """One line of what is being done."""
    print(f"setup: {message}", flush=True)


def output_of(command):
    """(succeeded, standard output, error output) of a command; one that cannot start has failed."""
    try:
        done = subprocess.run(
            [str(word) for word in command],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=900,
            env=environments.process_environment(),
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return False, "", str(error)
    return done.returncode == 0, done.stdout.strip(), done.stderr.strip()


# --- Finding interpreters ---------------------------------------------------------------------------------------------


def interpreter_candidates(version):
    """Paths where a `python3.x` may be, likeliest first; pyenv's shims on PATH often do not work, its versions do."""
    name = f"python{version}"
    folders = [*os.environ.get("PATH", "").split(os.pathsep), "/usr/local/bin", "/usr/bin"]
    candidates = [os.path.join(folder, name) for folder in folders if folder]
    pyenv_roots = [os.environ.get("PYENV_ROOT", ""), os.path.expanduser("~/.pyenv"), output_of(["pyenv", "root"])[1]]
    for root in filter(None, pyenv_roots):
        candidates += sorted(glob.glob(os.path.join(root, "versions", f"{version}.*", "bin", name)), reverse=True)
    return [path for path in dict.fromkeys(candidates) if os.access(path, os.X_OK)]


def find_interpreter(version):
    """The first interpreter of that version that really runs, or None."""
    for path in interpreter_candidates(version):
        succeeded, answer, _ = output_of([path, "-c", PROBE_INTERPRETER])
        if succeeded and answer == version:
            return path
    return None


# --- The system's packages --------------------------------------------------------------------------------------------


def apt_prefix():
    """What to put before apt-get where installing is allowed without a question, else None."""
    if shutil.which("apt-get") is None:
        return None
    if os.geteuid() == 0:
        return []
    return ["sudo", "-n"] if output_of(["sudo", "-n", "true"])[0] else None


def install_system_packages(packages, reason):
    """Install with apt where that is allowed; otherwise say the command to type, and stop."""
    advice = f"sudo apt-get update && sudo apt-get install -y --no-install-recommends {' '.join(packages)}"
    prefix = apt_prefix()
    if prefix is None:
        sys.exit(f"setup: {reason}. Only root may install it. Type this, then run the command again:\n  {advice}")
    say(f"{reason}; installing with apt: {' '.join(packages)}")
    apt = [*prefix, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq", "-o", "DPkg::Lock::Timeout=120"]
    updated, _, _ = output_of([*apt, "update"])
    installed, _, error = output_of([*apt, "install", "-y", "--no-install-recommends", *packages])
    if not installed:
        update = "" if updated else " (and apt-get update failed)"
        print(error, file=sys.stderr)
        sys.exit(f"setup: apt-get install failed{update}. Mend that with this, then run the command again:\n  {advice}")


def require(version, what, probe, packages):
    """Run a probe in the environment; where it fails, install the packages behind it and run it once more."""
    command = [environments.python(version), "-c", probe]
    succeeded, answer, error = output_of(command)
    if not succeeded:
        last_line = error.splitlines()[-1] if error else "no message"
        install_system_packages(packages, f"{what} does not work here yet ({last_line})")
        succeeded, answer, error = output_of(command)
    if not succeeded:
        sys.exit(f"setup: {what} still fails in {environments.folder(version)}. Its message, to search for:\n{error}")
    say(f"Python {version}: {what} works: {answer.splitlines()[-1]}")


# --- The environments -------------------------------------------------------------------------------------------------


def requirements_hash(version):
    """Names the contents of the requirement files and of this script: another hash, another set-up."""
    files = [TOOLS / "requirements-common.txt", TOOLS / f"requirements-{version}.txt", TOOLS / "setup.py"]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def is_complete(version):
    """True where the environment was set up from these very requirements and its interpreter is still there."""
    stamp = environments.stamp(version)
    return version in environments.ready() and stamp.read_text() == requirements_hash(version)


def make_environment(version, interpreter):
    """An environment with pip at `.venv/<version>`, kept where it already runs."""
    if output_of([environments.python(version), "-m", "pip", "--version"])[0]:
        return
    if not output_of([interpreter, "-c", "import ensurepip"])[0]:
        install_system_packages([f"python{version}-venv"], f"{interpreter} cannot make virtual environments")
    say(f"Python {version}: making .venv/{version} with {interpreter}")
    subprocess.run([interpreter, "-m", "venv", "--clear", str(environments.folder(version))], check=True)


def set_up(version, interpreter):
    """Environment, packages, and a try of both; the stamp comes last."""
    make_environment(version, interpreter)
    environments.stamp(version).unlink(missing_ok=True)
    say(f"Python {version}: installing packages ({environments.BLENDER_BY_PYTHON[version]} alone is about 400 MB)")
    requirements = TOOLS / f"requirements-{version}.txt"
    pip = [environments.python(version), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    installed = subprocess.run(
        [*map(str, pip), "--requirement", str(requirements)], env=environments.process_environment()
    )
    if installed.returncode != 0:
        sys.exit(f"setup: pip could not install {requirements.name}; its message is above. Mend that, then: make setup")
    require(version, "bpy", PROBE_BPY, BPY_PACKAGES)
    require(version, "EGL", PROBE_EGL, EGL_PACKAGES)
    environments.stamp(version).write_text(requirements_hash(version))


def main():
    """Set up every environment that an interpreter is found for; at least one is needed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quiet", action="store_true", help="say nothing about what is already there")
    quiet = parser.parse_args().quiet
    for version, blender in environments.BLENDER_BY_PYTHON.items():
        if is_complete(version):
            if not quiet:
                say(f"Python {version} ({blender}): .venv/{version} is up to date")
            continue
        interpreter = find_interpreter(version)
        if interpreter:
            set_up(version, interpreter)
        elif not quiet:
            say(f"Python {version} ({blender}): not set up, no working python{version} on this machine")
    if not environments.ready():
        sys.exit(
            "setup: neither Python 3.11 nor 3.13 works on this machine, and Blender's package needs one of them.\n"
            "Debian 12: sudo apt-get install python3.11 python3.11-venv\n"
            "Debian 13: sudo apt-get install python3.13 python3.13-venv\n"
            "Elsewhere: pyenv install 3.13. Then run the command again."
        )


if __name__ == "__main__":
    main()
