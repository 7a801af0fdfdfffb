"""Diagrams with logarithmic axes, as SVG and as PNG: nothing that Blender brings draws them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from . import png
from .canvas import Canvas, Point, Raster, Svg

WIDTH, HEIGHT = 900, 520
LEFT, RIGHT, TOP, BOTTOM = 70, 270, 40, 50  # margins; the right one holds the legend
LEGEND_LINE = 18
LABEL = 100  # at least as wide as a vertical's text
GRID, FRONT, LINE = "#e4e4e4", "#bbbbbb", "#555555"
COLORS = ("#3b6fb6", "#d1495b", "#2e8b57", "#8a5fbf", "#c98a1b", "#17a2b8", "#b5651d", "#d667a8", "#444444")
NEUTRAL = len(COLORS) - 1
DASHES = ((), (7, 4), (2, 3))
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Curve:
    """points : (x, y), positive; others are left out.  color, dash : which;  hollow : markers without filling"""

    label: str
    points: Sequence[Point] = ()
    color: int = 0
    dash: int = 0
    hollow: bool = False
    lines: bool = True
    dots: bool = True

    @property
    def shown(self) -> list[Point]:
        return [(x, y) for x, y in self.points if 0 < x < math.inf and 0 < y < math.inf]


@dataclass(frozen=True)
class Diagram:
    """across, up : what the axes are, with units
    front : points joined by a broad line;  marks : (x, y, text);  verticals : (x, text), x positive
    legend : curves without points that explain the looks; where there are none, the legend has a line for every curve
    """

    title: str
    across: str
    up: str
    curves: Sequence[Curve]
    front: Sequence[Point] = ()
    marks: Sequence[tuple[float, float, str]] = ()
    verticals: Sequence[tuple[float, str]] = ()
    legend: Sequence[Curve] = ()

    def as_svg(self) -> str:
        if not self._points():
            return f"<p>{escape(self.title)}: nothing could be measured.</p>"
        canvas = Svg(WIDTH, HEIGHT, self.title)
        self._draw(canvas)
        return canvas.content()

    def as_png(self) -> bytes:
        """A file's content: twice as many pixels as the SVG has lengths."""
        canvas = Raster(WIDTH, HEIGHT)
        if self._points():
            self._draw(canvas)
        else:
            canvas.text((LEFT, TOP), f"{self.title}: nothing could be measured.")
        return png.encoded(canvas.content())

    def _points(self) -> list[Point]:
        return [point for curve in self.curves for point in curve.shown]

    def _draw(self, canvas: Canvas) -> None:
        points = self._points()
        x_axis = _Axis((x for x, _ in [*points, *self.verticals]), LEFT, WIDTH - RIGHT)
        y_axis = _Axis((y for _, y in points), HEIGHT - BOTTOM, TOP)
        canvas.text((LEFT, 22), self.title)
        canvas.text(((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10), self.across, "middle")
        canvas.text((20, (TOP + HEIGHT - BOTTOM) / 2), self.up, "middle", upwards=True)
        self._grid(canvas, x_axis, y_axis)
        if self.front:
            canvas.line([(x_axis(x), y_axis(y)) for x, y in self.front], FRONT, 7)
        for curve in self.curves:
            _curve(canvas, curve, [(x_axis(x), y_axis(y)) for x, y in curve.shown])
        for row, curve in enumerate(self.legend or self.curves):
            _legend(canvas, curve, TOP + 8 + LEGEND_LINE * row)
        for x, y, text in self.marks:
            if 0 < x < math.inf and 0 < y < math.inf:
                at = x_axis(x), y_axis(y)
                canvas.circle(at, 9, "#000000")
                right = at[0] > (LEFT + WIDTH - RIGHT) / 2
                canvas.text((at[0] + (-12 if right else 12), at[1] - 8), text, "end" if right else "start")

    def _grid(self, canvas: Canvas, x_axis: _Axis, y_axis: _Axis) -> None:
        for power in x_axis.powers:
            x = x_axis(10.0**power)
            canvas.line([(x, TOP), (x, HEIGHT - BOTTOM)], GRID)
            canvas.text((x, HEIGHT - BOTTOM + 18), _power(power), "middle")
        for power in y_axis.powers:
            y = y_axis(10.0**power)
            canvas.line([(LEFT, y), (WIDTH - RIGHT, y)], GRID)
            canvas.text((LEFT - 6, y + 4), _power(power), "end")
        for row, (at, text) in enumerate(sorted(self.verticals)):  # each lower than the one to its left: none meet
            x = x_axis(at)
            canvas.line([(x, TOP), (x, HEIGHT - BOTTOM)], LINE, dash=(4, 4))
            left = x > WIDTH - RIGHT - LABEL
            canvas.text((x - 3 if left else x + 3, TOP + 12 + 15 * row), text, "end" if left else "start")


class _Axis:
    """Decades onto the interval from `begin` to `end`, in lengths of the drawing."""

    def __init__(self, values: Iterable[float], begin: float, end: float):
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


def _curve(canvas: Canvas, curve: Curve, points: Sequence[Point]) -> None:
    color = COLORS[curve.color % len(COLORS)]
    if curve.lines and len(points) > 1:
        canvas.line(points, color, 1.5, DASHES[curve.dash])
    for point in points if curve.dots else ():
        canvas.circle(point, 3, color, "#ffffff" if curve.hollow else color)


def _legend(canvas: Canvas, curve: Curve, y: float) -> None:
    x = WIDTH - RIGHT + 14
    _curve(canvas, curve, [(x, y), (x + 26, y)])
    canvas.text((x + 34, y + 4), curve.label)


def _power(power: int) -> str:
    return "10" + str(power).translate(RAISED)
