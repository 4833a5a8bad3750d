"""Average precision of a detector, and the data for its intervals.

The scores come from `petcomp eval`; pycocotools confirms them and provides the matches. From these the
bootstrap computes the score of any other selection of pictures.
"""

import contextlib
import io
import json
from dataclasses import dataclass

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from . import bootstrap, files

IOUS = np.linspace(0.5, 0.95, 10)
RECALLS = np.linspace(0, 1, 101)
# What two programs of one definition may differ by.
TOLERANCE = 1e-6


@dataclass
class Matches:
    """Matches of one class: for each detection, highest confidence first, its picture and the IoUs at
    which it is right; and the number of true boxes in each picture."""

    picture: np.ndarray
    right: np.ndarray
    truths: np.ndarray

    def average_precision(self, times):
        """Average precision at each IoU if picture k occurs `times[k]` times."""
        total = self.truths @ times
        if total == 0:
            return None
        weight = times[self.picture][:, None]
        right = np.cumsum(self.right * weight, 0)
        wrong = np.cumsum(~self.right * weight, 0)
        precision = right / np.maximum(right + wrong, np.finfo(float).eps)
        precision = np.maximum.accumulate(precision[::-1], 0)[::-1]
        return np.array([sampled(right[:, k] / total, precision[:, k]) for k in range(len(IOUS))])


def sampled(recall, precision):
    at = np.searchsorted(recall, RECALLS, side="left")
    return np.append(precision, 0.0)[at].mean()


def score(study, predictions, truth, size, classes, folder):
    """mAP@0.5 and mAP@0.5:0.95, and the matches of each class."""
    names = ["bottle"] if classes == 1 else files.CLASSES
    study.petcomp(
        "eval", predictions, truth, "--size", f"{size[0]}x{size[1]}", "--classes", ",".join(names),
        "--rounds", 0, "-n", 0, "-o", folder,
    )
    ours = mean_precision(json.loads((folder / "metrics.json").read_text())["coco"]["scores"])
    theirs, matches = coco_evaluation(predictions, truth, size, classes)
    own = bootstrap.map_of(matches, np.ones_like(matches[0].truths))
    check_equal(predictions, "mAP@0.5", {"petcomp": ours[0], "pycocotools": theirs[0]})
    check_equal(predictions, "mAP@0.5:0.95", {"petcomp": ours[1], "pycocotools": theirs[1], "the bootstrap": own})
    return ours, matches


def check_equal(predictions, name, scores):
    values = list(scores.values())
    if max(values) - min(values) > TOLERANCE:
        said = ", ".join(f"{value} by {program}" for program, value in scores.items())
        raise SystemExit(f"{predictions}: {name} is {said}")


def mean_precision(metrics):
    """mAP@0.5 and mAP@0.5:0.95 over the classes that occur."""
    of_classes = [one["ap"] for one in metrics["classes"] if one["truths"]]
    return np.mean([values[0] for values in of_classes]), np.mean(of_classes)


def coco_evaluation(predictions, truth, size, classes):
    pictures = sorted(path.stem for path in truth.glob("*.txt"))
    boxes = [(k, row) for k, name in enumerate(pictures) for row in rows(truth / f"{name}.txt", size)]
    found = [(k, row) for k, name in enumerate(pictures) for row in rows(predictions / f"{name}.txt", size)]
    document = {
        "images": [{"id": k, "width": size[0], "height": size[1]} for k in range(len(pictures))],
        "categories": [{"id": k} for k in range(classes)],
        "annotations": [
            {"id": k + 1, "image_id": image, "category_id": c, "bbox": box, "area": box[2] * box[3], "iscrowd": 0}
            for k, (image, (c, box, _)) in enumerate(boxes)
        ],
    }
    detections = [
        {"image_id": image, "category_id": c, "bbox": box, "score": confidence}
        for image, (c, box, confidence) in found
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO()
        coco.dataset = document
        coco.createIndex()
        evaluation = COCOeval(coco, coco.loadRes(detections) if detections else COCO(), "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    matches = [class_matches(evaluation, k, len(pictures)) for k in range(classes)]
    return (evaluation.stats[1], evaluation.stats[0]), matches


def rows(path, size):
    """Yield `(class, [x, y, width, height], confidence)` of each row, in pixels."""
    lines = [line.split() for line in path.read_text().splitlines()] if path.exists() else []
    for c, x, y, w, h, *confidence in lines:
        w, h = float(w) * size[0], float(h) * size[1]
        corner = [float(x) * size[0] - w / 2, float(y) * size[1] - h / 2]
        yield int(c), [*corner, w, h], float(confidence[0]) if confidence else 1.0


def class_matches(evaluation, category, count):
    """Matches of a class. pycocotools orders them by class, area and picture; the first area is all sizes."""
    areas = len(evaluation.params.areaRng)
    first = category * areas * count
    of_pictures = evaluation.evalImgs[first : first + count]
    truths = np.zeros(count)
    picture, right, confidence = [np.empty(0, int)], [np.empty((0, len(IOUS)), bool)], [np.empty(0)]
    for k, one in enumerate(of_pictures):
        if one is None:
            continue
        truths[k] = len(one["gtIds"])
        confidence.append(np.array(one["dtScores"], float))
        right.append(one["dtMatches"].T > 0)
        picture.append(np.full(len(one["dtScores"]), k))
    order = np.argsort(-np.concatenate(confidence), kind="mergesort")
    return Matches(np.concatenate(picture)[order], np.concatenate(right)[order], truths)
