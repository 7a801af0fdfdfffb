"""What other drivers than the one at hand are promised: OpenGL 3.3's least limits, for every program there can be."""

import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache

import pytest

from addon.core.compose import COMMON, SHADERS, Choice, compose, read, select
from addon.core.device import VERTEX_VERSION
from addon.core.settings import PIPELINES
from tests.core.compositions import PARTS, PICTURES, RAYS, covering, models, programs, request_for

MOST_SAMPLERS = 16  # GL_MAX_TEXTURE_IMAGE_UNITS, of which OpenGL 3.3 guarantees no more; macOS has no more
MOST_OUTPUTS = 8  # GL_MAX_DRAW_BUFFERS
SAMPLER = re.compile(r"^uniform [iu]?sampler\w+ (\w+);", re.MULTILINE)
OUTPUT = re.compile(r"^out vec4 (\w+);", re.MULTILINE)

# Folders whose files' choice needs no look at every other choice, since none of them has a texture.
WITHOUT_TEXTURES = (
    "advances", "borders", "captures", "chords", "integrators", "observers", "step_control", "stepping",
)  # fmt: skip


@cache
def flags_in(file):
    return frozenset(re.findall(r"#ifn?def (\w+)", read(file)))


@cache
def declared(file, flags):
    """Samplers and outputs of a file with these of its flags."""
    text = select(read(file), flags, file)
    return frozenset(SAMPLER.findall(text)), frozenset(OUTPUT.findall(text))


def needs(choice: Choice):
    """Samplers and outputs that a program declares."""
    parts = [declared(file, choice.flags & flags_in(file)) for file in (*COMMON, choice.main, *choice.files)]
    return tuple(frozenset().union(*kind) for kind in zip(*parts, strict=True))


def all_programs(pipeline):
    """Of every model with every scene, for pictures and for rays."""
    for model in models().values():
        for parts in PARTS:
            if parts[4] == "one sky" or model.has_far_side:
                for outputs in (*PICTURES, *(RAYS if parts[-3:] == ("one sky", False, 1) else ())):
                    yield from programs(request_for(model, pipeline, parts, outputs))


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_no_program_has_more_textures_or_outputs_than_every_driver_allows(pipeline):
    found = {}
    for choice in all_programs(pipeline):
        found.setdefault(needs(choice), choice)
    fullest = max(found, key=lambda need: len(need[0]))
    assert 12 <= len(fullest[0]) <= MOST_SAMPLERS, sorted(fullest[0])
    assert max(len(outputs) for _, outputs in found) <= MOST_OUTPUTS
    for (samplers, outputs), choice in found.items():  # the short cut counts what is in the text
        text = compose(choice).text
        assert (set(SAMPLER.findall(text)), set(OUTPUT.findall(text))) == (samplers, outputs)


def test_the_other_choices_have_no_textures():
    files = [path for folder in WITHOUT_TEXTURES for path in (SHADERS / folder).glob("*.glsl")]
    files += [SHADERS / "camera" / f"{kind}.glsl" for kind in ("perspective", "orthographic")]
    assert len(files) > 20
    for path in files:
        assert "sampler" not in path.read_text(encoding="utf-8"), path.name


@pytest.fixture(scope="module")
def glslang():
    """The path of the Khronos group's own compiler."""
    path = shutil.which("glslangValidator")
    if path is None:
        pytest.skip("glslangValidator is not installed. Debian, Ubuntu: sudo apt-get install glslang-tools")
    return path


def rejected(sources, glslang, folder):
    """The compiler's first complaint about one of the programs, with the names of files; None where there is none."""
    names = {}
    for number, source in enumerate(sources):
        path = folder / f"{number}.frag"
        path.write_text(source.text, encoding="utf-8")
        names[path.name] = source
    vertices = folder / "quad.vert"
    vertices.write_text(VERTEX_VERSION + (SHADERS / "passes/quad.vert").read_text(encoding="utf-8"), encoding="utf-8")
    done = subprocess.run([glslang, "-t", vertices.name, *names], cwd=folder, capture_output=True, text=True)
    latest = None
    for line in done.stdout.splitlines():  # each program's name, and what is wrong with it
        latest = names.get(line, latest)
        if line.startswith("ERROR"):
            return latest.explain(line) if latest else line
    return None if done.returncode == 0 else done.stdout + done.stderr


def test_the_programs_to_compile_have_every_file_and_every_flag():
    choices = [choice for pipeline in PIPELINES for choice in covering(pipeline)]
    files = {str(path.relative_to(SHADERS).with_suffix("")) for path in SHADERS.rglob("*.glsl")}
    assert files == {file for choice in choices for file in (*COMMON, choice.main, *choice.files)}
    assert {flag for file in files for flag in flags_in(file)} <= {flag for choice in choices for flag in choice.flags}


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_the_programs_are_glsl_330(pipeline, glslang, tmp_path):
    """Every model with every method, and all else in turn, by the rules and not by what one driver lets pass."""
    sources = [compose(choice) for choice in covering(pipeline)]
    assert len(sources) > 1000 and all(source.text.startswith("#version 330 core\n") for source in sources)
    assert rejected(sources, glslang, tmp_path) is None


def test_what_is_no_glsl_330_is_found(glslang, tmp_path):
    """% of a float, which some drivers let pass, in the second of three programs."""
    sources = [compose(Choice("passes/sky", ("environment/constant",))) for _ in range(3)]
    sources[1] = replace(sources[1], text=sources[1].text.replace("vec4(held_u_sky_color, 1.0)", "vec4(1.0 % 2)"))
    assert re.search(r"environment/constant\.glsl:6: '%' ", rejected(sources, glslang, tmp_path))
