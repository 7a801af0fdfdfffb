"""Formulas that a user types: parsed against a small grammar, printed as GLSL, evaluated with numpy, differentiated.

    sum      = product { ("+" | "-") product }
    product  = sign { ("*" | "/") sign }
    sign     = ("-" | "+") sign | power
    power    = atom [ ("^" | "**") sign ]              to the right: 2^3^2 is 2^9, -x^2 is -(x^2)
    atom     = number | name | function "(" sum { "," sum } ")" | "(" sum ")"

A formula comes from a stranger's .blend, so that nothing in it is ever executed, and length, nesting and size are
limited: whatever the text is, parse() answers with an Expression or an ExpressionError, and soon.

Whoever puts Expression.glsl() into a shader adds GLSL_FILE to its files: it has the functions that GLSL lacks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

GLSL_FILE = "common/formulas"
LONGEST = 1000  # characters
DEEPEST = 60  # operations within each other, as typed; what follows from it may be DEEPEST_DERIVED deep
DEEPEST_DERIVED = 250
LARGEST_DERIVED = 5000  # numbers, names and operations
LARGEST_NUMBER = 3.4e38  # float32
CONSTANTS = {"pi": math.pi, "e": math.e}


class ExpressionError(ValueError):
    """A formula cannot be used. column : counted from 1; pointed : the formula with a mark below the column."""

    def __init__(self, problem: str, column: int, text: str = ""):
        super().__init__(f"column {column}: {problem}")
        self.column = column
        self.pointed = f"{text}\n{' ' * (column - 1)}^"


@dataclass(frozen=True)
class Function:
    """numpy : float64 arrays -> array;  glsl : a name in GLSL, or a form with {} for arguments;
    partials : the derivative by each argument, as a formula in a, b, c.
    """

    numpy: Callable
    glsl: str
    partials: tuple[str, ...]

    @property
    def arity(self) -> int:
        return len(self.partials)


def _step(edge, x):
    return np.where(np.isnan(edge) | np.isnan(x), np.nan, np.where(x < edge, 0.0, 1.0))


OPERATORS = {
    "+": Function(np.add, "({} + {})", ("1", "1")),
    "-": Function(np.subtract, "({} - {})", ("1", "-1")),
    "*": Function(np.multiply, "({} * {})", ("b", "a")),
    "/": Function(np.divide, "({} / {})", ("1 / b", "-a / b^2")),
    "^": Function(np.power, "formula_power({}, {})", ("b * a^(b - 1)", "a^b * log(a)")),
    "negative": Function(np.negative, "(-{})", ("-1",)),
}
FUNCTIONS = {
    "sin": Function(np.sin, "sin", ("cos(a)",)),
    "cos": Function(np.cos, "cos", ("-sin(a)",)),
    "tan": Function(np.tan, "tan", ("1 + tan(a)^2",)),
    "asin": Function(np.arcsin, "formula_asin", ("1 / sqrt(1 - a^2)",)),
    "acos": Function(np.arccos, "formula_acos", ("-1 / sqrt(1 - a^2)",)),
    "atan": Function(np.arctan, "atan", ("1 / (1 + a^2)",)),
    "atan2": Function(np.arctan2, "atan", ("b / (a^2 + b^2)", "-a / (a^2 + b^2)")),
    "sinh": Function(np.sinh, "sinh", ("cosh(a)",)),
    "cosh": Function(np.cosh, "cosh", ("sinh(a)",)),
    "tanh": Function(np.tanh, "formula_tanh", ("1 - tanh(a)^2",)),
    "exp": Function(np.exp, "exp", ("exp(a)",)),
    "log": Function(np.log, "log", ("1 / a",)),
    "sqrt": Function(np.sqrt, "sqrt", ("0.5 / sqrt(a)",)),
    "abs": Function(np.abs, "abs", ("sign(a)",)),
    "sign": Function(np.sign, "sign", ("0",)),
    "floor": Function(np.floor, "floor", ("0",)),
    "min": Function(np.minimum, "min", ("step(a, b)", "1 - step(a, b)")),
    "max": Function(np.maximum, "max", ("step(b, a)", "1 - step(b, a)")),
    "step": Function(_step, "step", ("0", "0")),
    "clamp": Function(
        lambda x, low, high: np.minimum(np.maximum(x, low), high),
        "clamp",
        ("step(b, a) * step(a, c)", "(1 - step(b, a)) * step(b, c)", "1 - step(max(a, b), c)"),
    ),
}
ALIASES = {"pow": "^"}
JUMPS = ("step", "sign", "floor")
OPERATIONS = OPERATORS | FUNCTIONS


@dataclass(frozen=True)
class Expression:
    """A tree. head : "number", "name" or a key of OPERATIONS;  arguments : of an operation."""

    head: str
    arguments: tuple[Expression, ...] = ()
    value: float = 0.0
    name: str = ""
    size: int = field(default=1, init=False, compare=False, repr=False)
    depth: int = field(default=1, init=False, compare=False, repr=False)

    def __post_init__(self):
        if self.arguments:
            object.__setattr__(self, "size", 1 + sum([part.size for part in self.arguments]))
            object.__setattr__(self, "depth", 1 + max([part.depth for part in self.arguments]))

    @property
    def names(self) -> frozenset[str]:
        """Every variable and parameter in it."""
        if self.head == "name":
            return frozenset((self.name,))
        return frozenset().union(*[part.names for part in self.arguments])

    def __str__(self) -> str:
        """A formula again: parse() makes the same tree of it."""
        if self.head == "number":
            return repr(self.value) if self.value >= 0 else f"({self.value!r})"
        if self.head == "name":
            return self.name
        parts = [str(part) for part in self.arguments]
        if self.head == "negative":
            return f"(-{parts[0]})"
        if self.head in OPERATORS:
            return f"({parts[0]} {self.head} {parts[1]})"
        return f"{self.head}({', '.join(parts)})"

    def glsl(self, rename: Mapping[str, str] | Callable[[str], str] = lambda name: name) -> str:
        """A float expression of GLSL. rename : what stands for a name; names that a mapping lacks stay.

        Its functions are in the shader file GLSL_FILE.
        """
        if self.head == "number":
            return _literal(self.value)
        if self.head == "name":
            return rename(self.name) if callable(rename) else rename.get(self.name, self.name)
        parts = [part.glsl(rename) for part in self.arguments]
        exponent = self.arguments[-1]
        if self.head == "^" and exponent.head == "number" and _is_small_whole(exponent.value):
            return f"formula_power({parts[0]}, {int(exponent.value)})"  # the one that multiplies
        form = OPERATIONS[self.head].glsl
        return form.format(*parts) if "{}" in form else f"{form}({', '.join(parts)})"

    def numpy(self, values: Mapping[str, np.ndarray | float]) -> np.ndarray:
        """float64, of the values' common shape. What has no value there is NaN or infinite, without a warning."""
        arrays = {name: np.asarray(value, np.float64) for name, value in values.items()}
        with np.errstate(all="ignore"):
            result = self._numpy(arrays)
        return np.array(np.broadcast_to(result, np.broadcast_shapes(*[array.shape for array in arrays.values()])))

    def _numpy(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        if self.head == "number":
            return np.float64(self.value)
        if self.head == "name":
            return values[self.name]
        return OPERATIONS[self.head].numpy(*[part._numpy(values) for part in self.arguments])

    def derivative(self, name: str) -> Expression:
        """By this name, simplified; jumps (floor, sign, step) count as flat. Raises ExpressionError where it is too
        long for a shader.
        """
        found = self._derivative(name)
        if found.size > LARGEST_DERIVED or found.depth > DEEPEST_DERIVED:
            raise ExpressionError(f"the derivative by '{name}' is too long. Shorten the formula.", 1, str(self))
        return found

    def _derivative(self, name: str) -> Expression:
        if not self.arguments:
            return ONE if self.head == "name" and self.name == name else ZERO
        total = ZERO
        inner = dict(zip("abc", self.arguments, strict=False))
        for argument, partial in zip(self.arguments, _partials(self.head), strict=True):
            change = argument._derivative(name)
            if change != ZERO:
                total = simplified("+", total, simplified("*", partial.replaced(inner), change))
        return total

    def jumps(self) -> tuple[Expression, ...]:
        """Its parts that jump (step, sign, floor), each once, the inner ones before those that they are in."""
        inner = dict.fromkeys(jump for part in self.arguments for jump in part.jumps())
        return (*inner, *((self,) if self.head in JUMPS and self not in inner else ()))

    def with_parts(self, parts: Mapping[Expression, Expression]) -> Expression:
        """With other expressions instead of some of its parts."""
        if self in parts:
            return parts[self]
        if not self.arguments:
            return self
        return simplified(self.head, *[part.with_parts(parts) for part in self.arguments])

    def replaced(self, expressions: Mapping[str, Expression]) -> Expression:
        """With expressions instead of names."""
        if self.head == "name":
            return expressions.get(self.name, self)
        if not self.arguments:
            return self
        return simplified(self.head, *[part.replaced(expressions) for part in self.arguments])


def named(name: str) -> Expression:
    return Expression("name", name=name)


def number(value: float) -> Expression:
    return Expression("number", value=float(value))


ZERO, ONE = number(0.0), number(1.0)


def simplified(head: str, *arguments: Expression) -> Expression:
    """An operation, with what is known carried out: 0 + x, 1 * x, 2 * 3, -(-x)."""
    first, last = arguments[0], arguments[-1]
    if all([part.head == "number" for part in arguments]):
        with np.errstate(all="ignore"):
            value = float(OPERATIONS[head].numpy(*[np.float64(part.value) for part in arguments]))
        if abs(value) < LARGEST_NUMBER:  # false for NaN, too
            return number(value)
    if head == "+" and ZERO in arguments:
        return last if first == ZERO else first
    if head == "-" and last == ZERO:
        return first
    if head == "-" and first == ZERO:
        return simplified("negative", last)
    if head == "*" and ZERO in arguments:
        return ZERO
    if head == "*" and ONE in arguments:
        return last if first == ONE else first
    if head == "*" and number(-1.0) in arguments:
        return simplified("negative", last if first == number(-1.0) else first)
    if head == "/" and first == ZERO and last != ZERO:
        return ZERO
    if head in ("/", "^") and last == ONE:
        return first
    if head == "^" and last == ZERO:
        return ONE
    if head == "negative" and first.head == "negative":
        return first.arguments[0]
    return Expression(head, arguments)


@cache
def _partials(head: str) -> tuple[Expression, ...]:
    return tuple(parse(text, "abc") for text in OPERATIONS[head].partials)


def _is_small_whole(value: float) -> bool:
    return abs(value) < 64 and value == int(value)  # as many bits as formula_power() has


def _literal(value: float) -> str:
    """A float literal of GLSL: with a dot, in parentheses where it is negative."""
    mantissa, mark, exponent = f"{value:.9g}".partition("e")  # 9 digits are float32's
    text = (mantissa if "." in mantissa else f"{mantissa}.0") + mark + exponent
    return f"({text})" if text.startswith("-") else text


# Parsing

TOKEN = re.compile(
    r"(?P<space>[ \t\r\n]+)|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<mark>\*\*|[-+*/^(),])"
)
BINDING = {"+": 10, "-": 10, "*": 20, "/": 20, "^": 40}  # the tighter, the larger
SIGN_BINDING = 30


@dataclass(frozen=True)
class Token:
    kind: str  # "number", "name", "mark" or "end"
    text: str
    column: int


def parse(text: str, names: Iterable[str]) -> Expression:
    """The tree of a formula. names : of its variables and parameters; they come before constants of the same name.

    Raises ExpressionError, which names the column.
    """
    return _Parser(text, tuple(names)).parse()


class _Parser:
    """Pratt 1973: every operator binds with a strength."""

    def __init__(self, text: str, names: tuple[str, ...]):
        if not isinstance(text, str):
            raise ExpressionError("a formula must be a text. Type one.", 1)
        self.text, self.names = text, names
        self.tokens = self._tokens()
        self.next = 0
        self.nesting = 0

    def parse(self) -> Expression:
        tree = self._sum()
        if self._token.kind != "end":
            raise self._error(f"an operator or the end is needed before '{self._token.text}'. Write 2*x for 2x.")
        return tree

    def _tokens(self) -> list[Token]:
        if len(self.text) > LONGEST:
            raise self._error(f"the formula has {len(self.text)} characters, but {LONGEST} are allowed. Shorten it.", 1)
        tokens, at = [], 0
        while at < len(self.text):
            match = TOKEN.match(self.text, at)
            if match is None:
                raise self._error(f"the character {self.text[at]!r} has no meaning here. Remove it.", at + 1)
            if match.lastgroup != "space":
                word = "^" if match[0] == "**" else match[0]
                tokens.append(Token(match.lastgroup, word, at + 1))
            at = match.end()
        return [*tokens, Token("end", "the end", len(self.text) + 1)]

    @property
    def _token(self) -> Token:
        return self.tokens[self.next]

    def _error(self, problem: str, column: int | None = None) -> ExpressionError:
        return ExpressionError(problem, self._token.column if column is None else column, self.text)

    def _take(self) -> Token:
        token = self._token
        if token.kind != "end":
            self.next += 1
        return token

    def _expect(self, mark: str, why: str) -> None:
        if self._token.text != mark:
            raise self._error(f"'{mark}' is needed before {_shown(self._token)}: {why}.")
        self._take()

    def _made(self, column: int, head: str, *arguments: Expression) -> Expression:
        if head == "negative" and arguments[0].head == "number":
            return number(-arguments[0].value)
        tree = Expression(head, arguments)
        if tree.depth > DEEPEST:
            raise self._error(f"more than {DEEPEST} operations within each other. Shorten the formula.", column)
        return tree

    def _sum(self, binding: int = 0) -> Expression:
        """Everything that binds more strongly than `binding`."""
        self.nesting += 1
        if self.nesting > DEEPEST:
            raise self._error(f"more than {DEEPEST} operations within each other. Shorten the formula.")
        left = self._prefix()
        while BINDING.get(self._token.text, 0) > binding:
            token = self._take()
            # To the right of ^ a sign may stand, and another ^ comes first.
            right = self._sum(SIGN_BINDING - 1 if token.text == "^" else BINDING[token.text])
            left = self._made(token.column, token.text, left, right)
        self.nesting -= 1
        return left

    def _prefix(self) -> Expression:
        token = self._take()
        if token.kind == "number":
            value = float(token.text)
            if value > LARGEST_NUMBER:
                raise self._error(f"{token.text} is larger than {LARGEST_NUMBER:g}. Lower it.", token.column)
            return number(value)
        if token.kind == "name":
            return self._named(token)
        if token.text == "-":
            return self._made(token.column, "negative", self._sum(SIGN_BINDING))
        if token.text == "+":
            return self._sum(SIGN_BINDING)
        if token.text == "(":
            inside = self._sum()
            self._expect(")", f"the parenthesis of column {token.column} is open")
            return inside
        raise self._error(f"a number, a name or '(' is needed, not {_shown(token)}. Complete it.", token.column)

    def _named(self, token: Token) -> Expression:
        if token.text in self.names:
            return Expression("name", name=token.text)
        if token.text in CONSTANTS:
            return number(CONSTANTS[token.text])
        head = ALIASES.get(token.text, token.text)
        if head not in FUNCTIONS and token.text not in ALIASES:
            raise self._error(f"unknown name '{token.text[:40]}'. Known: {self._known()}.", token.column)
        self._expect("(", f"'{token.text}' is a function")
        arguments = [self._sum()]
        while self._token.text == ",":
            self._take()
            arguments.append(self._sum())
        self._expect(")", f"the values of '{token.text}' are open")
        arity = OPERATIONS[head].arity
        if len(arguments) != arity:
            problem = f"'{token.text}' takes {arity} {'value' if arity == 1 else 'values'}, not {len(arguments)}"
            raise self._error(f"{problem}. Separate them by commas.", token.column)
        return self._made(token.column, head, *arguments)

    def _known(self) -> str:
        return ", ".join([*self.names, *CONSTANTS, *FUNCTIONS, *ALIASES])


def _shown(token: Token) -> str:
    return token.text if token.kind == "end" else f"'{token.text[:40]}'"
