"""Which bottles a detector finds: recall on real training pictures, by what is known of the bottles.

    python -m study.recall [--rooms 21,22] WORLD TRAINING...

A TRAINING is a folder in `cache/STUDY/runs/ARM/` that used no real pictures. Counts the bottles with a label that one
of the surest detections finds (IoU 0.5), of which there are as many as labels; each detection finds one bottle.
Ultralytics keeps its settings in `YOLO_CONFIG_DIR`, or else in the home folder.
"""

import argparse
import json
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np
from pycocotools import mask

from . import reality, score, train
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
    piles = [one for room in rooms for one in detected_piles(folder, world, room)]
    labels = sum(len(labelled(pile)) for pile, _ in piles)
    least = sorted((confidence for _, rows in piles for *_, confidence in rows), reverse=True)[:labels][-1]
    kinds = defaultdict(list)
    for pile, rows in piles:
        for kind, is_found in bottles(pile, [box for _, box, confidence in rows if confidence >= least]):
            kinds[kind].append(is_found)
    return kinds


def detected_piles(folder, world, room):
    """The training piles of a room, each with the rows of the detector."""
    training, found = json.loads((folder / "training.json").read_text()), folder / f"recall/{room}"
    piles = list(reality.training_piles(world, [room]))
    train.predict(training, folder / "detector/weights/last.pt", [str(picture) for _, picture in piles], found)
    return [(pile, list(score.rows(found / f"{picture.stem}.txt", reality.SIZE))) for pile, picture in piles]


def labelled(pile):
    return [bottle for bottle in pile["bottles"] if bottle["unobstructed"]]


def bottles(pile, boxes):
    """Yield each kind of each bottle with a label, and whether one of the boxes, surest first, finds it."""
    left = labelled(pile)
    for box in boxes:
        overlaps = [mask.iou([box], [xywh(bottle["amodal_box_px"])], [0]).item() for bottle in left]
        if max(overlaps, default=0) >= IOU:
            yield from ((kind, True) for kind in kinds_of(left.pop(int(np.argmax(overlaps))), pile))
    yield from ((kind, False) for bottle in left for kind in kinds_of(bottle, pile))


def kinds_of(bottle, pile):
    tilt = np.degrees(np.arccos(min(abs(bottle["pose"][2][2]), 1)))
    low, high = next((low, high) for low, high in pairwise(TILTS) if tilt <= high)
    return "all", f"tilt: {low} to {high} degrees", f"light: {pile['light']}", f"colour: {bottle['colour']}"


def xywh(corners):
    left, top, right, bottom = corners
    return [left, top, right - left, bottom - top]


if __name__ == "__main__":
    main()
