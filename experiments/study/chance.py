"""Random variation of trainings: how much those of an arm vary if only the seed differs.

    python -m study.chance results/first_rooms results/few_real
"""

import sys
from pathlib import Path

import numpy as np

from . import archive


def main(folders):
    arms = of_folders(folders)
    if not arms:
        raise SystemExit(f"{', '.join(map(str, folders))}: no arm with several seeds")
    for name, scores in arms.items():
        print(said(name, [scores]))
    print(said("all of them", arms.values()))
    shared, own = components(arms.values())
    print(f"in all rooms alike {shared:.4f}, in each room by itself {own:.4f}")


def said(name, arms):
    return f"{name}: relative standard deviation {pooled(over_rooms(arms)):.4f}, {freedom(arms)} degrees of freedom"


def of_folders(folders):
    """The scores of `of_seeds` in several results, by folder and arm."""
    return {
        f"{folder.name}: {arm}": scores
        for folder in folders
        for arm, scores in of_seeds(archive.rows(folder)).items()
    }


def of_seeds(rows):
    """mAP@0.5:0.95 by arm, for arms with several seeds: seeds x rooms."""
    scores = {}
    for row in rows:
        scores.setdefault(row["arm"], {}).setdefault(row["seed"], []).append(float(row["map50_95"]))
    return {arm: np.array(list(seeds.values())) for arm, seeds in scores.items() if len(seeds) > 1}


def components(arms):
    """Relative standard deviations between the seeds of an arm: what all rooms share, and what each has beside it."""
    rooms = next(iter(arms)).shape[1]
    of_mean = pooled(over_rooms(arms)) ** 2
    of_room = pooled([scores[:, [room]] for scores in arms for room in range(rooms)]) ** 2
    own = (of_room - of_mean) * rooms / (rooms - 1)
    return np.sqrt(np.maximum([of_mean - own / rooms, own], 0))


def over_rooms(arms):
    return [scores.mean(1, keepdims=True) for scores in arms]


def pooled(arms):
    """Relative standard deviation between the seeds of an arm."""
    squares = sum(np.sum((scores / scores.mean() - 1) ** 2) for scores in arms)
    return np.sqrt(squares / freedom(arms))


def freedom(arms):
    return sum(len(scores) - 1 for scores in arms)


if __name__ == "__main__":
    main([Path(folder) for folder in sys.argv[1:]])
