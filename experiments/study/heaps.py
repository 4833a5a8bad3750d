"""Compares how bottles lie and how trays look in reality and in synthetic pictures.

    python -m study.heaps [--rooms 21,22] WORLD SYNTHETIC...

Prints a row for the piles of a world and one for each dataset folder: the positions of the bottles relative to
half the surface's width and height, how many are labelled, how many of these are tilted by more than 20 and 45
degrees, and the luma of the tray's floor: the share darker than 0.45 of its median, and its standard deviation
divided by its mean. Reality means the training pictures of the rooms used for choosing.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np

from . import reality

FAR = 0.6
DARK = 0.45
# Cosines of the tilts that count.
TILTS = np.cos(np.radians([20, 45]))
# The floor of a tray seen from straight above, pixels.
FLOOR = (160, 110)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rooms", default="21,22", help="comma-separated list (default 21,22)")
    parser.add_argument("world", type=Path)
    parser.add_argument("datasets", type=Path, nargs="*")
    options = parser.parse_args()
    print("| | pictures | mean abs(x) | mean abs(y) | x beyond 0.6 | y beyond 0.6 | labelled | in a picture | tilted by 20 | by 45 | dark | contrast |")
    print("| --- " * 12 + "|")
    piles = reality.training_piles(options.world, options.rooms.split(","))
    report("reality", [real_pile(pile, picture) for pile, picture in piles])
    for folder in options.datasets:
        report(folder.name, [synthetic_heap(path) for path in (folder / "scenes").rglob("*.json")])


def real_pile(pile, picture):
    """Return `(x, y, cosine of the tilt, labelled)` of each bottle, and the floor."""
    half = np.array(pile["tray"]["floor_m"]) / 2
    poses = [np.array(bottle["pose"]) for bottle in pile["bottles"]]
    bottles = [
        (*(pose[:2, 3] / half), pose[2, 2], bottle["unobstructed"]) for pose, bottle in zip(poses, pile["bottles"])
    ]
    return bottles, floor(picture, pile["tray"]["corners_px"])


def synthetic_heap(path):
    record = json.loads(path.read_text())
    scene = record["scene"]
    half = np.array(scene["surface"]["size"]) / 2
    # What went over the rim is in no picture.
    numbered = [(k, one["placement"]) for k, one in enumerate(scene["objects"], 1) if one["placement"] != "gone"]
    poses = [(k, placement["at"]) for k, placement in numbered]
    picture = Path(str(path).replace("/scenes/", "/images/")).with_suffix(".jpg")
    bottles = [
        (*(np.array(pose["translation"])[:2] / half), rotation(pose["rotation"])[2, 2], k in record["labelled"])
        for k, pose in poses
    ]
    return bottles, floor(picture, corners_px(scene["camera"]["known"], half))


def corners_px(camera, half):
    """Corners of a surface in the order of the world's: clockwise from the top left."""
    corners = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]]) * half
    pose = camera["camera_from_world"]
    seen = np.c_[corners, np.zeros(4)] @ rotation(pose["rotation"]).T + pose["translation"]
    return seen[:, :2] / seen[:, 2:] * camera["focal_px"] + camera["principal_px"]


def rotation(quaternion):
    x, y, z, w = quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def floor(picture, corners):
    """Luma of the floor, seen from straight above."""
    straight = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32) * np.array(FLOOR, np.float32)
    above = cv2.getPerspectiveTransform(np.array(corners, np.float32), straight)
    codes = cv2.cvtColor(cv2.imread(str(picture)), cv2.COLOR_BGR2GRAY)
    return cv2.warpPerspective(codes, above, FLOOR, flags=cv2.INTER_LINEAR).astype(float)


def report(name, pictures):
    x, y, upright, labelled = np.abs(np.array([row for bottles, _ in pictures for row in bottles], float)).T
    floors = [floor for _, floor in pictures]
    dark = np.mean([(floor < DARK * np.median(floor)).mean() for floor in floors])
    contrast = np.mean([floor.std() / floor.mean() for floor in floors])
    places = [x.mean(), y.mean(), (x > FAR).mean(), (y > FAR).mean()]
    tilted = [(upright[labelled > 0] < tilt).mean() for tilt in TILTS]
    cells = [*places, labelled.mean(), labelled.sum() / len(pictures), *tilted, dark, contrast]
    print(f"| {name} | {len(pictures)} | " + " | ".join(f"{cell:.2f}" for cell in cells) + " |")


if __name__ == "__main__":
    main()
