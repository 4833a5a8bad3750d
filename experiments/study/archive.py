"""Detections stored next to `results.csv`: results outlive the cache and join those of other machines."""

import csv
import io

import numpy as np

from . import files, score

FILE = "matches.npz"


def write(folder, matches):
    """Write the picture of each detection (surest first), the IoUs at which it is right, and the true box counts."""
    arrays = {}
    for arm, seeds in matches.items():
        for seed, rooms in seeds.items():
            for room, classes in rooms.items():
                for k, one in enumerate(classes):
                    arrays |= packed(f"{arm}/{seed}/{room}/{k}", one)
    packed_arrays = io.BytesIO()
    np.savez_compressed(packed_arrays, **arrays)
    files.write_bytes(folder / FILE, packed_arrays.getvalue())


def packed(name, one):
    return {
        f"{name}/picture": one.picture.astype(np.uint16),
        f"{name}/right": np.packbits(one.right, axis=1),
        f"{name}/truths": one.truths.astype(np.uint16),
    }


def read(folder):
    """Read rows and matches by arm and seed."""
    known = {}
    if not (folder / FILE).exists():
        return known
    for name, one in unpacked(np.load(folder / FILE)).items():
        arm, seed, room, _ = name.split("/")
        _, rooms = known.setdefault((arm, int(seed)), ([], {}))
        rooms.setdefault(room, []).append(one)
    for row in rows(folder):
        known.get((row["arm"], row["seed"]), ([], {}))[0].append(row)
    return known


def rows(folder):
    """Rows of `results.csv`, if it exists."""
    path = folder / "results.csv"
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return [row | numbers(row) for row in csv.DictReader(file)]


def numbers(row):
    return {key: int(row[key]) for key in ("seed", "room", "pictures")} | {"cpu_seconds": float(row["cpu_seconds"])}


def tested(matches):
    """Number of labels in each test picture, by room."""
    return {int(room): sum(one.truths for one in classes).tolist() for room, classes in matches.items()}


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
