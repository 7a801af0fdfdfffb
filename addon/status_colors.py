"""The Status pass in colours: one for each way in which a ray ends, their legend, and the icons beside the names."""

from __future__ import annotations

import bpy
import bpy.utils.previews
import numpy as np

from .core.report.lettering import written
from .core.status import MEANINGS, Status

COLORS = {  # red, green, blue as the screen shows them, told apart by those who see no red or no green (Okabe, Ito)
    Status.RUNNING: (0.45, 0.45, 0.45),
    Status.HIT: (0.00, 0.62, 0.45),
    Status.ESCAPED: (0.34, 0.71, 0.91),
    Status.ABSORBED: (0.00, 0.00, 0.00),
    Status.LEFT_DOMAIN: (0.00, 0.45, 0.70),
    Status.STEP_LIMIT: (0.90, 0.62, 0.00),
    Status.STEP_TOO_SMALL: (0.94, 0.89, 0.26),
    Status.NOT_FINITE: (0.84, 0.37, 0.00),
    Status.LOST: (0.80, 0.47, 0.65),
}
SWATCH = 48  # pixels a side, of the legend
BACKGROUND = 0.15  # grey behind its names, as the screen shows it
ICON = 32  # pixels a side

_icons = None


def linear(shown: np.ndarray) -> np.ndarray:
    """What the screen shows as `shown`, in an image of numbers: sRGB's own curve; float32."""
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4).astype(np.float32)


def linear_colors() -> np.ndarray:
    """float32, (statuses, 3)."""
    return linear(np.array([COLORS[status] for status in Status]))


def colored(status: np.ndarray) -> np.ndarray:
    """float32, (height, width, 1), numbers of Status -> float32, (height, width, 3)."""
    return linear_colors()[status[..., 0].astype(np.int64)]


def legend() -> np.ndarray:
    """float32, (height, width, 3): a line for each status, the first on top: its colour, number and meaning, as in the
    panel; row 0 is the bottom.
    """
    names = [written(f"  {status:d}  {MEANINGS[status].capitalize()}  ") for status in Status]
    shown = np.full((SWATCH * len(names), SWATCH + max(name.shape[1] for name in names), 3), BACKGROUND)
    for index, (status, name) in enumerate(zip(Status, names, strict=True)):
        line = shown[SWATCH * index : SWATCH * (index + 1)]
        line[:, :SWATCH] = COLORS[status]
        top = (SWATCH - name.shape[0]) // 2
        part = line[top : top + name.shape[0], SWATCH : SWATCH + name.shape[1]]
        part += name[..., None] / 255.0 * (1.0 - part)
    return linear(shown[::-1])


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
