"""The Status pass in colours: one for each way in which a ray ends, its legend, and the icons beside the names."""

from __future__ import annotations

import bpy
import bpy.utils.previews
import numpy as np

from .core.status import Status

COLORS = {  # red, green, blue as the screen shows them, told apart by those who see no red or no green (Okabe, Ito)
    Status.RUNNING: (0.45, 0.45, 0.45),
    Status.HIT: (0.00, 0.62, 0.45),
    Status.ESCAPED: (0.34, 0.71, 0.91),
    Status.ABSORBED: (0.00, 0.00, 0.00),
    Status.LEFT_DOMAIN: (0.00, 0.45, 0.70),
    Status.STEP_LIMIT: (0.90, 0.62, 0.00),
    Status.STEP_TOO_SMALL: (0.94, 0.89, 0.26),
    Status.NOT_FINITE: (0.84, 0.37, 0.00),
}
DIGITS = (  # 3 columns and 5 rows of a digit each, from the top left
    "111101101101111",
    "010110010010111",
    "111001111100111",
    "111001111001111",
    "101101111001001",
    "111100111001111",
    "111100111101111",
    "111001001001001",
)
SWATCH = 64  # pixels a side, of the legend
DOT = 8  # pixels a side, of a dot of a digit
ICON = 32  # pixels a side

_icons = None


def linear_colors() -> np.ndarray:
    """float32, (statuses, 3): what the screen shows as COLORS in an image of numbers, by sRGB's own curve."""
    shown = np.array([COLORS[status] for status in Status])
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4).astype(np.float32)


def colored(status: np.ndarray) -> np.ndarray:
    """float32, (height, width, 1), numbers of Status -> float32, (height, width, 3)."""
    return linear_colors()[status[..., 0].astype(np.int64)]


def legend() -> np.ndarray:
    """float32, (height, width, 3): a swatch for each status with its number, in the order of the numbers from left to
    right; row 0 is the bottom.
    """
    swatches = []
    for status, color in zip(Status, linear_colors(), strict=True):
        swatch = np.empty((SWATCH, SWATCH, 3), np.float32)
        swatch[:] = color
        dots = np.array([letter == "1" for letter in DIGITS[status]]).reshape(5, 3)[::-1]
        digit = dots.repeat(DOT, axis=0).repeat(DOT, axis=1)
        bottom, left = (SWATCH - digit.shape[0]) // 2, (SWATCH - digit.shape[1]) // 2
        bright = sum(COLORS[status]) > 1.5
        swatch[bottom : bottom + digit.shape[0], left : left + digit.shape[1]][digit] = 0.0 if bright else 1.0
        swatches.append(swatch)
    return np.concatenate(swatches, axis=1)


def icon(status: Status) -> int:
    """The icon_value of a status's colour."""
    return _icons[status.name].icon_id


def register():
    global _icons
    _icons = bpy.utils.previews.new()
    for status, color in COLORS.items():
        preview = _icons.new(status.name)
        preview.icon_size = (ICON, ICON)
        preview.icon_pixels_float = (*color, 1.0) * (ICON * ICON)


def unregister():
    global _icons
    bpy.utils.previews.remove(_icons)
    _icons = None
