"""How well the boxes of a detector match the truth."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _petcomp
from ._documents import check_count, loaded, path_of
from ._show import table
from .errors import ArgumentTypeError, InvalidValueError
from .pipeline import _number

__all__ = ["Metrics", "evaluate"]


class Metrics:
    """Scores of a detector: what ``petcomp eval`` writes as ``metrics.json``."""

    def __init__(self, document: dict[str, Any], classes: list[str]) -> None:
        self._document = document
        #: Names of the classes, in order; empty where they are not known.
        self.classes = classes

    @property
    def map(self) -> float:
        """mAP@0.5:0.95 by the definition of YOLOv5."""
        return float(self._document["map"]["value"])

    @property
    def interval(self) -> tuple[float, float]:
        """Range of ``map`` by bootstrap over images."""
        record = self._document["map"]
        return float(record["low"]), float(record["high"])

    @property
    def by_class(self) -> dict[int, float]:
        """AP@0.5:0.95 of each class with something to find."""
        scores = self._document["yolov5"]["classes"]
        return {score["class"]: float(np.mean(score["ap"])) for score in scores}

    def to_dict(self) -> dict[str, Any]:
        """The same as plain data."""
        return self._document

    def __repr__(self) -> str:
        return f"Metrics(map={self.map:.4f}, images={self._document['images']})"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = [("all", f"{self.map:.4f}")]
        rows += [(self._name(number), f"{score:.4f}") for number, score in self.by_class.items()]
        return table(("class", "mAP@0.5:0.95"), rows)

    def _name(self, number: int) -> str:
        return self.classes[number] if number < len(self.classes) else str(number)


def evaluate(
    predictions: str | os.PathLike[str] | Sequence[Mapping[str, Any]],
    truth: str | os.PathLike[str] | Sequence[Mapping[str, Any]],
    *,
    classes: Sequence[str] = (),
    size: tuple[int, int] | None = None,
    output: str | os.PathLike[str] | None = None,
    rounds: int = 200,
    seed: int = 0,
) -> Metrics:
    """Scores of predictions against the truth, as ``petcomp eval`` gives them.

    Both are folders of YOLO labels or COCO JSON files; ``size`` (width and height, pixels) is needed for
    YOLO labels without images beside them, ``output`` is a folder for the whole report. Or both are
    lists, one mapping for each image: ``boxes`` (n x 4: left, top, right, bottom, pixels) and ``classes``
    (n), and of predictions ``scores`` (n).
    """
    rounds, seed = _number("rounds", rounds), _number("seed", seed)
    if isinstance(predictions, (str, os.PathLike)) and isinstance(truth, (str, os.PathLike)):
        shape = None if size is None else [_number("size", side) for side in size]
        place = None if output is None else path_of("output", output)
        paths = path_of("predictions", predictions), path_of("truth", truth)
        text = _petcomp.evaluate_files(*paths, shape, place, (list(classes), rounds, seed))
    else:
        sheets = _sheets(predictions, truth)
        text = _petcomp.evaluate_boxes(sheets, (list(classes), rounds, seed))
    record = loaded(text)
    return Metrics(record["metrics"], record["classes"])


def _sheets(predictions: Any, truth: Any) -> list[Any]:
    for name, value in (("predictions", predictions), ("truth", truth)):
        if isinstance(value, (str, os.PathLike)) or not isinstance(value, Sequence):
            raise ArgumentTypeError(f"{name}: {type(value).__name__}, expected a path or a list, as the other")
    if len(predictions) != len(truth):
        raise InvalidValueError(f"predictions: {len(predictions)} images, but the truth has {len(truth)}")
    pairs = enumerate(zip(truth, predictions))
    return [(_rows(f"truth[{i}]", a, False), _rows(f"predictions[{i}]", b, True)) for i, (a, b) in pairs]


def _rows(at: str, labels: Any, scored: bool) -> list[tuple[Any, ...]]:
    try:
        check_count(at, labels["boxes"])
        boxes = np.asarray(labels["boxes"], dtype=np.float64).reshape(-1, 4).tolist()
        numbers = [int(number) for number in labels["classes"]]
        columns: list[list[Any]] = [numbers, boxes]
        if scored:
            columns.append([float(score) for score in labels["scores"]])
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidValueError(f"{at}: {error}, expected boxes (n x 4), classes (n) and scores (n)") from None
    if len({len(column) for column in columns}) != 1 or any(not 0 <= n < 2**32 for n in numbers):
        raise InvalidValueError(f"{at}: expected as many boxes, classes (from 0) and scores")
    return list(zip(*columns))
