"""Build the extension's zips, one a platform, with Blender's own tool, and validate each: `make package`.

blender_manifest.toml lists the wheels; this downloads those that are not in wheels/ yet.
"""

import subprocess
import sys
import tomllib

import environments

WHEELS = environments.REPOSITORY / "wheels"
DIST = environments.REPOSITORY / "dist"


def script(path):
    """A script inside the bpy package of the newest environment."""
    packages = environments.folder(environments.newest()) / "lib"
    found = list(packages.glob(f"python*/site-packages/bpy/*/scripts/{path}"))
    if not found:
        sys.exit(f"No {path} below {packages}: the bpy package is not whole. Run: make distclean setup")
    return found[0]


def download(filename):
    """Download one wheel by its exact name: distribution-version-python-abi-platform[.platform…].whl"""
    name, version, python_tag, abi, platforms = filename.removesuffix(".whl").split("-")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--only-binary=:all:", "--implementation=cp", f"--abi={abi}", f"--dest={WHEELS}"]
    command += [f"--python-version={python_tag.removeprefix('cp')}"]
    command += [f"--platform={platform}" for platform in platforms.split(".")]
    done = subprocess.run([*command, f"{name}=={version}"])
    if done.returncode != 0 or not (WHEELS / filename).exists():
        sys.exit(f"{filename} could not be downloaded. Go online, or list a wheel that exists in the manifest.")


def download_missing(manifest):
    """Fill wheels/ with what the manifest lists."""
    WHEELS.mkdir(exist_ok=True)
    listed = [path.removeprefix("./wheels/") for path in manifest["wheels"]]
    missing = [filename for filename in listed if not (WHEELS / filename).exists()]
    print(f"{len(listed)} wheels listed, {len(missing)} to download.", flush=True)
    for filename in missing:
        print(f"  {filename}", flush=True)
        download(filename)


def run_tool(action, *arguments):
    """Run Blender's command line for extensions quietly; its output is shown where it fails."""
    command = [sys.executable, script("addons_core/bl_pkg/cli/blender_ext.py"), action]
    command += ["--valid-tags", script("modules/_bpy_internal/extensions/tags.py"), *arguments]
    done = subprocess.run(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(f"{done.stdout}Blender's extension tool refused to {action}. Mend what it names above.")


def main():
    """Download, build, validate, and print each zip with its size."""
    with open(environments.REPOSITORY / "blender_manifest.toml", "rb") as file:
        manifest = tomllib.load(file)
    download_missing(manifest)

    DIST.mkdir(exist_ok=True)
    stem = f"{manifest['id']}-{manifest['version']}"
    for old in DIST.glob(f"{stem}-*.zip"):
        old.unlink()
    run_tool("build", "--split-platforms", "--source-dir", environments.REPOSITORY, "--output-dir", DIST)

    for platform in manifest["platforms"]:
        archive = DIST / f"{stem}-{platform.replace('-', '_')}.zip"
        run_tool("validate", archive)
        size = archive.stat().st_size
        print(f"{archive.relative_to(environments.REPOSITORY)}  {size / 1e6:.2f} MB ({size} bytes), valid")


if __name__ == "__main__":
    main()
