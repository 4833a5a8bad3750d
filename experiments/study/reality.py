"""The pictures that stand for reality, and what a user would have of the place: see `world/make.py`."""

import json
import random
import shutil

import cv2
import numpy as np

from . import files

SIZE = (480, 360)
# How well a person clicks on a corner, pixels.
CLICK_SIGMA_PX = 1.0
# Share of light that white paper reflects, as docs/label.md tells users.
PAPER_ALBEDO = 0.8
LUMINANCE = (0.2126, 0.7152, 0.0722)
# Ten pixels on either side of an edge.
EDGE = np.ones((21, 21), np.uint8)
# How well a person measures the thickness of a crumpled thing, metres.
THICKNESS_STEP = 0.005


def pictures(world, room, name, count):
    """Full paths of the first pictures of a set."""
    known = found(world, room, name, count)
    if len(known) < count:
        raise SystemExit(f"{world}/room{room}/{name}: {len(known)} pictures, expected {count}")
    return known


def found(world, room, name, count):
    """Full paths of the first pictures of a set, as far as they are rendered."""
    return [str(path) for path in sorted((world / f"room{room}/{name}/piles/images").glob("*.jpg"))[:count]]


def label_counts(pictures):
    return [len(files.label_of(picture).read_text().splitlines()) for picture in pictures]


def training_piles(world, rooms):
    """What is true of every training picture of some rooms, and the picture."""
    for room in rooms:
        folder = world / f"room{room}/real/piles"
        found = sorted(folder.glob("truth/*.json"))
        if not found:
            raise SystemExit(f"{folder}: no piles")
        yield from ((json.loads(path.read_text()), folder / f"images/{path.stem}.jpg") for path in found)


def truth(world, room, count, classes, folder):
    """Write YOLO labels of the test pictures of a room, unchanged or all with one class."""
    for picture in pictures(world, room, "test", count):
        files.write_text(folder / files.label_of(picture).name, labels(picture, classes))
    return folder


def labels(picture, classes):
    """YOLO labels of a picture, unchanged or all with one class."""
    rows = [line.split() for line in files.label_of(picture).read_text().splitlines()]
    return "".join(" ".join(["0" if classes == 1 else row[0], *row[1:]]) + "\n" for row in rows)


def photo_list(world, count, cut_out, thickness, others, folder):
    """Write the list of photos of a user: class, and length by tape measure; and if it is not 0, this share of
    the thickness that a tape measure says for the bottle. `others` are entries of photos that do not show bottles."""
    lines = [f"classes = {json.dumps(files.CLASSES)}\n"]
    if cut_out:
        lines += ["[cut_out]\n", *(f"{key} = {json.dumps(value)}\n" for key, value in cut_out.items())]
    for index in range(count):
        bottle = json.loads((world / f"photos/bottles/b{index:04d}.json").read_text())
        body = thickness_line(bottle["photos"], thickness)
        lines += [entry(world, bottle["instance"]["index"], photo) + body for photo in bottle["photos"]]
    return files.write_text(folder / "photos.toml", "\n".join(lines + others))


def entry(world, index, photo):
    size = photo["size_m"]
    length = round(max(size["length"], size["width"]), 3)
    return (
        "[[photos]]\n"
        f"file = {json.dumps(str(world / 'photos/bottles' / photo['files']['photo_png']))}\n"
        f'asset = "b{index:04d}"\n'
        f'class = "{files.CLASSES[photo["class_id"]]}"\n'
        f"length = {length}\n"
    )


def thickness_line(photos, share):
    if not share:
        return ""
    measured = np.mean([photo["size_m"]["thickness"] for photo in photos])
    return f"thickness = {share * round(measured / THICKNESS_STEP) * THICKNESS_STEP:.4f}\n"


def backgrounds(world, rooms, measured, folder):
    """Write photos of the empty trays, with four corners clicked by hand and what else was `measured`."""
    for room in rooms:
        albedo = measured_albedo(world, room, measured)
        for path in sorted((world / f"room{room}/backgrounds").glob("*.json")):
            photo = json.loads(path.read_text())
            name = f"room{room}_{photo['name']}"
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path.with_suffix(".jpg"), folder / f"{name}.jpg")
            files.write_json(folder / f"{name}.label.json", plane_label(photo, name, room, albedo))
    return folder


def plane_label(photo, name, room, albedo):
    rng = random.Random(name)
    camera, tray = photo["camera"], photo["tray"]
    corners = [[round(v + rng.gauss(0, CLICK_SIGMA_PX), 1) for v in corner] for corner in tray["corners_px"]]
    return {
        "format": "plane-label",
        "version": 1,
        "image": {"file": f"{name}.jpg", "width": camera["width"], "height": camera["height"], "cropped": False},
        "surface": {
            "id": f"tray{room}",
            "width_m": tray["floor_m"][0],
            "height_m": tray["floor_m"][1],
            "corners_px": corners,
            **albedo,
        },
        # As EXIF tells it: a whole number of millimetres.
        "camera": {"id": name, "focal_35mm": round(camera["fx"] / camera["width"] * 36)},
    }


def measured_albedo(world, room, measured):
    """Albedo of a place, as luminance or colour, measured once in a photo with a sheet of white paper."""
    if not measured:
        return {}
    path = world / f"room{room}/paper/backgrounds/bg0000.json"
    photo = json.loads(path.read_text())
    linear = linear_picture(path.with_suffix(".jpg"))
    is_paper = inside(photo["paper_px"], linear.shape)
    is_surface = inside(photo["tray"]["corners_px"], linear.shape) & ~is_paper
    # The sheet's edge belongs to neither.
    is_surface &= ~dilated(is_paper)
    surface, paper = (np.median(linear[where], axis=0) for where in (is_surface, eroded(is_paper)))
    if measured == "luminance":
        return {"albedo": round(PAPER_ALBEDO * float(surface @ LUMINANCE / (paper @ LUMINANCE)), 3)}
    return {"albedo": [round(PAPER_ALBEDO * float(ratio), 3) for ratio in surface / paper]}


def linear_picture(path):
    """Read a picture as scene-linear RGB."""
    display = cv2.imread(str(path))[..., ::-1] / 255
    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)


def inside(corners, shape):
    mask = np.zeros(shape[:2], np.uint8)
    return cv2.fillConvexPoly(mask, np.round(corners).astype(np.int32), 1) > 0


def dilated(mask):
    return cv2.dilate(mask.astype(np.uint8), EDGE) > 0


def eroded(mask):
    return cv2.erode(mask.astype(np.uint8), EDGE) > 0
