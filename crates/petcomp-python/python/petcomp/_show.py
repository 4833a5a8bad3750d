"""Images and tables for notebooks."""

from __future__ import annotations

import base64
import html
import struct
import zlib
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["image_tag", "png", "shown", "table"]

#: Larger images are shown reduced.
_LONGEST_SIDE = 1024


def png(codes: npt.NDArray[np.uint8]) -> bytes:
    """Encode an 8-bit image (height x width, or with 3 or 4 channels) as PNG."""
    codes = np.ascontiguousarray(codes)
    height, width = codes.shape[:2]
    kind = {1: 0, 3: 2, 4: 6}[1 if codes.ndim == 2 else codes.shape[2]]
    rows = codes.reshape(height, -1)
    filtered = np.concatenate([np.zeros((height, 1), np.uint8), rows], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, data) for name, data in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def shown(image: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Encode a scene-linear, premultiplied image for display, over black."""
    if image.dtype == np.uint8:
        return image
    if image.ndim == 2:
        return _codes(np.clip(image, 0, 1))
    light = np.clip(image[..., :3], 0, 1)
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return _codes(curve)


def _codes(values: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    codes: npt.NDArray[np.uint8] = np.round(255 * values).astype(np.uint8)
    return codes


def image_tag(codes: npt.NDArray[np.uint8]) -> str:
    """Return an HTML tag that embeds the image."""
    step = max(1, -(-max(codes.shape[:2]) // _LONGEST_SIDE))
    data = base64.b64encode(png(codes[::step, ::step])).decode()
    return f'<img src="data:image/png;base64,{data}">'


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table."""
    lines = [_row("th", head), *(_row("td", row) for row in rows)]
    return f"<table>{''.join(lines)}</table>"


def _row(tag: str, cells: Sequence[object]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(str(cell))}</{tag}>' for cell in cells)}</tr>"
