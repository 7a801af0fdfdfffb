"""Typed formulas: what they mean, that they are the same after printing, their derivatives, and what they refuse."""

import math
import re
import time

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from addon.core.expressions import (
    CONSTANTS,
    DEEPEST,
    FUNCTIONS,
    LONGEST,
    OPERATIONS,
    Expression,
    ExpressionError,
    number,
    parse,
)

NAMES = ("x", "y", "r", "k")

PYTHON = {  # every operation in Python's own floats
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": lambda a, b: a**b,
    "negative": lambda a: -a,
    "sign": lambda a: math.copysign(1.0, a) if a else 0.0,
    "abs": abs,
    "floor": lambda a: float(math.floor(a)),
    "min": min,
    "max": max,
    "step": lambda edge, a: 0.0 if a < edge else 1.0,
    "clamp": lambda a, low, high: min(max(a, low), high),
}


def python_value(tree, values):
    """Evaluated by the math module. Raises ArithmeticError or ValueError where there is no real number."""
    if tree.head == "number":
        return tree.value
    if tree.head == "name":
        return values[tree.name]
    operation = PYTHON.get(tree.head) or getattr(math, tree.head)
    result = operation(*[python_value(part, values) for part in tree.arguments])
    if isinstance(result, complex):
        raise ValueError("no real number")
    return result


def trees(names=NAMES, heads=tuple(OPERATIONS), leaves=12):
    """Any tree that parse() can make: a minus before a number belongs to the number."""
    numbers = st.floats(-1e6, 1e6, allow_subnormal=False).map(number)
    named = st.sampled_from(names).map(lambda name: Expression("name", name=name))

    def combined(children):
        def operation(head):
            arguments = [children] * OPERATIONS[head].arity
            return st.tuples(*arguments).map(lambda parts: Expression(head, parts))

        made = st.sampled_from(heads).flatmap(operation)
        return made.filter(lambda tree: tree.head != "negative" or tree.arguments[0].head != "number")

    return st.recursive(numbers | named, combined, max_leaves=leaves)


points = st.fixed_dictionaries({name: st.floats(-10, 10, allow_subnormal=False) for name in NAMES})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3", 7),
        ("2 ^ 3 ^ 2", 512),
        ("2 ** 3 ** 2", 512),
        ("-2 ^ 2", -4),
        ("(-2) ^ 2", 4),
        ("2 ^ -2", 0.25),
        ("-x ^ 2", -9),
        ("1 - 2 - 3", -4),
        ("12 / 3 / 2", 2),
        ("2 * -x", -6),
        ("--x", 3),
        ("+x - +x", 0),
        (".5 + 1. + 1e-1 + 2.5E+0", 4.1),
        ("\tx\n", 3),
        ("pow(2, x)", 8),
        ("cos(pi)", -1),
        ("log(e)", 1),
        ("atan2(1, -1)", 0.75 * math.pi),
        ("clamp(x, 0, 1) + clamp(-x, 0, 1) + clamp(0.5, 0, 1)", 1.5),
        ("step(3, x) + step(3.1, x)", 1),
        ("min(x, 2) + max(x, 2)", 5),
        ("sign(-x) + sign(0) + abs(-x) + floor(-0.5)", 1),
    ],
)
def test_meaning(text, value):
    assert parse(text, ["x"]).numpy({"x": 3.0}) == pytest.approx(value, abs=1e-15)


@given(trees(), points)
def test_numpy_agrees_with_pythons_floats(tree, values):
    """The same operations in the same order: numpy's functions may differ from the C library's by a few ulp, which a
    formula magnifies. A second evaluation, a part in 1e13 beside, says by how much.
    """
    try:
        expected = python_value(tree, values)
        beside = python_value(tree, {name: value * (1 + 1e-13) for name, value in values.items()})
    except (ArithmeticError, ValueError):
        return
    found = tree.numpy(values)
    assert found.shape == () and found.dtype == np.float64
    assume(math.isfinite(expected) and math.isfinite(beside))
    assume(abs(beside - expected) <= 1e-9 * abs(expected))  # no jump here, and well conditioned
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_arrays_keep_their_shape_and_bad_points_are_silent():
    grid = np.linspace(-1, 1, 6).reshape(2, 3)
    with np.errstate(all="raise"):
        assert parse("sqrt(x) + 1/(x - x)", ["x"]).numpy({"x": grid}).shape == (2, 3)
        assert parse("7", ["x"]).numpy({"x": grid}).shape == (2, 3)
    assert parse("x + y", "xy").numpy({"x": grid, "y": 1.0}) == pytest.approx(grid + 1)


@given(trees())
def test_printed_trees_parse_to_themselves(tree):
    assert parse(str(tree), NAMES) == tree


@given(trees())
def test_names_are_those_of_the_text(tree):
    assert tree.names == set(re.findall(r"[a-z]\w*", str(tree))).intersection(NAMES)


@pytest.mark.parametrize("head", OPERATIONS)
@pytest.mark.parametrize("at", [0.3, 0.7, 1.7, -0.4])
def test_derivative_of_every_operation(head, at):
    """Central differences with h = 1e-6: their error is h^2 f'''/6 + eps f/h, below 1e-8 for values of about 1."""
    inner = ("x * y + 0.2", "x^2 + 0.1", "0.5 + 0.1 * x")[: OPERATIONS[head].arity]
    tree = Expression(head, tuple(parse(text, "xy") for text in inner))
    values = {"x": np.array([at - 1e-6, at, at + 1e-6]), "y": 0.9}
    left, _, right = tree.numpy(values)
    expected = (right - left) / 2e-6
    found = tree.derivative("x").numpy(values)[1]
    if math.isnan(expected):  # outside of the function's domain; the derivative may be defined there (log), or not
        return
    assert found == pytest.approx(expected, rel=1e-7, abs=1e-7)


@settings(max_examples=200)
@given(trees(names=("x", "y"), leaves=8), points)
def test_derivatives_agree_with_differences(tree, values):
    """Richardson's two central differences; where they disagree the formula jumps or is steep, and nothing is said."""
    steps = 1e-3 * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    f = tree.numpy({"x": values["x"] + steps, "y": values["y"]})
    assume(np.isfinite(f).all() and np.abs(f).max() < 1e6)
    narrow, wide = (f[3] - f[1]) / 2e-3, (f[4] - f[0]) / 4e-3
    one_sided = (f[3] - f[2]) / 1e-3 - (f[2] - f[1]) / 1e-3
    assume(abs(narrow - wide) <= 1e-5 * (1 + abs(narrow)) and abs(one_sided) <= 0.1 * (1 + abs(narrow)))
    sides = values["x"] + 1e-6 * np.array([-1.0, 1.0])  # beside the point, which may be a corner of max() and the like
    slopes = tree.derivative("x").numpy({"x": sides, "y": values["y"]})
    assume(np.isfinite(slopes).all())  # 0 * infinity in a part that does not matter, e.g. max(sqrt(x), 1) at x < 0
    fine = tree.numpy({"x": sides, "y": values["y"]})
    assume(abs((fine[1] - fine[0]) / 2e-6 - narrow) <= 1e-3 * (1 + abs(narrow)))  # no ripple between the points
    assume(abs(slopes[1] - slopes[0]) <= 1e-3 * (1 + abs(narrow)))
    # wide - narrow = 3 h^2 f'''/6, and Richardson leaves h^4; rounding is eps |f| / h.
    bound = 10 * abs(wide - narrow) + 1e-12 * np.abs(f).max() / 1e-3 + 1e-6 * (1 + abs(narrow))
    assert abs(slopes.mean() - narrow) <= bound


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3", "0.0"),
        ("y^2 + k", "0.0"),
        ("2 * x", "2.0"),
        ("x^2", "(2.0 * x)"),
        ("k * x", "k"),
        ("floor(x) + step(0, x)", "0.0"),
    ],
)
def test_derivatives_are_simplified(text, expected):
    assert str(parse(text, NAMES).derivative("x")) == expected


def test_second_derivatives():
    second = parse("sin(x) * exp(x)", ["x"]).derivative("x").derivative("x")
    assert second.numpy({"x": 0.7}) == pytest.approx(2 * math.cos(0.7) * math.exp(0.7), rel=1e-14)


def test_names_are_replaced():
    tree = parse("r^2 + x", NAMES).replaced({"r": parse("sqrt(x^2 + y^2)", NAMES)})
    assert tree.numpy({"x": 3.0, "y": 4.0}) == pytest.approx(28.0)


# GLSL, as text; tests/shaders/test_model_custom.py compiles and runs every function


@pytest.mark.parametrize(
    ("text", "glsl"),
    [
        ("1", "1.0"),
        ("1e-5", "1.0e-05"),
        ("2.5e20", "2.5e+20"),
        ("-3 * x", "((-3.0) * x)"),
        ("x^2", "formula_power(x, 2)"),
        ("x^-3", "formula_power(x, -3)"),
        ("x^0.5", "formula_power(x, 0.5)"),
        ("x^k", "formula_power(x, k)"),
        ("x^1000", "formula_power(x, 1000.0)"),
        ("atan2(y, x)", "atan(y, x)"),
        ("-(x + y)", "(-(x + y))"),
    ],
)
def test_printed_as_glsl(text, glsl):
    assert parse(text, NAMES).glsl() == glsl


def test_names_are_renamed_in_glsl():
    tree = parse("k * x", NAMES)
    assert tree.glsl({"x": "s.x.x", "k": "u_k"}) == "(u_k * s.x.x)"
    assert tree.glsl(lambda name: f"u_{name}") == "(u_k * u_x)"


@given(trees())
def test_glsl_has_no_integers_but_exponents(tree):
    words = tree.glsl().replace("(", " ").replace(")", " ").replace(",", " ").split()
    integers = [word for word in words if word.lstrip("-").isdigit()]
    assert len(integers) <= tree.glsl().count("formula_power")


# What is refused


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [
        ("sin(x)+foo", 8, "unknown name 'foo'. Known: x, y, r, k, pi, e, sin"),
        ("x +", 4, "a number, a name or '(' is needed, not the end"),
        ("", 1, "a number, a name or '(' is needed"),
        ("2x", 2, "before 'x'. Write 2*x for 2x"),
        ("x y", 3, "an operator or the end"),
        ("(x", 3, "the parenthesis of column 1 is open"),
        ("x)", 2, "before ')'"),
        ("sin x", 5, "'sin' is a function"),
        ("sin(x, y)", 1, "'sin' takes 1 value, not 2"),
        ("atan2(x)", 1, "'atan2' takes 2 values, not 1"),
        ("clamp()", 7, "not ')'"),
        ("x $ y", 3, "the character '$' has no meaning here"),
        ("x²", 2, "has no meaning"),
        ("٣", 1, "has no meaning"),
        ("1e999", 1, "is larger than"),
        ("1..2", 3, "an operator or the end"),
        ("__import__(x)", 1, "unknown name '__import__'"),
        ("x.real", 2, "has no meaning"),
        ("x" + "+x" * 600, 1, "1201 characters, but 1000 are allowed"),
        ("(" * 900, DEEPEST + 1, "operations within each other"),
        ("-" * 900, DEEPEST + 1, "operations within each other"),
        ("x" + "+x" * 400, 2 * DEEPEST, "operations within each other"),
    ],
)
def test_errors_point_at_the_column(text, column, words):
    with pytest.raises(ExpressionError) as caught:
        parse(text, NAMES)
    assert str(caught.value).startswith(f"column {column}: ") and words in str(caught.value)
    assert caught.value.column == column
    assert caught.value.pointed == f"{text}\n{' ' * (column - 1)}^"


@pytest.mark.parametrize("text", [None, 3, b"x", ["x"]])
def test_only_texts_are_formulas(text):
    with pytest.raises(ExpressionError, match="must be a text"):
        parse(text, NAMES)


def test_own_names_come_before_constants():
    assert parse("e", ["e"]).numpy({"e": 5.0}) == 5.0
    assert parse("e", []).numpy({}) == CONSTANTS["e"]


def is_refused_or_parsed(text):
    begin = time.perf_counter()
    try:
        tree = parse(text, NAMES)
        tree.glsl(), tree.numpy(dict.fromkeys(NAMES, 0.5)), str(tree), tree.names
        tree.derivative("x").glsl()
    except ExpressionError as error:
        assert 1 <= error.column <= len(text) + 1
    assert time.perf_counter() - begin < 5.0


@given(st.text(max_size=2 * LONGEST))
def test_any_text_is_parsed_or_refused(text):
    is_refused_or_parsed(text)


WORDS = [*FUNCTIONS, *CONSTANTS, *NAMES, "pow", "foo", *"+-*/^(),. ", "**", "2", "1e", "0x1", "1e400", "_"]


@settings(max_examples=300)
@given(st.lists(st.sampled_from(WORDS), max_size=300).map("".join))
@example("x^" * 29 + "x")
@example("sin(" * 29 + "x" + ")" * 29)
@example("x/" * 58 + "x")
@example("(x^x)*" * 20 + "x")
@example("atan2(x," * 28 + "x" + ")" * 28)
def test_any_words_are_parsed_or_refused(text):
    is_refused_or_parsed(text)


def test_a_derivative_that_explodes_is_refused():
    text = "x^" * 55 + "x"
    with pytest.raises(ExpressionError, match=r"the derivative by 'x' is too long\. Shorten the formula"):
        parse(text, NAMES).derivative("x")
