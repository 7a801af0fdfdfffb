"""Rosenbrock methods, for stiff problems: they check themselves and print themselves as GLSL.

    W k_i = gamma (h rhs(s + sum_j a_ij k_j) + sum_j c_ij k_j),   W = I - gamma h J,   J = d rhs / d s
    s' = s + sum_i m_i k_i,   error = sum_i (m_i - m*_i) k_i   where m* is the embedded method of lower order

This is the form without products by J of Hairer and Wanner, Solving Ordinary Differential Equations II, Section IV.7.
J and the solution of the linear systems are in shaders/integrators/linearised.glsl.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from .tableaus import TableauError, density, fractions, literal, trees

Matrix = list[list[Fraction]]


@dataclass(frozen=True)
class Rosenbrock:
    """name : as the user reads it;  order : of m;  a, c : rows below the diagonal, the first empty;
    m, embedded : weights.  Source with every method below.
    """

    name: str
    order: int
    gamma: Fraction
    a: tuple[tuple[Fraction, ...], ...]
    c: tuple[tuple[Fraction, ...], ...]
    m: tuple[Fraction, ...]
    embedded: tuple[Fraction, ...]
    embedded_order: int

    def __post_init__(self):
        for rows in (self.a, self.c):
            if len(rows) != self.stages or any(len(row) != i for i, row in enumerate(rows)):
                raise TableauError(f"{self.name}: A or C is not strictly lower triangular.")
        self._check(self.m, self.order)
        self._check(self.embedded, self.embedded_order)
        if self.far_damping() != 0:
            raise TableauError(f"{self.name}: R(infinity) is {self.far_damping()}, not 0; it is not L-stable.")

    @property
    def stages(self) -> int:
        return len(self.m)

    def far_damping(self) -> Fraction:
        """R(infinity): what is left, after a step, of what decays infinitely fast. 1 - m (I + A)^-1 (1, ..., 1)."""
        solved: list[Fraction] = []
        for row in self.a:
            solved.append(1 - _dot(row, solved))
        return 1 - _dot(self.m, solved)

    def _check(self, m: tuple[Fraction, ...], order: int) -> None:
        """The order conditions of rooted trees: Hairer and Wanner II, Theorem IV.7.4. They are those of the weights and
        matrices that stand at rhs itself: b = m G, alpha = A G, beta = alpha + G with G = (I / gamma - C)^-1.
        """
        g = self._inverse_of_identity_minus_c()
        alpha = _product(self.a, g)
        beta = [[p + q for p, q in zip(*rows, strict=True)] for rows in zip(alpha, g, strict=True)]
        b = _product((m,), g)[0]
        for tree in trees(order):
            if _dot(b, _elementary(tree, alpha, beta)) != Fraction(1, density(tree)):
                raise TableauError(
                    f"{self.name}: the order condition of tree {tree} fails; it is not of order {order}."
                )

    def _inverse_of_identity_minus_c(self) -> Matrix:
        """(I / gamma - C)^-1, row by row."""
        rows: Matrix = []
        for i, row in enumerate(self.c):
            unit = [Fraction(i == j) for j in range(self.stages)]
            before = _product((row,), rows)[0] if rows else [Fraction(0)] * self.stages
            rows.append([self.gamma * (one + p) for one, p in zip(unit, before, strict=True)])
        return rows

    def as_glsl(self, continued: bool = False) -> str:
        """The text of advance(), or of advance_from(): as Tableau.as_glsl()."""
        lines = [
            f"// Provides {self.name}: order {self.order}, {self.stages} stages, L-stable. Printed by",
            "// addon/core/rosenbrock.py.",
            "",
            "RayState rhs(RayState s);  // d/dtau of the state",
            "Linearised linearise(RayState s, RayState first, float gamma_h);  // W",
            "RayState solve(Linearised w, vec3 x, vec3 v);                     // W^-1 (x, v)",
            "",
        ]
        if continued:
            lines.append("Step advance_from(RayState s, RayState first, float h, out RayState last) {")
        else:
            lines += ["Step advance(RayState s, float h) {", "    RayState first = rhs(s);"]
        gamma = literal(self.gamma)
        lines.append(f"    Linearised w = linearise(s, first, {gamma} * h);")
        for i, (a, c) in enumerate(zip(self.a, self.c, strict=True), start=1):
            rate = "first"
            if any(a):
                rate = f"rate{i}"
                lines.append(f"    RayState {rate} = rhs(RayState(s.x{_sum(a, 'x')}, s.v{_sum(a, 'v')}));")
            x, v = (f"{gamma} * (h * {rate}.{part}{_sum(c, part)})" for part in "xv")
            lines.append(f"    RayState k{i} = solve(w, {x}, {v});")
        lines.append(f"    RayState after = RayState(s.x{_sum(self.m, 'x')}, s.v{_sum(self.m, 'v')});")
        if continued:
            lines.append("    last = rhs(after);")
        off = [p - q for p, q in zip(self.m, self.embedded, strict=True)]
        x, v = (_sum(off, part).removeprefix(" + ") for part in "xv")
        lines.append(f"    return Step(after, angular_error(s, after, {x}, {v}));")
        return "\n".join([*lines, "}", ""])


def _elementary(tree: tuple, alpha: Matrix, beta: Matrix) -> list[Fraction]:
    """For every stage: the product over the root's branches of sum_j M_ij phi_j(branch), where M is beta below a root
    with one branch, as J stands in for rhs there, and alpha otherwise.
    """
    values = [Fraction(1)] * len(alpha)
    for branch in tree:
        below = _elementary(branch, alpha, beta)
        for i, row in enumerate(beta if len(tree) == 1 else alpha):
            values[i] *= _dot(row, below)
    return values


def _dot(p, q) -> Fraction:
    """Of the first entries of q, as many as p has."""
    return sum((one * other for one, other in zip(p, q, strict=False)), Fraction(0))


def _product(rows, matrix: Matrix) -> Matrix:
    """Rows may be shorter than the matrix: what is missing is 0."""
    return [[_dot(row, column) for column in zip(*matrix, strict=True)] for row in rows]


def _sum(weights, part: str) -> str:
    return "".join(f" + {literal(w)} * k{i}.{part}" for i, w in enumerate(weights, start=1) if w)


# RODAS3: Sandu, Verwer, Blom, Spee, Carmichael and Potra, Benchmarking stiff ODE solvers for atmospheric chemistry
# problems II: Rosenbrock solvers, Atmospheric Environment 31 (1997).
RODAS_3 = Rosenbrock(
    "the Rosenbrock method RODAS3",
    3,
    gamma=Fraction(1, 2),
    a=((), fractions("0"), fractions("2 0"), fractions("2 0 1")),
    c=((), fractions("4"), fractions("1 -1"), fractions("1 -1 -8/3")),
    m=fractions("2 0 1 1"),
    embedded=fractions("2 0 1 0"),
    embedded_order=2,
)

ROSENBROCK_METHODS = {"rosenbrock_32": RODAS_3}
# Of the error estimate, as a multiple of an explicit method's: measured, with less some rays of a stiff law shorten
# their steps because of it, and none becomes more accurate.
ROUNDING = 8.0
