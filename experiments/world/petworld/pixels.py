"""Writing pictures and records."""

import json
import re

import cv2
import numpy as np


def srgb_encode(x):
    """Linear to sRGB, clipped to 0..1."""
    x = np.clip(x, 0.0, 1.0)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * np.power(np.maximum(x, 1e-9), 1 / 2.4) - 0.055)


def to_u8(x):
    return np.floor(np.clip(x, 0, 1) * 255 + 0.5).astype(np.uint8)


def write_png(path, a):
    """Write 8-bit grey (h, w) or RGB (h, w, 3)."""
    cv2.imwrite(path, a if a.ndim == 2 else a[..., ::-1])


def write_json(path, record):
    """Write indented JSON with lists of plain values on one line."""
    text = json.dumps(record, indent=1)
    text = re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda m: "[" + re.sub(r"\s*\n\s*", " ", m.group(1)) + "]", text)
    with open(path, "w") as f:
        f.write(text + "\n")
