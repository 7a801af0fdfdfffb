"""Draw the letters of addon/core/report/lettering.npz: DejaVu Sans (free: Bitstream Vera's licence) from matplotlib.

Run it again only to change the size or the letters: .venv/3.13/bin/python tools/make_lettering.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

TARGET = Path(__file__).resolve().parents[1] / "addon" / "core" / "report" / "lettering.npz"
FONT = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
SIZE = 24  # pixels
LETTERS = "".join(map(chr, range(32, 127))) + "⁰¹²³⁴⁵⁶⁷⁸⁹⁻₀–−×·°±≤≥≈√∞→äöüÄÖÜßéαβγδεζηθκλμνξπρστφχψωΔ"


def main() -> None:
    font = ImageFont.truetype(str(FONT), SIZE)
    height = sum(font.getmetrics())
    glyphs = []
    for letter in LETTERS:
        glyph = Image.new("L", (round(font.getlength(letter)), height))
        ImageDraw.Draw(glyph).text((0, 0), letter, font=font, fill=255)
        glyphs.append(np.asarray(glyph))
    edges = np.cumsum([0] + [glyph.shape[1] for glyph in glyphs])
    np.savez_compressed(TARGET, letters=LETTERS, edges=edges.astype(np.int32), strip=np.concatenate(glyphs, axis=1))
    print(f"{TARGET}: {len(LETTERS)} letters, {TARGET.stat().st_size} bytes")


if __name__ == "__main__":
    main()
