"""Naive cut-and-paste: the baseline that petcomp has to beat.

It puts the same cut-outs on the same photos of the place with random positions, rotations and sizes: no
camera, no physics, no light. Sizes range from a tenth to four tenths of the picture's width, as if no real
sizes were known.
"""

import os
import tomllib

import cv2
import numpy as np
import OpenEXR

from . import files, reality

OBJECTS = (5, 15)
LENGTHS = (0.1, 0.4)
MIN_VISIBLE = 0.97
JPEG_QUALITY = 95


def generate(assets, backgrounds, count, seed, folder):
    cut_outs = load_cut_outs(assets)
    places = [load_place(path) for path in sorted(backgrounds.glob("*.jpg"))]
    for index in range(count):
        label = folder / f"labels/train/{index:06d}.txt"
        if not label.exists():
            rng = np.random.default_rng([seed, index])
            picture, rows = paste(rng, cut_outs, places)
            write_picture(folder / f"images/train/{index:06d}.jpg", picture)
            files.write_text(label, "".join(rows))


def load_cut_outs(assets):
    """Load `(class, premultiplied scene-linear RGBA)` of every photo."""
    manifest = tomllib.loads((assets / "assets.toml").read_text())
    return [
        (manifest["classes"].index(asset["class"]), load_rgba(assets / photo["file"]))
        for asset in manifest["assets"]
        for photo in asset["photos"]
    ]


def load_rgba(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.stack([channels[name].pixels.astype(np.float32) for name in "RGBA"], -1)


def load_place(path):
    photo = cv2.imread(str(path))[..., ::-1] / np.float32(255)
    return cv2.resize(linear(photo), reality.SIZE, interpolation=cv2.INTER_AREA)


def paste(rng, cut_outs, places):
    picture = places[rng.integers(len(places))].copy()
    if rng.random() < 0.5:
        picture = picture[:, ::-1].copy()
    masks, classes = [], []
    for _ in range(rng.integers(OBJECTS[0], OBJECTS[1] + 1)):
        kind, cut_out = cut_outs[rng.integers(len(cut_outs))]
        layer = placed(rng, cut_out, reality.SIZE)
        picture = layer[..., :3] + picture * (1 - layer[..., 3:])
        mask = layer[..., 3] > 0.1
        if mask.any():
            masks.append(mask)
            classes.append(kind)
    return picture, label_rows(masks, classes)


def placed(rng, cut_out, size):
    height, width = cut_out.shape[:2]
    scale = rng.uniform(*LENGTHS) * size[0] / max(width, height)
    turn = rng.uniform(0, 360)
    centre = rng.uniform(0, 1, 2) * size
    small = cv2.resize(cut_out, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    matrix = cv2.getRotationMatrix2D((small.shape[1] / 2, small.shape[0] / 2), turn, 1.0)
    matrix[:, 2] += centre - [small.shape[1] / 2, small.shape[0] / 2]
    return cv2.warpAffine(small, matrix, size, flags=cv2.INTER_LINEAR)


def label_rows(masks, classes):
    """YOLO rows of sufficiently visible objects; later ones lie on top."""
    width, height = reality.SIZE
    covered = np.zeros((height, width), bool)
    rows = []
    for mask, kind in reversed(list(zip(masks, classes))):
        seen = (mask & ~covered).sum() / mask.sum()
        covered |= mask
        if seen >= MIN_VISIBLE:
            rows.append(yolo_row(mask, kind))
    return rows[::-1]


def yolo_row(mask, kind):
    height, width = mask.shape
    across, down = np.flatnonzero(mask.any(0)), np.flatnonzero(mask.any(1))
    x0, x1, y0, y1 = across[0], across[-1] + 1, down[0], down[-1] + 1
    box = ((x0 + x1) / 2 / width, (y0 + y1) / 2 / height, (x1 - x0) / width, (y1 - y0) / height)
    return f"{kind} {' '.join(f'{v:.6f}' for v in box)}\n"


def write_picture(path, picture):
    path.parent.mkdir(parents=True, exist_ok=True)
    encoded = (srgb(np.clip(picture, 0, 1)) * 255 + 0.5).astype(np.uint8)
    part = path.with_suffix(".part.jpg")
    cv2.imwrite(str(part), encoded[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    os.replace(part, path)


def linear(v):
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb(v):
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * np.maximum(v, 1e-9) ** (1 / 2.4) - 0.055)
