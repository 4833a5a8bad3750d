"""How bottles lie in reality and in synthetic pictures.

    python -m study.heaps [--rooms 21,22] WORLD SYNTHETIC...

A line each for the piles of a world and for folders of datasets: where their bottles are, as shares of
half the surface's width and height, and how many of them are labelled. Of reality it takes the pictures
for training, of the rooms for choosing.
"""

import argparse
import json
from pathlib import Path

import numpy as np

FAR = 0.6


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rooms", default="21,22", help="comma list (default 21,22)")
    parser.add_argument("world", type=Path)
    parser.add_argument("datasets", type=Path, nargs="*")
    options = parser.parse_args()
    folders = [options.world / f"room{room}/real/piles/truth" for room in options.rooms.split(",")]
    print("| | pictures | mean abs(x) | mean abs(y) | x beyond 0.6 | y beyond 0.6 | labelled | in a picture |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    report("reality", [real_pile(path) for folder in folders for path in folder.glob("*.json")])
    for folder in options.datasets:
        report(folder.name, [synthetic_heap(path) for path in (folder / "scenes").rglob("*.json")])


def real_pile(path):
    """`(x, y, labelled)` of each bottle."""
    pile = json.loads(path.read_text())
    half = np.array(pile["tray"]["floor_m"]) / 2
    poses = [np.array(bottle["pose"])[:2, 3] / half for bottle in pile["bottles"]]
    return [(*place, bottle["unobstructed"]) for place, bottle in zip(poses, pile["bottles"])]


def synthetic_heap(path):
    record = json.loads(path.read_text())
    half = np.array(record["scene"]["surface"]["size"]) / 2
    # What went over the rim is in no picture.
    numbered = [(k, one["placement"]) for k, one in enumerate(record["scene"]["objects"], 1) if one["placement"] != "gone"]
    places = [(k, np.array(placement["at"]["translation"])[:2] / half) for k, placement in numbered]
    return [(*place, k in record["labelled"]) for k, place in places]


def report(name, pictures):
    x, y, labelled = np.abs(np.array([row for picture in pictures for row in picture], float)).T
    cells = [x.mean(), y.mean(), (x > FAR).mean(), (y > FAR).mean(), labelled.mean(), labelled.sum() / len(pictures)]
    print(f"| {name} | {len(pictures)} | " + " | ".join(f"{cell:.2f}" for cell in cells) + " |")


if __name__ == "__main__":
    main()
