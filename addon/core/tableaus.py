"""Butcher tableaus of explicit Runge-Kutta methods, which check themselves and print themselves as GLSL.

    c | A          k_i = rhs(s + h sum_j A_ij k_j),   s' = s + h sum_i b_i k_i,
      | b          error = h sum_i (b_i - b*_i) k_i   where there is an embedded method b* of lower order
      | b*

Fractions stay fractions until they are printed.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


class TableauError(ValueError):
    """A tableau does not have the order it claims."""


@dataclass(frozen=True)
class Tableau:
    """name : as the user reads it;  order : of b;  a : rows below the diagonal, the first empty;
    embedded : b*, or None.  Source with every table below.
    """

    name: str
    order: int
    a: tuple[tuple[Fraction, ...], ...]
    b: tuple[Fraction, ...]
    embedded: tuple[Fraction, ...] | None = None
    embedded_order: int = 0

    def __post_init__(self):
        if len(self.a) != len(self.b) or any(len(row) != i for i, row in enumerate(self.a)):
            raise TableauError(f"{self.name}: A is not strictly lower triangular.")
        self._check(self.b, self.order)
        if self.embedded is not None:
            self._check(self.embedded, self.embedded_order)

    @property
    def stages(self) -> int:
        return len(self.b)

    @property
    def c(self) -> tuple[Fraction, ...]:
        return tuple(sum(row, Fraction(0)) for row in self.a)

    @property
    def first_same_as_last(self) -> bool:
        """The last stage is the first one of the next step."""
        return self.a[-1] == self.b[:-1] and self.b[-1] == 0

    def _check(self, b: tuple[Fraction, ...], order: int) -> None:
        """The order conditions, one for each rooted tree of up to `order` nodes: Hairer, Norsett and Wanner, Solving
        Ordinary Differential Equations I, Section II.2.
        """
        for tree in trees(order):
            weight = sum((b_i * phi for b_i, phi in zip(b, self._elementary(tree), strict=True)), Fraction(0))
            if weight != Fraction(1, density(tree)):
                raise TableauError(
                    f"{self.name}: the order condition of tree {tree} fails; it is not of order {order}."
                )

    def _elementary(self, tree: tuple) -> list[Fraction]:
        """For every stage i: the product over the root's branches of sum_j A_ij phi_j(branch)."""
        values = [Fraction(1)] * self.stages
        for branch in tree:
            below = self._elementary(branch)
            for i, row in enumerate(self.a):
                values[i] *= sum((a_ij * below[j] for j, a_ij in enumerate(row)), Fraction(0))
        return values

    def as_glsl(self, continued: bool = False) -> str:
        """The text of `Step advance(RayState s, float h)`, the contract of shaders/integrators/.

        continued : of `Step advance_from(RayState s, RayState first, float h, out RayState last)`, which takes the
        derivative at s and gives the one behind the step: see integrators/continued.glsl
        """
        lines = [
            f"// Provides {self.name}: order {self.order}, {self.stages} stages. Printed by addon/core/tableaus.py.",
            "",
            "RayState rhs(RayState s);  // d/dtau of the state",
            "",
        ]
        if continued:
            lines.append("Step advance_from(RayState s, RayState k1, float h, out RayState last) {")
        else:
            lines += ["Step advance(RayState s, float h) {", "    RayState k1 = rhs(s);"]
        for i, row in enumerate(self.a[1:], start=2):
            x, v = (combination(row, part=part) for part in (".x", ".v"))
            lines.append(f"    RayState k{i} = rhs(RayState(s.x + ({x}), s.v + ({v})));")
        x, v = (combination(self.b, part=part) for part in (".x", ".v"))
        lines.append(f"    RayState after = RayState(s.x + ({x}), s.v + ({v}));")
        if continued:
            lines.append(f"    last = {f'k{self.stages}' if self.first_same_as_last else 'rhs(after)'};")
        if self.embedded is None:
            lines.append("    return Step(after, 0.0);")
        else:
            off = [b - e for b, e in zip(self.b, self.embedded, strict=True)]
            x, v = (combination(off, part=part) for part in (".x", ".v"))
            lines.append(f"    return Step(after, angular_error(s, after, {x}, {v}));")
        return "\n".join([*lines, "}", ""])


def trees(order: int) -> list[tuple]:
    """All rooted trees of 1 to `order` nodes; a tree is the sorted tuple of its branches."""
    found: dict[int, list[tuple]] = {1: [()]}
    for nodes in range(2, order + 1):
        found[nodes] = sorted({tuple(sorted(forest)) for forest in _forests(nodes - 1, found)})
    return [tree for nodes in range(1, order + 1) for tree in found[nodes]]


def _forests(nodes: int, known: dict[int, list[tuple]]) -> list[tuple]:
    if nodes == 0:
        return [()]
    return [
        (tree, *rest)
        for first in range(1, nodes + 1)
        for tree in known[first]
        for rest in _forests(nodes - first, known)
    ]


def size(tree: tuple) -> int:
    return 1 + sum(size(branch) for branch in tree)


def density(tree: tuple) -> int:
    """gamma(t): the number of nodes times the densities of the branches."""
    product = size(tree)
    for branch in tree:
        product *= density(branch)
    return product


def combination(weights, h: str = "h", part: str = "") -> str:
    """h sum_i w_i k_i, with the numbers first: a processor that waits for the last k_i has two operations left then."""
    terms = [f"{literal(w)} * {h} * k{i}{part}" for i, w in enumerate(weights, start=1) if w]
    return " + ".join(terms) or "vec3(0.0)"


def literal(value: Fraction) -> str:
    """A float literal that float32 reads back exactly as the nearest float32."""
    text = f"{float(value):.17g}"
    return text if any(mark in text for mark in ".e") else f"{text}.0"


def fractions(text: str) -> tuple[Fraction, ...]:
    return tuple(Fraction(entry) for entry in text.split())


# Kutta 1901.
RUNGE_KUTTA_4 = Tableau(
    "the classical Runge-Kutta method",
    4,
    a=((), fractions("1/2"), fractions("0 1/2"), fractions("0 0 1")),
    b=fractions("1/6 1/3 1/3 1/6"),
)
# Bogacki and Shampine, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989).
BOGACKI_SHAMPINE_32 = Tableau(
    "Bogacki and Shampine's method",
    3,
    a=((), fractions("1/2"), fractions("0 3/4"), fractions("2/9 1/3 4/9")),
    b=fractions("2/9 1/3 4/9 0"),
    embedded=fractions("7/24 1/4 1/3 1/8"),
    embedded_order=2,
)
# Dormand and Prince, A family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6 (1980).
DORMAND_PRINCE_54 = Tableau(
    "Dormand and Prince's method",
    5,
    a=(
        (),
        fractions("1/5"),
        fractions("3/40 9/40"),
        fractions("44/45 -56/15 32/9"),
        fractions("19372/6561 -25360/2187 64448/6561 -212/729"),
        fractions("9017/3168 -355/33 46732/5247 49/176 -5103/18656"),
        fractions("35/384 0 500/1113 125/192 -2187/6784 11/84"),
    ),
    b=fractions("35/384 0 500/1113 125/192 -2187/6784 11/84 0"),
    embedded=fractions("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40"),
    embedded_order=4,
)

TABLEAUS = {
    "runge_kutta_4": RUNGE_KUTTA_4,
    "bogacki_shampine_32": BOGACKI_SHAMPINE_32,
    "dormand_prince_54": DORMAND_PRINCE_54,
}
