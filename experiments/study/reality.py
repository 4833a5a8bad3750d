"""The pictures that play reality, and what a user would have of the place: see `world/make.py`."""

import json
import random
import shutil

from . import files

SIZE = (480, 360)
# How well a person clicks on a corner, pixels.
CLICK_SIGMA_PX = 1.0
# How well a person measures the reflectance of a surface beside a sheet of white paper, as a share of it.
ALBEDO_SIGMA = 0.1
# How well a person measures the thickness of a crumpled thing, metres.
THICKNESS_STEP = 0.005


def pictures(world, room, name, count):
    """The first pictures of a set, whole names."""
    folder = world / f"room{room}" / name / "piles"
    found = sorted((folder / "images").glob("*.jpg"))[:count]
    if len(found) < count:
        raise SystemExit(f"{folder}: {len(found)} pictures, expected {count}")
    return [str(path) for path in found]


def truth(world, room, count, classes, folder):
    """YOLO labels of the test pictures of a room, as they are or all of one class."""
    for picture in pictures(world, room, "test", count):
        label = files.label_of(picture)
        rows = [line.split() for line in label.read_text().splitlines()]
        lines = [" ".join(["0" if classes == 1 else row[0], *row[1:]]) + "\n" for row in rows]
        files.write_text(folder / label.name, "".join(lines))
    return folder


def photo_list(world, count, cut_out, has_thickness, folder):
    """What a user writes of the photos of bottles: class, and by a tape measure the length and, if
    asked for, the thickness."""
    lines = [f"classes = {json.dumps(files.CLASSES)}\n"]
    if cut_out:
        lines += ["[cut_out]\n", *(f"{key} = {json.dumps(value)}\n" for key, value in cut_out.items())]
    for index in range(count):
        bottle = json.loads((world / f"photos/bottles/b{index:04d}.json").read_text())
        lines += [entry(world, bottle["instance"]["index"], photo, has_thickness) for photo in bottle["photos"]]
    return files.write_text(folder / "photos.toml", "\n".join(lines))


def entry(world, index, photo, has_thickness):
    size = photo["size_m"]
    length = round(max(size["length"], size["width"]), 3)
    thickness = f"thickness = {round(size['thickness'] / THICKNESS_STEP) * THICKNESS_STEP:.3f}\n" if has_thickness else ""
    return (
        "[[photos]]\n"
        f"file = {json.dumps(str(world / 'photos/bottles' / photo['files']['photo_png']))}\n"
        f'asset = "b{index:04d}"\n'
        f'class = "{files.CLASSES[photo["class_id"]]}"\n'
        f"length = {length}\n"
        f"{thickness}"
    )


def backgrounds(world, rooms, has_albedo, folder):
    """Photos of the empty trays, with four corners that a person clicked on."""
    for room in rooms:
        for path in sorted((world / f"room{room}/backgrounds").glob("*.json")):
            photo = json.loads(path.read_text())
            name = f"room{room}_{photo['name']}"
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path.with_suffix(".jpg"), folder / f"{name}.jpg")
            files.write_json(folder / f"{name}.label.json", plane_label(photo, name, room, has_albedo))
    return folder


def plane_label(photo, name, room, has_albedo):
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
            **measured_albedo(tray, room, has_albedo),
        },
        # As EXIF tells it: a whole number of millimetres.
        "camera": {"id": name, "focal_35mm": round(camera["fx"] / camera["width"] * 36)},
    }


def measured_albedo(tray, room, has_albedo):
    """Of each place once."""
    if not has_albedo:
        return {}
    return {"albedo": round(tray["albedo"] * (1 + random.Random(room).gauss(0, ALBEDO_SIGMA)), 3)}
