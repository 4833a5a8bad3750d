"""What detectors found, beside `results.csv`: results outlive the cache, and join those of other machines."""

import csv

import numpy as np

from . import score

FILE = "matches.npz"


def write(folder, matches):
    """Whose picture each detection is (surest first), at which IoUs it is right, and how many true boxes there are."""
    arrays = {}
    for arm, seeds in matches.items():
        for seed, rooms in seeds.items():
            for room, classes in rooms.items():
                for k, one in enumerate(classes):
                    arrays |= packed(f"{arm}/{seed}/{room}/{k}", one)
    np.savez_compressed(folder / FILE, **arrays)


def packed(name, one):
    return {
        f"{name}/picture": one.picture.astype(np.uint16),
        f"{name}/right": np.packbits(one.right, axis=1),
        f"{name}/truths": one.truths.astype(np.uint16),
    }


def read(folder):
    """Rows and matches by arm and seed."""
    known = {}
    if not (folder / FILE).exists():
        return known
    for name, one in unpacked(np.load(folder / FILE)).items():
        arm, seed, room, _ = name.split("/")
        _, rooms = known.setdefault((arm, int(seed)), ([], {}))
        rooms.setdefault(room, []).append(one)
    with open(folder / "results.csv", newline="") as file:
        for row in csv.DictReader(file):
            row |= {"seed": int(row["seed"]), "room": int(row["room"]), "cpu_seconds": float(row["cpu_seconds"])}
            known.get((row["arm"], row["seed"]), ([], {}))[0].append(row)
    return known


def unpacked(arrays):
    names = [name.removesuffix("/truths") for name in arrays if name.endswith("/truths")]
    return {
        name: score.Matches(
            arrays[f"{name}/picture"].astype(int),
            np.unpackbits(arrays[f"{name}/right"], axis=1, count=len(score.IOUS)).astype(bool),
            arrays[f"{name}/truths"].astype(float),
        )
        for name in names
    }
