"""Diagrams with logarithmic axes, as SVG: nothing that Blender brings draws them, and a page shows them as they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

WIDTH, HEIGHT = 900, 520
LEFT, RIGHT, TOP, BOTTOM = 70, 270, 40, 50  # margins; the right one holds the legend
LEGEND_LINE = 16
COLORS = ("#3b6fb6", "#d1495b", "#2e8b57", "#8a5fbf", "#c98a1b", "#444444")
DASHES = ("", "7 4", "2 3")


@dataclass(frozen=True)
class Curve:
    """points : (x, y), positive; others are left out.  color, dash : which;  hollow : markers without filling"""

    label: str
    points: Sequence[tuple[float, float]]
    color: int = 0
    dash: int = 0
    hollow: bool = False
    lines: bool = True

    @property
    def shown(self) -> list[tuple[float, float]]:
        return [(x, y) for x, y in self.points if 0 < x < math.inf and 0 < y < math.inf]


@dataclass(frozen=True)
class Diagram:
    """front : points joined by a broad line;  marks : (x, y, text);  verticals : (x, text)"""

    title: str
    across: str
    up: str
    curves: Sequence[Curve]
    front: Sequence[tuple[float, float]] = ()
    marks: Sequence[tuple[float, float, str]] = ()
    verticals: Sequence[tuple[float, str]] = field(default_factory=tuple)

    def as_svg(self) -> str:
        points = [point for curve in self.curves for point in curve.shown]
        if not points:
            return f"<p>{escape(self.title)}: nothing could be measured.</p>"
        x_axis = _Axis([x for x, _ in points], LEFT, WIDTH - RIGHT)
        y_axis = _Axis([y for _, y in points], HEIGHT - BOTTOM, TOP)
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
            f'font-family="sans-serif" font-size="12" role="img" aria-label="{escape(self.title)}">',
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
            _text(LEFT, 22, self.title, size=15),
            _text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, self.across, anchor="middle"),
            f'<g transform="translate(16 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)">'
            f"{_text(0, 0, self.up, anchor='middle')}</g>",
        ]
        parts += self._grid(x_axis, y_axis)
        if self.front:
            parts.append(_line([(x_axis(x), y_axis(y)) for x, y in self.front], "#bbbbbb", 7))
        for row, curve in enumerate(self.curves):
            parts += _curve(curve, [(x_axis(x), y_axis(y)) for x, y in curve.shown])
            parts += _legend(curve, TOP + 8 + LEGEND_LINE * row)
        for x, y, text in self.marks:
            if 0 < x < math.inf and 0 < y < math.inf:
                at = x_axis(x), y_axis(y)
                parts.append(f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="9" fill="none" stroke="black"/>')
                parts.append(_text(at[0] + 12, at[1] - 8, text))
        return "\n".join([*parts, "</svg>"])

    def _grid(self, x_axis: _Axis, y_axis: _Axis) -> list[str]:
        parts = []
        for power in x_axis.powers:
            x = x_axis(10.0**power)
            parts += [
                _line([(x, TOP), (x, HEIGHT - BOTTOM)], "#e4e4e4"),
                _power(x, HEIGHT - BOTTOM + 18, power, "middle"),
            ]
        for power in y_axis.powers:
            y = y_axis(10.0**power)
            parts += [_line([(LEFT, y), (WIDTH - RIGHT, y)], "#e4e4e4"), _power(LEFT - 6, y + 4, power, "end")]
        for at, text in self.verticals:
            if x_axis.low <= math.log10(at) <= x_axis.high:
                x = x_axis(at)
                parts += [_line([(x, TOP), (x, HEIGHT - BOTTOM)], "#555555", dash="4 4"), _text(x + 3, TOP + 12, text)]
        return parts


class _Axis:
    """Decades onto the interval from `begin` to `end`, in pixels of the drawing."""

    def __init__(self, values: Sequence[float], begin: float, end: float):
        logs = [math.log10(value) for value in values]
        self.low, self.high = math.floor(min(logs)), math.ceil(max(logs))
        if self.low == self.high:
            self.high += 1
        self.begin, self.end = begin, end

    @property
    def powers(self) -> range:
        return range(self.low, self.high + 1, max(1, (self.high - self.low) // 8))

    def __call__(self, value: float) -> float:
        return self.begin + (math.log10(value) - self.low) / (self.high - self.low) * (self.end - self.begin)


def _curve(curve: Curve, points: list[tuple[float, float]]) -> list[str]:
    color = COLORS[curve.color % len(COLORS)]
    filling = "white" if curve.hollow else color
    dots = [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{filling}" stroke="{color}"/>' for x, y in points]
    lines = [_line(points, color, 1.5, DASHES[curve.dash])] if curve.lines and len(points) > 1 else []
    return lines + dots


def _legend(curve: Curve, y: float) -> list[str]:
    x = WIDTH - RIGHT + 14
    return [*_curve(curve, [(x, y), (x + 26, y)]), _text(x + 34, y + 4, curve.label, size=11)]


def _line(points: Sequence[tuple[float, float]], color: str, width: float = 1.0, dash: str = "") -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    return f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width}"{dashes}/>'


def _text(x: float, y: float, text: str, anchor: str = "start", size: int = 12) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}">{escape(text)}</text>'


def _power(x: float, y: float, power: int, anchor: str) -> str:
    raised = f'<tspan dy="-5" font-size="9">{power}</tspan>'
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">10{raised}</text>'
