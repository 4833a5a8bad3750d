"""Evaluation of a detector's boxes against ground truth."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import check_array, class_names, folder_of, loaded, numbers_in, path_of
from ._show import table
from .camera import _pixels
from .errors import ArgumentTypeError, InvalidValueError
from .pipeline import _number

__all__ = ["Metrics", "evaluate"]


class Metrics:
    """Scores of a detector, as ``petcomp eval`` writes them to ``metrics.json``."""

    def __init__(self, document: dict[str, Any], classes: list[str]) -> None:
        self._document = document
        #: Names of the classes, in order; empty if unknown.
        self.classes = classes

    @property
    def map(self) -> float:
        """mAP@0.5:0.95 as defined by YOLOv5."""
        return float(self._document["map"]["value"])

    @property
    def interval(self) -> tuple[float, float] | None:
        """Bootstrap interval of ``map``, over images or over the sequences that they belong to.

        None with fewer than 40 rounds, or with fewer than two images or sequences that contain objects to find.
        """
        record = self._document["map"]
        if "low" not in record:
            return None
        return float(record["low"]), float(record["high"])

    @property
    def by_class(self) -> dict[int, float]:
        """AP@0.5:0.95 of each class that has objects to find."""
        scores = self._document["yolov5"]["classes"]
        return {score["class"]: float(np.mean(score["ap"])) for score in scores}

    def to_dict(self) -> dict[str, Any]:
        """Return the scores as plain data."""
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
    images: str | os.PathLike[str] | None = None,
    output: str | os.PathLike[str] | None = None,
    rounds: int = 200,
    seed: int = 0,
) -> Metrics:
    """Score predictions against ground truth, like ``petcomp eval``.

    Files: both are folders of YOLO labels or COCO JSON files. The truth may also be a list of images (``.txt``), or
    a folder with a ``data.yaml`` and no labels, which stands for its validation images. ``size`` (width and height,
    pixels) applies to YOLO labels only, which need it if their images are missing; ``images`` is the folder of
    the truth's images if they are elsewhere. ``output`` is a folder for the full report.

    Boxes in memory: both are lists with one mapping per image: ``boxes`` (n x 4: left, top, right, bottom, pixels)
    and ``classes`` (n); for predictions ``scores`` (n, 0 to 1); for the truth optionally ``ignored`` (n, as of a
    ``Sample``), objects that count neither as found nor as missed.

    ``rounds`` is the number of bootstrap rounds, 0 to 100000; fewer than 40 give no interval.
    """
    question = class_names(classes), _number("rounds", rounds), _number("seed", seed)
    if isinstance(predictions, (str, os.PathLike)) and isinstance(truth, (str, os.PathLike)):
        shape = None if size is None else _pixels("size", size)
        place = None if output is None else folder_of("output", output)
        photos = None if images is None else path_of("images", images)
        paths = path_of("predictions", predictions), path_of("truth", truth)
        text = _petcomp.evaluate_files(*paths, shape, photos, place, question)
    else:
        sheets = _sheets(predictions, truth)
        if size is not None or images is not None or output is not None:
            raise InvalidValueError("size, images, output: only for files, expected none for boxes in memory")
        text = _petcomp.evaluate_boxes(sheets, question)
    record = loaded(text)
    return Metrics(record["metrics"], record["classes"])


def _sheets(predictions: Any, truth: Any) -> list[Any]:
    for name, value in (("predictions", predictions), ("truth", truth)):
        if isinstance(value, (str, os.PathLike)) or not isinstance(value, Sequence):
            raise ArgumentTypeError(f"{name}: {type(value).__name__}, expected a path or a list, like the other argument")
    if len(predictions) != len(truth):
        raise InvalidValueError(f"predictions: {len(predictions)} images, but the truth has {len(truth)}")
    pairs = enumerate(zip(truth, predictions))
    return [(_truth(f"truth[{i}]", a), _found(f"predictions[{i}]", b)) for i, (a, b) in pairs]


def _truth(at: str, labels: Any) -> list[tuple[Any, ...]]:
    """Class, box and ignore flag of each object in an image."""
    boxes = _boxes(at, labels, "ignored")
    ignored = _whole(f"{at}.ignored", labels.get("ignored", [False] * len(boxes)), len(boxes), 2)
    return list(zip(_classes(at, labels, len(boxes)), boxes, map(bool, ignored)))


def _found(at: str, labels: Any) -> list[tuple[Any, ...]]:
    """Class, box and confidence of each detection in an image."""
    boxes = _boxes(at, labels, "scores")
    scores = _column(f"{at}.scores", labels.get("scores"), len(boxes))
    return list(zip(_classes(at, labels, len(boxes)), boxes, scores.tolist()))


def _boxes(at: str, labels: Any, last: str) -> list[Any]:
    if not isinstance(labels, Mapping):
        raise ArgumentTypeError(f"{at}: {type(labels).__name__}, expected a dict of boxes, classes and {last}")
    for key in labels:
        if key not in ("boxes", "classes", last):
            raise InvalidValueError(f"{at}: unknown key {key!r}, expected boxes, classes and {last}")
    boxes = _numbers(f"{at}.boxes", labels.get("boxes"))
    if boxes.size and (boxes.ndim != 2 or boxes.shape[1] != 4):
        raise InvalidValueError(f"{at}.boxes: shape {boxes.shape}, expected (n, 4)")
    rows: list[Any] = boxes.reshape(-1, 4).tolist()
    return rows


def _classes(at: str, labels: Any, count: int) -> list[int]:
    return _whole(f"{at}.classes", labels.get("classes"), count, 2**32)


def _numbers(at: str, value: Any) -> npt.NDArray[np.float64]:
    if value is None:
        raise InvalidValueError(f"{at}: missing, expected numbers")
    check_array(at, value)
    try:
        return np.asarray(numbers_in(value), dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValueError(f"{at}: {error}, expected numbers") from None


def _column(at: str, value: Any, count: int) -> npt.NDArray[np.float64]:
    """One number for each box."""
    column = _numbers(at, value)
    if column.size == count and (column.ndim == 1 or not count):
        return column.reshape(count)
    raise InvalidValueError(f"{at}: shape {column.shape}, expected one number for each of {count} boxes")


def _whole(at: str, value: Any, count: int, end: int) -> list[int]:
    """One whole number for each box, from 0 to below ``end``."""
    column = _column(at, value, count)
    for number in column:
        if not (0 <= number < end and number == int(number)):
            raise InvalidValueError(f"{at}: {number:g}, expected whole numbers from 0 to {end - 1}")
    return [int(number) for number in column]
