"""What a part of the benchmark hands back: tables for the terminal, targets, and raw figures for the file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Target:
    """One row of issue 4's table "Where it must get to". value : what was measured; at_least : the bound's side;
    tried : what was done to reach it, for one that is not
    """

    name: str
    value: float
    bound: float
    at_least: bool = False
    tried: str = ""

    @property
    def holds(self) -> bool:
        """False for NaN, too."""
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    def as_json(self) -> dict[str, object]:
        value = self.value if math.isfinite(self.value) else None
        return {
            "name": self.name,
            "value": value,
            "bound": self.bound,
            "at_least": self.at_least,
            "holds": self.holds,
            "tried": self.tried,
        }


@dataclass(frozen=True)
class Table:
    """Cells are texts or numbers; numbers are printed with three digits."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    note: str = ""

    def __str__(self) -> str:
        lines = [list(self.columns), *([cell_text(cell) for cell in row] for row in self.rows)]
        widths = [max(len(line[i]) for line in lines) for i in range(len(self.columns))]
        text = [self.title]
        for line in lines:
            first, *others = (
                cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(line, widths, strict=True))
            )
            text.append("  " + "  ".join([first, *others]).rstrip())
        return "\n".join([*text, *(f"  {line}" for line in self.note.splitlines())])


@dataclass
class Part:
    """figures : what goes to the file under the part's name, JSON's types only."""

    tables: list[Table]
    figures: dict[str, object]
    targets: list[Target] = field(default_factory=list)


def cell_text(cell: object) -> str:
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return f"{cell:#.3g}".rstrip(".") if abs(cell) < 1000 else f"{cell:.0f}"
    return str(cell)


def target_table(targets: Sequence[Target]) -> Table:
    rows = [
        (
            target.name,
            target.value,
            f"{'>=' if target.at_least else '<='} {target.bound:g}",
            "yes" if target.holds else "NO",
        )
        for target in targets
    ]
    missed = dict.fromkeys(target.tried for target in targets if target.tried and not target.holds)
    note = "".join(f"\nTried for {_names(targets, tried)}:\n{tried}" for tried in missed)
    return Table("Where it must get to", ("", "measured", "bound", "holds"), rows, note)


def _names(targets: Sequence[Target], tried: str) -> str:
    return "; ".join(target.name for target in targets if target.tried == tried and not target.holds)
