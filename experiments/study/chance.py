"""Random variation of trainings: how much those of an arm vary if only the seed differs.

    python -m study.chance results/first_rooms
"""

import sys
from pathlib import Path

import numpy as np

from . import archive


def main(folder):
    seeds = of_seeds(archive.rows(folder))
    if not seeds:
        raise SystemExit(f"{folder / 'results.csv'}: no arm with several seeds")
    for arm, scores in seeds.items():
        print(said(arm, *pooled([scores])))
    print(said("all of them", *pooled(seeds.values())))


def said(name, deviation, freedom):
    return f"{name}: relative standard deviation {deviation:.4f}, {freedom} degrees of freedom"


def of_seeds(rows):
    """mAP@0.5:0.95 of each seed, mean over rooms, by arm, for arms with several seeds."""
    scores = {}
    for row in rows:
        scores.setdefault(row["arm"], {}).setdefault(row["seed"], []).append(float(row["map50_95"]))
    return {arm: np.mean(list(seeds.values()), 1) for arm, seeds in scores.items() if len(seeds) > 1}


def pooled(arms):
    """Relative standard deviation between the seeds of an arm, and its degrees of freedom."""
    freedom = sum(len(scores) - 1 for scores in arms)
    squares = sum(np.sum((scores / scores.mean() - 1) ** 2) for scores in arms)
    return np.sqrt(squares / freedom), freedom


if __name__ == "__main__":
    main(Path(sys.argv[1]))
