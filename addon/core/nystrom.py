"""Runge-Kutta-Nystrom methods, for forces of the position alone; they check themselves and print themselves as GLSL.

    dx/dτ = v,  dv/dτ = f(x)      k_i = f(x + c_i h v + h^2 sum_j a_ij k_j)
    x' = x + h v + h^2 sum_i b_i k_i,   v' = v + h sum_i d_i k_i,   error = h sum_i (d_i - d*_i) k_i

Positions alone are stages here, which halves the work of a method for any right-hand side, and of the same number of
stages there are methods of higher order. What the embedded weights d* leave of v is the estimate: the error of x is
less than h times it. Theory: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, Section II.14.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import combinations_with_replacement

from .tableaus import TableauError, combination, fractions, literal

Tree = tuple  # of an f: its branches, None for a v and a tree for an f, which are the ways to differentiate f(x)


@dataclass(frozen=True)
class Nystrom:
    """name : as the user reads it;  order : of b and d;  c : times of the stages;  a : rows below the diagonal;
    embedded : d*.  Source with every method below; the last stage has to be the next step's first one.
    digits : after the point that the table has; the order conditions hold to within these
    step_share : as IntegratorShader has it: the estimate is two orders below the method, and far above its error
    """

    name: str
    order: int
    c: tuple[Fraction, ...]
    a: tuple[tuple[Fraction, ...], ...]
    b: tuple[Fraction, ...]
    d: tuple[Fraction, ...]
    embedded: tuple[Fraction, ...]
    embedded_order: int
    digits: int
    step_share: float

    def __post_init__(self):
        if any(len(row) != i for i, row in enumerate(self.a)):
            raise TableauError(f"{self.name}: A is not strictly lower triangular.")
        if self.a[-1] != self.b[:-1] or self.b[-1] != 0 or self.c[-1] != 1:
            raise TableauError(f"{self.name}: the last stage is not at the end of the step.")
        self._check(self.b, self.order, position=True)
        self._check(self.d, self.order)
        self._check(self.embedded, self.embedded_order)

    @property
    def stages(self) -> int:
        return len(self.b)

    def _check(self, weights: tuple[Fraction, ...], order: int, position: bool = False) -> None:
        """The order conditions, one for each tree: with k_i as a product of powers, the sum over the stages is the
        integral over the step, once for v and twice for x.
        """
        for tree in nystrom_trees(order - 1 if position else order):
            found = sum(w * phi for w, phi in zip(weights, self._elementary(tree), strict=True))
            wanted = density(tree) / (size(tree) + 1 if position else 1)
            if abs(found - wanted) > Fraction(10) ** (1 - self.digits):
                raise TableauError(
                    f"{self.name}: the order condition of tree {tree} fails; it is not of order {order}."
                )

    def _elementary(self, tree: Tree) -> list[Fraction]:
        values = [Fraction(1)] * self.stages
        for branch in tree:
            if branch is None:
                factors = list(self.c)
            else:
                below = self._elementary(branch)
                factors = [sum((a * below[j] for j, a in enumerate(row)), Fraction(0)) for row in self.a]
            values = [value * factor for value, factor in zip(values, factors, strict=True)]
        return values

    def as_glsl(self, continued: bool = False) -> str:
        """The text of advance(), or of advance_from(): as Tableau.as_glsl()."""
        lines = [
            f"// Provides {self.name}: order {self.order}, {self.stages} stages, for forces of the position alone.",
            "// Printed by addon/core/nystrom.py.",
            "",
            "vec3 acceleration(vec3 x, RayState s);  // at x, on the ray that comes through s",
            "",
        ]
        if continued:
            lines += [
                "Step advance_from(RayState s, RayState first, float h, out RayState last) {",
                "    vec3 k1 = first.v;",
            ]
        else:
            lines += ["Step advance(RayState s, float h) {", "    vec3 k1 = acceleration(s.x, s);"]
        lines.append("    float h_squared = h * h;")
        for i, (c, row) in enumerate(zip(self.c[1:], self.a[1:], strict=True), start=2):
            along = "h * s.v" if c == 1 else f"{literal(c)} * h * s.v"
            lines.append(f"    vec3 x{i} = s.x + ({along} + {combination(row, 'h_squared')});")
            lines.append(f"    vec3 k{i} = acceleration(x{i}, s);")
        lines.append(f"    RayState after = RayState(x{self.stages}, s.v + ({combination(self.d)}));")
        if continued:
            lines.append(f"    last = RayState(after.v, k{self.stages});")
        off = [p - q for p, q in zip(self.d, self.embedded, strict=True)]
        lines.append(f"    return Step(after, angular_error(s, after, vec3(0.0), {combination(off)}));")
        return "\n".join([*lines, "}", ""])


@cache
def nystrom_trees(order: int) -> tuple[Tree, ...]:
    """All trees of up to `order` nodes whose root is an f."""
    return tuple(tree for nodes in range(1, order + 1) for tree in _trees(nodes))


@cache
def _trees(nodes: int) -> tuple[Tree, ...]:
    """Those of exactly so many nodes. A branch None has one node, a branch that is a tree one more than the tree: x' is
    v, and only then comes f.
    """
    branches = [(None, 1)] + [(tree, below + 1) for below in range(1, nodes - 1) for tree in _trees(below)]
    return tuple(
        tuple(branch for branch, _ in chosen)
        for count in range(nodes)
        for chosen in combinations_with_replacement(branches, count)
        if sum(weight for _, weight in chosen) == nodes - 1
    )


def size(tree: Tree) -> int:
    return 1 + sum(1 if branch is None else 1 + size(branch) for branch in tree)


def density(tree: Tree) -> Fraction:
    """The integral over [0, 1] of what the tree stands for: t for a v, the double integral for a branch."""
    value = Fraction(1, size(tree))
    for branch in tree:
        if branch is not None:
            value *= density(branch) / (size(branch) + 1)
    return value


# Dormand, El-Mikkawy and Prince, Families of Runge-Kutta-Nystrom formulae, IMA J. Numer. Anal. 7 (1987): RKN6(4)6FM.
NYSTROM_64 = Nystrom(
    "Dormand, El-Mikkawy and Prince's method",
    6,
    c=fractions(
        "0 0.129295903136704415288990053209 0.258591806273408830577980106418 0.670297082615480058310908782471 0.9 1"
    ),
    a=(
        (),
        fractions("0.00835871528396802532822102346743"),
        fractions("0.0111449537119573671042946979566 0.0222899074239147342085893959132"),
        fractions(
            "0.145474742801091785895935232316 -0.229860640522647473120261456297 0.309034987202967536528726080729"
        ),
        fractions(
            "-0.207668262950789954335146205252 0.686366784292514312273571851042 -0.199549277872349252201326358888 "
            "0.125850756530624894262900713098"
        ),
        fractions(
            "0.0781101614434947768281101614435 0 0.2882917411897667776841772093 0.122425537174570410182422422005 "
            "0.011172560192168035305290207251"
        ),
    ),
    b=fractions(
        "0.0781101614434947768281101614435 0 0.2882917411897667776841772093 0.122425537174570410182422422005 "
        "0.011172560192168035305290207251 0"
    ),
    d=fractions(
        "0.0781101614434947768281101614435 0 0.388843478705982602715952208523 0.371320757928842267403035557523 "
        "0.11172560192168035305290207251 0.05"
    ),
    embedded=fractions(
        "0.0546058879392212725546058879392 0 0.46126678590362684429468353488 0.195880859479312656291875875208 "
        "0.388246466677839226858834701972 -0.1"
    ),
    embedded_order=4,
    digits=29,
    step_share=0.2,
)

NYSTROM_METHODS = {"nystrom_64": NYSTROM_64}
