"""Shaders as a compiler may read them that takes it that no number is NaN: every comparison is turned round, a < b into
!(a >= b), so that those which NaN fails are those which it passes.
"""

import re

OPPOSITE = {"<": ">=", ">": "<=", "<=": ">", ">=": "<"}
COMPARISON = re.compile(r" (<=|>=|<|>) ")
BEFORE = re.compile(r"&&|\|\||[?:;,={}!]|\breturn\b")  # what ends a comparison's left side, seen from the right
AFTER = re.compile(r"&&|\|\||[?:;,]")


def turned_round(text: str) -> str:
    """GLSL without block comments -> the same, for all who hold no NaN."""
    return "\n".join(_line(line) for line in text.split("\n"))


def _line(line: str) -> str:
    code, mark, comment = line.partition("//")
    at = 0
    while match := COMPARISON.search(code, at):
        left, right = _begin(code, match.start()), _end(code, match.end())
        turned = f"!({code[left : match.start()]} {OPPOSITE[match[1]]} {code[match.end() : right]})"
        code = code[:left] + turned + code[right:]
        at = match.end() + 2
    return code + mark + comment


def _begin(code: str, at: int) -> int:
    """Where the left side begins that ends at `at`."""
    depth, begin = 0, at
    while begin:
        depth += {")": 1, "(": -1}.get(code[begin - 1], 0)
        if depth < 0 or (depth == 0 and _ends(code[:begin])):
            break
        begin -= 1
    return begin + len(code[begin:at]) - len(code[begin:at].lstrip())


def _ends(code: str) -> bool:
    return any(match.end() == len(code) for match in BEFORE.finditer(code))


def _end(code: str, at: int) -> int:
    """Where the right side ends that begins at `at`."""
    depth, end = 0, at
    while end < len(code):
        depth += {"(": 1, ")": -1}.get(code[end], 0)
        if depth < 0 or (depth == 0 and AFTER.match(code, end)):
            break
        end += 1
    return end - (len(code[at:end]) - len(code[at:end].rstrip()))
