"""How much of its training pictures a detector knows by heart: mAP@0.5:0.95 on 60 real and 60 synthetic ones of them.

    python -m study.by_heart TRAINING...

A TRAINING is a folder `cache/STUDY/runs/ARM/SEED`. Compare with the score on test pictures in `results/`.
Ultralytics keeps its settings in `YOLO_CONFIG_DIR`, or else in the home folder.
"""

import argparse
import json
import shutil
from pathlib import Path

from . import files, reality, score, train
from .train import Model  # noqa: F401 - checkpoints name it by the module that trained them

PICTURES = 60


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("trainings", type=Path, nargs="+")
    print("| trained on | real | synthetic |")
    print("| --- " * 3 + "|")
    for folder in parser.parse_args().trainings:
        training = json.loads((folder / "training.json").read_text())
        scores = [own_score(folder, training, source) for source in ("real", "synthetic")]
        print(f"| {'/'.join(folder.parts[-2:])} | " + " | ".join(scores) + " |", flush=True)


def own_score(folder, training, source):
    """mAP@0.5:0.95 on pictures of a source, evenly spread; nothing for a source without pictures."""
    pictures = training[source][:: max(len(training[source]) // PICTURES, 1)][:PICTURES]
    if not pictures:
        return ""
    own, found = folder / "by_heart" / source, folder / "by_heart" / f"{source}_found"
    copies = [copied(Path(picture), own / "images" / f"{k}.jpg", training) for k, picture in enumerate(pictures)]
    train.predict(training, folder / "detector/weights/last.pt", copies, found)
    (_, score_of_all), _ = score.coco_evaluation(found, own / "labels", reality.SIZE, training["classes"])
    return f"{score_of_all:.3f}"


def copied(picture, copy, training):
    """A copy of a picture and its labels: pictures of different rooms have the same names."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(picture, copy)
    files.write_text(files.label_of(copy), reality.labels(picture, training["classes"]))
    return str(copy)


if __name__ == "__main__":
    main()
