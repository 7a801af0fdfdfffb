"""The report's files: the page, the records as JSON and CSV, diagrams, pictures, and a summary to compare."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from .compare import summarise
from .page import Page
from .plots import Diagram


def save(
    folder: Path,
    page: Page,
    environment: Mapping[str, str],
    lists: Mapping[str, list[dict]],
    diagrams: Mapping[str, Diagram],
    pictures: Mapping[str, bytes],
) -> Path:
    """The path of index.html. lists : records by list;  diagrams, pictures (PNG) : by name"""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {name: diagram.as_png() for name, diagram in diagrams.items()}
    for name, content in {**drawn, **pictures}.items():
        (folder / f"{name}.png").write_bytes(content)
    for name, diagram in diagrams.items():
        (folder / f"{name}.svg").write_text(diagram.as_svg(), encoding="utf-8")
    for name, rows in lists.items():
        if rows:
            _write_csv(folder / f"{name}.csv", rows)
    content = {"environment": environment, **lists}
    _write_json(folder / "report.json", content)
    _write_json(folder / "summary.json", summarise(content))
    index = folder / "index.html"
    index.write_text(page.html(), encoding="utf-8")
    return index


def file_name(title: str) -> str:
    return "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in title.lower()).strip("_")


def _write_csv(path: Path, rows: Sequence[dict]) -> None:
    keys = list(dict.fromkeys(key for row in rows for key in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, keys)
        writer.writeheader()
        writer.writerows(rows)


def _write_json(path: Path, content: object) -> None:
    """NaN becomes null: JSON has no other word for it."""
    path.write_text(json.dumps(_without_nan(content), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _without_nan(content: object) -> object:
    if isinstance(content, dict):
        return {key: _without_nan(value) for key, value in content.items()}
    if isinstance(content, list):
        return [_without_nan(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content
