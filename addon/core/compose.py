"""Scene and settings -> shader text: only the files, and within them only the parts, that this choice needs.

A pass forward-declares what it calls, and a chosen file of the folder for it defines it. Parts of a file stand between
#ifdef FLAG and #endif; they are resolved here, so that what is not needed is not in the text at all.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

SHADERS = Path(__file__).resolve().parents[2] / "shaders"
VERSION = "#version 330 core\n"
UNIFORM = re.compile(r"^uniform (\w+) (\w+);", re.MULTILINE)
HELD = ("float", "int", "vec2", "vec3", "vec4")
COMMON = ("common/types", "common/status", "common/texels", "common/finite", "common/angles", "common/progress")


class ShaderError(RuntimeError):
    """A shader file is missing, or the driver rejected the text; the message names file and line."""


@dataclass(frozen=True)
class Choice:
    """What a program is made of; the key of the program cache.

    main  : the file of passes/ with main()
    files : the chosen files that define what main() calls, e.g. "models/schwarzschild"
    flags : names for #ifdef
    generated : (name, text) of functions that are printed instead of read, e.g. an integrator from its tableau
    """

    main: str
    files: tuple[str, ...] = ()
    flags: frozenset[str] = frozenset()
    generated: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Source:
    """text : the fragment shader; files : its files by the number that #line gives them; outputs : in text order."""

    text: str
    files: tuple[str, ...]
    outputs: tuple[str, ...]

    def explain(self, message: str) -> str:
        """A compiler's message with file names in place of source string numbers ("3:12" -> "models/x.glsl:12")."""

        def name(match: re.Match) -> str:
            number = int(match[1])
            return f"{self.files[number]}.glsl:{match[2]}" if number < len(self.files) else match[0]

        return re.sub(r"\b(\d+)[:(](\d+)\b", name, message)


def compose(choice: Choice) -> Source:
    """The whole text of a choice. Raises ShaderError where a file is missing."""
    files = dict.fromkeys((*COMMON, choice.main, *choice.files))  # each once, whoever asks for it
    texts = [(file, select(read(file), choice.flags, file)) for file in files] + list(choice.generated)
    text = "\n".join(f"#line 1 {number}\n{part}" for number, (_, part) in enumerate(texts))
    outputs = re.findall(r"^out vec4 (\w+);", text, re.MULTILINE)
    return Source(VERSION + with_held_uniforms(text), tuple(name for name, _ in texts), tuple(outputs))


def with_held_uniforms(text: str) -> str:
    """The text with a copy of every uniform, made once before all else; what used the uniform uses the copy.

    Mesa's llvmpipe reads a uniform wherever it stands, in a loop in every round, for one pixel after the other: a tenth
    of a frame's time. A mere copy its compiler would undo; so there is a choice to make, though no pixel is below 0.
    """
    kinds = {name: kind for kind, name in UNIFORM.findall(text) if kind in HELD}
    if not kinds or "void main()" not in text:
        return text
    declared = "".join(f"{kind} held_{name};\n" for name, kind in kinds.items())
    text = re.sub(rf"\b({'|'.join(kinds)})\b", r"held_\1", text)
    text = re.sub(r"^(uniform \w+) held_", r"\1 ", text, flags=re.MULTILINE)
    text = text.replace("void main()", "void main_with_held()")
    copies = (f"    held_{name} = gl_FragCoord.x < 0.0 ? {kind}(0) : {name};\n" for name, kind in kinds.items())
    return f"{declared}{text}\nvoid main() {{\n{''.join(copies)}    main_with_held();\n}}\n"


@cache
def read(file: str) -> str:
    """The text of shaders/<file>.glsl."""
    path = SHADERS / f"{file}.glsl"
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ShaderError(
            f"Shader file '{path}' cannot be read: {error.strerror}. Install the extension again."
        ) from error


def select(text: str, flags: frozenset[str], file: str = "") -> str:
    """The text without the parts whose flag is not set. Line numbers are kept; comments of dropped parts go, too."""
    keep = [True]
    lines = []
    for line in text.splitlines():
        word, _, flag = line.strip().partition(" ")
        if word in ("#ifdef", "#ifndef"):
            keep.append((flag.strip() in flags) == (word == "#ifdef"))
        elif word in ("#else", "#endif") and len(keep) == 1:
            raise ShaderError(f"shaders/{file}.glsl: #ifdef and #endif do not pair up.")
        elif word == "#else":
            keep[-1] = not keep[-1]
        elif word == "#endif":
            keep.pop()
        elif all(keep):
            lines.append(line)
            continue
        lines.append("")
    if len(keep) != 1:
        raise ShaderError(f"shaders/{file}.glsl: #ifdef and #endif do not pair up.")
    return "\n".join(lines) + "\n"
