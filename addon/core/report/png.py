"""Pictures as PNG, with nothing but numpy and zlib: Blender's Python has no other way that needs no scene."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np


def encoded(pixels: np.ndarray) -> bytes:
    """pixels : uint8, (rows, columns, 3), row 0 at the bottom -> a PNG file's content (ISO/IEC 15948)."""
    rows, columns, _ = pixels.shape
    lines = np.zeros((rows, 1 + 3 * columns), np.uint8)  # each line begins with its filter: none
    lines[:, 1:] = pixels[::-1].reshape(rows, -1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)
    parts = (chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(lines.tobytes(), 6)), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def as_data(content: bytes) -> str:
    """A PNG as an address that a page can hold in itself."""
    return "data:image/png;base64," + base64.b64encode(content).decode("ascii")
