"""One page that holds everything: tables, diagrams and pictures, readable without a network."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from html import escape

STYLE = """
body { font: 15px/1.5 sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; font-size: 12px; margin: 0.5em 0 1.5em; }
th, td { padding: 2px 8px; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th { border-bottom: 2px solid #888; white-space: normal; vertical-align: bottom; }
td.text, th.text { text-align: left; white-space: normal; min-width: 8em; }
tr.front td { background: #f0f4e8; } .wide { overflow-x: auto; }
img { max-width: 100%; } figure { margin: 1em 0; } nav a { margin-right: 1em; }
svg { display: block; max-width: 900px; }
.advice { background: #f3f6fb; padding: 0.5em 1em; border-left: 4px solid #3b6fb6; }
"""


class Page:
    """Pieces of HTML, one after the other. Texts are escaped; `raw` is for diagrams."""

    def __init__(self, title: str):
        self.title = title
        self._parts = [f"<h1>{escape(title)}</h1>"]
        self._sections: list[str] = []

    def section(self, title: str) -> None:
        self._sections.append(title)
        self._parts.append(f'<h2 id="section{len(self._sections)}">{escape(title)}</h2>')

    def heading(self, title: str) -> None:
        self._parts.append(f"<h3>{escape(title)}</h3>")

    def text(self, *sentences: str, advice: bool = False) -> None:
        kind = ' class="advice"' if advice else ""
        self._parts.append(f"<p{kind}>{'<br>'.join(escape(sentence) for sentence in sentences)}</p>")

    def raw(self, html: str) -> None:
        self._parts.append(f"<figure>{html}</figure>")

    def picture(self, address: str, caption: str) -> None:
        """caption : for who cannot see it"""
        self._parts.append(f'<figure><img src="{address}" alt="{escape(caption)}"></figure>')

    def table(self, rows: Iterable[Mapping[str, object]], columns: Mapping[str, str], folded: str = "") -> None:
        """columns : key -> heading.  folded : what a click unfolds, where the table is long"""
        rows = list(rows)
        if not rows:
            return
        texts = {key for key in columns if all(isinstance(row.get(key), (str, type(None))) for row in rows)}

        def cell(kind: str, key: str, text: str) -> str:
            style = ' class="text"' if key in texts else ""
            return f"<{kind}{style}>{escape(text)}</{kind}>"

        head = "".join(cell("th", key, title) for key, title in columns.items())
        body = ""
        for row in rows:
            style = ' class="front"' if row.get("front") else ""
            body += f"<tr{style}>" + "".join(cell("td", key, shown(row.get(key))) for key in columns) + "</tr>"
        table = f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'
        self._parts.append(f"<details><summary>{escape(folded)}</summary>{table}</details>" if folded else table)

    def html(self) -> str:
        links = " ".join(
            f'<a href="#section{i}">{escape(title)}</a>' for i, title in enumerate(self._sections, start=1)
        )
        body = "\n".join([self._parts[0], f"<nav>{links}</nav>", *self._parts[1:]])
        return (
            f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(self.title)}</title>'
            f"<style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n"
        )


def shown(value: object) -> str:
    """A value as a table shows it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    if isinstance(value, float):
        return _number(value)
    return str(value)


def _number(value: float) -> str:
    """Three digits, from 1 to 10 four (a camera at 2.001 M); no power of ten where a reader can do without."""
    if math.isnan(value):
        return "NaN"
    if value and not 1e-3 <= abs(value) < 1e7:
        digits, _, power = f"{value:.2e}".partition("e")
        return f"{digits.rstrip('0').rstrip('.')}e{int(power)}" if power else digits
    if abs(value) >= 1e3:
        return f"{value:.0f}"
    return f"{value:.4g}" if 1.0 <= abs(value) < 10.0 else f"{value:.3g}"
