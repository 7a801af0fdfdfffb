"""Shader text: only what a choice needs, errors that name file and line."""

import itertools
import re

import pytest

from addon.core import compose as composing
from addon.core.compose import COMMON, HELD, SHADERS, Choice, ShaderError, Source, compose, select

TEXT = """first
#ifdef A
a
#ifdef B
ab
#else
a not b
#endif
#endif
#ifndef A
not a
#endif
last"""

FLAGGED = sorted(path for path in SHADERS.rglob("*.glsl") if "#if" in path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("flags", "kept"),
    [
        ("", ["first", "not a", "last"]),
        ("A", ["first", "a", "a not b", "last"]),
        ("B", ["first", "not a", "last"]),
        ("AB", ["first", "a", "ab", "last"]),
    ],
)
def test_parts_stay_or_go_with_their_flag(flags, kept):
    selected = select(TEXT, frozenset(flags))
    assert [line for line in selected.splitlines() if line] == kept


@pytest.mark.parametrize("flags", ["", "A", "B", "AB"])
def test_lines_keep_their_numbers(flags):
    lines = select(TEXT, frozenset(flags)).splitlines()
    assert len(lines) == len(TEXT.splitlines())
    for number, line in enumerate(TEXT.splitlines()):
        assert lines[number] in ("", line)


@pytest.mark.parametrize(
    "text",
    ["#ifdef A\na", "a\n#endif", "#endif\n#ifdef A", "#endif\n#endif", "#else\na", "#ifdef A\n#endif\n#else\n#endif"],
)
def test_unbalanced_parts_name_the_file(text):
    with pytest.raises(ShaderError, match=r"shaders/models/broken\.glsl: #ifdef and #endif do not pair up"):
        select(text, frozenset("A"), "models/broken")


@pytest.mark.parametrize("path", FLAGGED, ids=lambda path: path.stem)
def test_every_shader_drops_its_parts(path):
    """Real files: with any set of flags no preprocessor line of ours is left for the driver."""
    file = str(path.relative_to(SHADERS).with_suffix(""))
    text = path.read_text(encoding="utf-8")
    flags = sorted(set(re.findall(r"#ifn?def (\w+)", text)))
    assert flags
    lengths = set()
    sizes = {0, 1, 2, len(flags) - 1, len(flags)}  # none, each, pairs, all but one, all
    for chosen in itertools.chain.from_iterable(itertools.combinations(flags, n) for n in sizes):
        selected = select(text, frozenset(chosen), file)
        assert not re.search(r"^\s*#\s*(if|else|endif)", selected, re.MULTILINE)
        lengths.add(len(selected))
    assert len(lengths) > 1, "the flags change nothing"


def without_copies(text):
    """As the files have it: what uses a uniform's copy uses the uniform."""
    return text.replace("held_u_", "u_")


def test_only_the_chosen_files_are_in_the_text():
    source = compose(Choice("passes/integrate", ("integrators/euler", "models/schwarzschild")))
    assert source.files == (*COMMON, "passes/integrate", "integrators/euler", "models/schwarzschild")
    assert source.text.startswith("#version 330 core\n")
    assert source.outputs == ("out_x", "out_v")
    for file in source.files:
        assert (SHADERS / f"{file}.glsl").read_text(encoding="utf-8").splitlines()[0] in without_copies(source.text)
    assert "straight rays" not in source.text


def test_outputs_follow_the_flags():
    def outputs(*flags):
        return compose(Choice("passes/terminate", ("models/straight", "common/bounds"), frozenset(flags))).outputs

    assert outputs() == ("out_x", "out_v")
    assert outputs("GEOMETRY", "COLOR") == ("out_x", "out_v", "out_color")
    assert outputs("GEOMETRY", "COLOR", "TALLY") == ("out_x", "out_v", "out_color", "out_tally")


def test_missing_file_is_named():
    with pytest.raises(ShaderError, match=r"models/nowhere\.glsl' cannot be read: .*\. Install the extension again"):
        compose(Choice("passes/integrate", ("models/nowhere",)))


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        ("Mesa", "{n}:12(5): error: `foo' undeclared"),
        ("AMD, Apple", "ERROR: {n}:12: 'foo' : undeclared identifier"),
        ("NVIDIA", '{n}(12) : error C1503: undefined variable "foo"'),
    ],
)
def test_driver_messages_are_mapped_to_files(driver, message):
    source = compose(Choice("passes/integrate", ("integrators/euler", "models/straight")))
    number = source.files.index("models/straight")
    explained = source.explain(message.format(n=number))
    assert "models/straight.glsl:12" in explained and "foo" in explained


def test_numbers_that_are_no_file_are_left_alone():
    assert Source("", ("passes/sky",), ()).explain("17:12: unknown") == "17:12: unknown"


def test_line_numbers_in_the_text_are_those_of_the_files():
    """What #line says is where the line is: the n-th line after it is the n-th line of that file."""
    source = compose(Choice("passes/sky", ("environment/cube", "models/straight"), frozenset({"GEOMETRY"})))
    parts = re.split(r"^#line 1 (\d+)\n", source.text, flags=re.MULTILINE)[1:]
    for number, text in zip(parts[::2], parts[1::2], strict=True):
        original = (SHADERS / f"{source.files[int(number)]}.glsl").read_text(encoding="utf-8").splitlines()
        for written, line in zip(without_copies(text).splitlines(), original, strict=False):
            assert written in ("", line) or line.startswith("void main")


def test_uniforms_are_read_once():
    """Where they are declared, and where main() copies them; samplers and matrices stay what they are."""
    source = compose(Choice("passes/sky", ("environment/cube", "models/schwarzschild")))
    declared = re.findall(r"^uniform (\w+) (\w+);", source.text, re.MULTILINE)
    assert {"float", "mat3", "samplerCube"} <= {kind for kind, _ in declared}
    for kind, name in declared:
        if kind in HELD:
            assert len(re.findall(rf"\b{name}\b", source.text)) == 2 < len(re.findall(rf"\bheld_{name}\b", source.text))
        else:
            assert f"held_{name}" not in source.text


def test_files_are_read_once():
    composing.read.cache_clear()
    compose(Choice("passes/sky", ("environment/cube", "models/straight")))
    misses = composing.read.cache_info().misses
    compose(Choice("passes/sky", ("environment/cube", "models/straight"), frozenset({"GEOMETRY"})))
    assert composing.read.cache_info().misses == misses


@pytest.mark.parametrize("path", sorted(SHADERS.rglob("*.glsl")), ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_shader_file_begins_with_what_it_is_for(path):
    assert path.read_text(encoding="utf-8").startswith("// ")
