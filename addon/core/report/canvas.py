"""What diagrams are drawn on: SVG for the page, pixels for PNG. Both take the same coordinates, from the top left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise
from typing import Protocol

import numpy as np

from .lettering import written

Point = tuple[float, float]
SCALE = 2  # pixels of a raster to a length of the drawing; the lettering is made for it
FONT_SIZE = 12  # lengths of the drawing


class Canvas(Protocol):
    """Colours are "#rrggbb"; dash : lengths drawn and left out in turn;  anchor : "start", "middle" or "end"."""

    def line(self, points: Sequence[Point], color: str, width: float = 1.0, dash: Sequence[float] = ()) -> None: ...

    def circle(self, centre: Point, radius: float, color: str, filling: str | None = None) -> None: ...

    def text(self, at: Point, text: str, anchor: str = "start", *, upwards: bool = False) -> None:
        """One line with its base line at `at`; upwards : turned, to be read from below."""


class Svg:
    def __init__(self, width: int, height: int, title: str):
        self._parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
            f'font-family="DejaVu Sans, sans-serif" font-size="{FONT_SIZE}" role="img" aria-label="{escape(title)}">',
            f'<rect width="{width}" height="{height}" fill="white"/>',
        ]

    def line(self, points: Sequence[Point], color: str, width: float = 1.0, dash: Sequence[float] = ()) -> None:
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashes = f' stroke-dasharray="{" ".join(f"{length:g}" for length in dash)}"' if dash else ""
        self._parts.append(
            f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width}"{dashes}/>',
        )

    def circle(self, centre: Point, radius: float, color: str, filling: str | None = None) -> None:
        x, y = centre
        self._parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" fill="{filling or "none"}" stroke="{color}"/>'
        )

    def text(self, at: Point, text: str, anchor: str = "start", *, upwards: bool = False) -> None:
        x, y = at
        turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if upwards else ""
        self._parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{turned}>{escape(text)}</text>')

    def content(self) -> str:
        return "\n".join([*self._parts, "</svg>"])


class Raster:
    """pixels : float32, (SCALE · height, SCALE · width, 3), in [0, 1], row 0 at the top. Edges fade over a pixel."""

    def __init__(self, width: int, height: int):
        self.pixels = np.ones((SCALE * height, SCALE * width, 3), np.float32)

    def line(self, points: Sequence[Point], color: str, width: float = 1.0, dash: Sequence[float] = ()) -> None:
        for begin, end in _dashes(points, dash) if dash else pairwise(points):
            (left, top), (right, bottom) = np.minimum(begin, end) - width, np.maximum(begin, end) + width
            x, y, part = self._window(left, right, top, bottom)
            way = np.subtract(end, begin)
            along = (x - begin[0]) * way[0] + (y - begin[1]) * way[1]
            along = np.clip(along / max(float(way @ way), 1e-12), 0.0, 1.0)
            distance = np.hypot(x - begin[0] - along * way[0], y - begin[1] - along * way[1])
            _paint(part, _inside(distance, 0.5 * width), color)

    def circle(self, centre: Point, radius: float, color: str, filling: str | None = None) -> None:
        x, y, part = self._window(*(at + side * (radius + 1.0) for at in centre for side in (-1, 1)))
        distance = np.hypot(x - centre[0], y - centre[1])
        if filling:
            _paint(part, _inside(distance, radius), filling)
        _paint(part, _inside(np.abs(distance - radius), 0.5), color)

    def text(self, at: Point, text: str, anchor: str = "start", *, upwards: bool = False) -> None:
        covered = written(text).astype(np.float32) / 255.0
        before = round({"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * covered.shape[1])
        base = round(0.8 * covered.shape[0])  # of the letters, from their top
        column, row = round(SCALE * at[0]), round(SCALE * at[1])
        if upwards:
            covered = np.rot90(covered)
            column, row = column - base, row - covered.shape[0] + before
        else:
            column, row = column - before, row - base
        cut_row, cut_column = max(-row, 0), max(-column, 0)
        covered = covered[cut_row:, cut_column:]
        row, column = row + cut_row, column + cut_column
        part = self.pixels[row : row + covered.shape[0], column : column + covered.shape[1]]
        _paint(part, covered[: part.shape[0], : part.shape[1]], "#000000")

    def pixels_at(self, at: Point, width: float, height: float, pixels: np.ndarray) -> None:
        """A picture, uint8, (rows, columns, 3), row 0 at the bottom, with its upper left corner at `at`."""
        column, row, columns, rows = (round(SCALE * length) for length in (*at, width, height))
        across = np.arange(columns) * pixels.shape[1] // columns
        up = np.arange(rows) * pixels.shape[0] // rows
        self.pixels[row : row + rows, column : column + columns] = pixels[::-1][up][:, across] / np.float32(255.0)

    def content(self) -> np.ndarray:
        """uint8, row 0 at the bottom, as png.encoded() takes it."""
        return (255.0 * self.pixels[::-1] + 0.5).astype(np.uint8)

    def _window(self, left: float, right: float, top: float, bottom: float) -> tuple[np.ndarray, ...]:
        """x (1, columns) and y (rows, 1) of the middles of the pixels in there, and a view of the pixels."""
        rows, columns, _ = self.pixels.shape
        first, last = np.clip([int(SCALE * left), int(SCALE * right) + 1], 0, columns)
        upper, lower = np.clip([int(SCALE * top), int(SCALE * bottom) + 1], 0, rows)
        x, y = (np.arange(first, last) + 0.5) / SCALE, (np.arange(upper, lower) + 0.5) / SCALE
        return x[None, :], y[:, None], self.pixels[upper:lower, first:last]


def _inside(distance: np.ndarray, radius: float) -> np.ndarray:
    """How much of a pixel is nearer than the radius."""
    return np.clip(SCALE * (radius - distance) + 0.5, 0.0, 1.0)


def _paint(part: np.ndarray, covered: np.ndarray, color: str) -> None:
    part += covered[..., None] * (np.array([int(color[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]) - part)


def _dashes(points: Sequence[Point], dash: Sequence[float]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The pieces of a polyline that are drawn."""
    index, left = 0, dash[0]
    for begin, end in pairwise(np.array(points, float)):
        length, at = float(np.hypot(*(end - begin))), 0.0
        while at < length:
            step = min(left, length - at)
            if index % 2 == 0:
                yield begin + (end - begin) * at / length, begin + (end - begin) * (at + step) / length
            at, left = at + step, left - step
            if left <= 0.0:
                index, left = index + 1, dash[(index + 1) % len(dash)]
