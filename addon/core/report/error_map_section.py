"""What the page says about where the error is, and the error maps as pictures."""

from __future__ import annotations

from collections.abc import Sequence

from ..settings import Settings
from . import error_map, png
from .canvas import Raster
from .cases import Case
from .columns import MAP_COLUMNS
from .error_map import ErrorMap
from .methods import integrator_label
from .page import Page, shown
from .work_precision import Progress

SIDE = {True: 32, False: 96}  # quick or not: pixels of the map
PANEL, GAP, TOP, BELOW = 432, 12, 24, 44  # lengths of the drawing; a map is at most PANEL high and wide
WIDTH = 2 * PANEL + 3 * GAP
BAR = 12
MARKED = {
    "absorbed": error_map.ABSORBED,
    "no converged reference": error_map.UNKNOWN,
    "ends elsewhere": error_map.ELSEWHERE,
}


def measured(case: Case, settings: Settings, quick: bool, progress: Progress) -> list[tuple[str, ErrorMap]]:
    """(title, map) of the whole picture and, where its middle has a shadow, of a small part at the shadow's edge."""
    parts = {"The whole picture": error_map.WHOLE}
    edge = error_map.shadows_edge(case)
    if edge:
        parts[f"The shadow's edge, {100.0 * error_map.CLOSE_UP:g} % of the picture across"] = edge
    camera = case.scene.camera
    columns, rows = (
        max(1, round(SIDE[quick] * side / max(camera.width, camera.height))) for side in (camera.width, camera.height)
    )
    found = []
    for index, (title, part) in enumerate(parts.items()):

        def told(done: float, index: int = index) -> None:
            progress((index + done) / len(parts), f"{case.title}: the error map")

        found.append((title, error_map.measure(case, settings, columns, rows, told, part)))
    return found


def write(page: Page, case: Case, settings: Settings, maps: Sequence[tuple[str, ErrorMap]]) -> dict[str, bytes]:
    """maps : of measured().  Returns the pictures as PNG, by name."""
    page.section("Where the error is")
    page.text(
        f"{case.title}, {integrator_label(case.model, settings)}, {settings.step_control}, tolerance "
        f"{settings.tolerance:.3g} rad. Left: the true error, the angle to the float64 reference. Right: what the "
        "integrator itself estimates, which is the pass Error of a render."
    )
    pictures = {}
    for title, found in maps:
        content = picture(found)
        pictures[f"error_map_{len(pictures)}"] = content
        page.heading(title)
        page.picture(png.as_data(content), f"{title}: the true error and the estimated one")
    figures = maps[0][1].figures
    page.text(
        f"In the whole picture the truth exceeds the estimate at {shown(figures['truth_exceeds_estimate_percent'])} % "
        f"of the pixels, and the tolerance at {shown(figures['truth_exceeds_tolerance_percent'])} %; at the median "
        f"pixel the estimate is {shown(figures['estimate_over_truth_median'])} times the true error.",
        advice=True,
    )
    rows = [
        {"part": title} | {key: None if value != value else value for key, value in found.figures.items()}
        for title, found in maps
    ]
    page.table(rows, MAP_COLUMNS)
    return pictures


def picture(found: ErrorMap) -> bytes:
    """Both maps side by side, with the colours' meaning, as PNG."""
    rows, columns, _ = found.true.shape
    width, height = (round(PANEL * side / max(columns, rows)) for side in (columns, rows))
    canvas = Raster(WIDTH, TOP + height + BELOW)
    left, bottom = GAP, TOP + height
    for title, pixels in (("True error", found.true), ("The integrator's estimate", found.estimated)):
        canvas.text((left, 17), title)
        canvas.pixels_at((left, TOP), width, height, pixels)
        left += PANEL + GAP
    canvas.pixels_at((GAP, bottom + 8), PANEL, BAR, error_map.legend(2 * PANEL, 1))
    for label, place in error_map.ticks().items():
        anchor = "start" if place == 0.0 else "end" if place == 1.0 else "middle"
        canvas.text((GAP + place * PANEL, bottom + 36), label, anchor)
    left = 2 * GAP + PANEL
    for name, (red, green, blue) in MARKED.items():
        canvas.circle((left + 6, bottom + 14), 5, "#000000", f"#{red:02x}{green:02x}{blue:02x}")
        canvas.text((left + 16, bottom + 18), name)
        left += 30 + 7 * len(name)
    return png.encoded(canvas.content())
