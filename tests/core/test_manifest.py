"""The extension's manifest: what Blender's extension platform asks for, and a wheel for everyone."""

import tomllib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PLATFORM_TAGS = {"linux-x64": "manylinux", "windows-x64": "win_amd64", "macos-arm64": "arm64", "macos-x64": "macosx_10"}
MODULES = ("moderngl", "glcontext", "openexr")

# (platform, Python): official Blender everywhere, distributions' Blender on Linux.
NEEDED = [(platform, python) for platform in PLATFORM_TAGS for python in ("cp311", "cp313")] + [("linux-x64", "cp314")]


@pytest.fixture(scope="module")
def manifest():
    """The manifest as a dictionary."""
    return tomllib.loads((REPOSITORY / "blender_manifest.toml").read_text(encoding="utf-8"))


def wheels_for(manifest, platform, python):
    """Names of the listed wheels for one platform and one Python."""
    names = [path.removeprefix("./wheels/") for path in manifest["wheels"]]
    return [name for name in names if PLATFORM_TAGS[platform] in name and f"-{python}-{python}-" in name]


@pytest.mark.parametrize(("platform", "python"), NEEDED)
def test_every_module_has_one_wheel(manifest, platform, python):
    found = sorted(name.split("-")[0] for name in wheels_for(manifest, platform, python))
    assert found == sorted(MODULES)


def test_no_wheel_is_for_anything_else(manifest):
    needed = {name for platform, python in NEEDED for name in wheels_for(manifest, platform, python)}
    assert {path.removeprefix("./wheels/") for path in manifest["wheels"]} == needed


def test_platforms_are_those_with_wheels(manifest):
    assert sorted(manifest["platforms"]) == sorted(PLATFORM_TAGS)


def test_short_texts_keep_the_platform_rules(manifest):
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(text) <= 64 and text[-1].isalnum(), text


def test_identity(manifest):
    assert (manifest["schema_version"], manifest["id"]) == ("1.0.0", "nonlinear_rays")
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "4.5.0"


def test_linux_wheels_are_the_versions_tested_here(manifest):
    """What the tests run with is what users get: the manifest and tools/requirements-common.txt agree."""
    lines = (REPOSITORY / "tools" / "requirements-common.txt").read_text(encoding="utf-8").lower().splitlines()
    pinned = dict(line.split("==") for line in lines if "==" in line)
    for python in ("cp311", "cp313", "cp314"):
        for name, version, *_ in (wheel.split("-") for wheel in wheels_for(manifest, "linux-x64", python)):
            assert version == pinned[name], f"{name} {version} in the manifest, {pinned[name]} in the requirements"
