"""Which bottles a detector finds: recall on real training pictures, by what is known of the bottles.

    python -m study.recall [--rooms 21,22] WORLD TRAINING...

A TRAINING is a folder in `cache/STUDY/runs/ARM/` that used no real pictures. Counts the bottles with a label that one
of the surest detections finds (IoU 0.5), of which there are as many as labels; each detection finds one bottle.
"""

import argparse
import json
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np

from . import files, reality, score, train
from .train import Model  # noqa: F401 - checkpoints name it by the module that trained them

TILTS = (0, 20, 45, 90)
IOU = 0.5


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rooms", default="21,22", help="comma-separated list (default 21,22)")
    parser.add_argument("world", type=Path)
    parser.add_argument("trainings", type=Path, nargs="+")
    options = parser.parse_args()
    rooms = options.rooms.split(",")
    columns = [of_training(folder, options.world, rooms) for folder in options.trainings]
    names = ["/".join(folder.parts[-2:]) for folder in options.trainings]
    print("| bottles | number | " + " | ".join(names) + " |")
    print("| --- " * (2 + len(names)) + "|")
    for kind in sorted(columns[0]):
        shares = [f"{np.mean(column[kind]):.2f}" for column in columns]
        print(f"| {kind} | {len(columns[0][kind])} | " + " | ".join(shares) + " |")


def of_training(folder, world, rooms):
    """Whether each bottle is found, by kind."""
    training = json.loads((folder / "training.json").read_text())
    pictures = {}
    for room in rooms:
        found = folder / f"recall/{room}"
        named = reality.pictures(world, room, "real", training_pictures(world, room))
        train.predict(training, folder / "detector/weights/last.pt", named, found)
        pictures |= {path: list(score.rows(found / f"{Path(path).stem}.txt", reality.SIZE)) for path in named}
    labels = sum(len(files.label_of(path).read_text().splitlines()) for path in pictures)
    surest = sorted((row[2] for rows in pictures.values() for row in rows), reverse=True)[:labels]
    kinds = defaultdict(list)
    for path, rows in pictures.items():
        for kind, is_found in bottles(Path(path), [box for _, box, confidence in rows if confidence >= surest[-1]]):
            kinds[kind].append(is_found)
    return kinds


def training_pictures(world, room):
    return len(list((world / f"room{room}/real/piles/images").glob("*.jpg")))


def bottles(path, boxes):
    """Yield each kind of each bottle with a label, and whether one of the boxes, surest first, finds it."""
    pile = json.loads((path.parents[1] / f"truth/{path.stem}.json").read_text())
    left = [bottle for bottle in pile["bottles"] if bottle["unobstructed"]]
    for box in boxes:
        overlap, bottle = max(((iou(box, one["amodal_box_px"]), k) for k, one in enumerate(left)), default=(0, 0))
        if overlap >= IOU:
            yield from ((kind, True) for kind in kinds_of(left.pop(bottle), pile))
    yield from ((kind, False) for bottle in left for kind in kinds_of(bottle, pile))


def kinds_of(bottle, pile):
    tilt = np.degrees(np.arccos(min(abs(bottle["pose"][2][2]), 1)))
    low, high = next((low, high) for low, high in pairwise(TILTS) if tilt <= high)
    return "all", f"tilt: {low} to {high} degrees", f"light: {pile['light']}", f"colour: {bottle['colour']}"


def iou(box, corners):
    x, y, w, h = box
    left, top, right, bottom = corners
    shared = np.clip([min(x + w, right) - max(x, left), min(y + h, bottom) - max(y, top)], 0, None).prod()
    return shared / (w * h + (right - left) * (bottom - top) - shared)


if __name__ == "__main__":
    main()
