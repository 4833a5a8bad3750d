"""Replaces `train.py` if PyTorch is missing: writes boxes near the true ones, to test everything around a
training.

    python -m study.stand_in TRAINING.json
"""

import json
import random
import sys
from pathlib import Path

from . import files

# Standard deviation of a box's place and sides, shares of the picture.
SIGMA = 0.01


def main(path):
    training = json.loads(path.read_text())
    rng = random.Random(training["seed"])
    for room, pictures in training["test"].items():
        for picture in pictures:
            rows = [row(rng, line.split(), training["classes"]) for line in truth_lines(picture)]
            files.write_text(path.parent / f"predictions/{room}/{Path(picture).stem}.txt", "".join(rows))
    files.write_json(path.with_suffix(".done.json"), {"cpu_seconds": 0, "ultralytics": "", "torch": ""})


def truth_lines(picture):
    return files.label_of(picture).read_text().splitlines()


def row(rng, words, classes):
    box = [max(float(word) + rng.gauss(0, SIGMA), SIGMA) for word in words[1:]]
    kind = words[0] if classes > 1 else 0
    return f"{kind} {' '.join(f'{v:.6f}' for v in box)} {rng.random():.6f}\n"


if __name__ == "__main__":
    main(Path(sys.argv[1]))
