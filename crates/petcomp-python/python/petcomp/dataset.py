"""Datasets: images and labels in the layouts that trainers read."""

from __future__ import annotations

import atexit
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from . import _petcomp
from ._documents import class_names, dumped, loaded, path_of
from .errors import ArgumentTypeError, InvalidValueError
from .pipeline import Pipeline, _number
from .sample import Sample

__all__ = ["DatasetCounts", "Progress", "generate"]

# Functions that make samples must have returned before the interpreter ends.
atexit.register(_petcomp.end_callers)


@dataclass(frozen=True)
class Progress:
    """How far a run is."""

    #: Samples in the folder, those of an earlier run included.
    done: int
    #: Samples asked for.
    count: int
    #: Samples made by this run.
    made: int


@dataclass(frozen=True)
class DatasetCounts:
    """What a dataset holds."""

    #: Images asked for.
    asked: int
    #: Images in the folder.
    images: int
    #: Of these, images for validation.
    val: int
    #: Images made by this run; the others were there.
    made: int
    #: Images whose objects are counted: all that are there, or, of archives, those of this run.
    counted: int
    #: Objects in these images, labelled or not.
    objects: int
    #: Objects that have a label; those that are to be ignored do not count.
    labelled: int
    #: Objects that are obstructed, labelled or not.
    obstructed: int
    #: Objects in cyclic overlap.
    knotted: int
    #: Scenes that were drawn and rejected.
    retries: int
    #: The same by class: ``name``, ``objects``, ``labelled``.
    classes: list[dict[str, Any]]
    #: What became of the labels of obstructed objects.
    policy: str
    #: Files below the folder that trainers are given.
    for_trainers: list[str]

    @property
    def left_out(self) -> int:
        """Objects that got no label, or under ``ignore`` one to be ignored, but not for being obstructed.

        Too much of them lies outside of the picture, or nothing of them is seen. Where obstructed ones are
        labelled (``keep``, ``class``), they may be among them.
        """
        unlabelled = self.obstructed if self.policy in ("drop", "ignore") else 0
        return max(0, self.objects - self.labelled - unlabelled)


def generate(
    source: str | os.PathLike[str] | Mapping[str, Any] | Pipeline | Callable[[int], Sample],
    count: int,
    folder: str | os.PathLike[str],
    *,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    quality: str | None = None,
    only: int | None = None,
    shard: tuple[int, int] | None = None,
    progress: Callable[[Progress], object] | None = None,
    classes: Sequence[str] | None = None,
    labels: Mapping[str, Any] | None = None,
    pictures: Mapping[str, Any] | None = None,
    split: Mapping[str, Any] | None = None,
) -> DatasetCounts:
    """Makes a dataset of ``count`` pictures in ``folder``; the same call goes on where one stopped.

    ``source`` is a recipe (``set`` and ``quality`` as of ``Pipeline``): the files are those of ``petcomp
    dataset generate``, to the byte. Or a pipeline. Or a function that returns sample ``k``: it is called
    from several threads, in no fixed order, and must depend on nothing but ``k``; ``classes`` are then
    needed, beginning with those of its samples, and ``labels``, ``pictures`` and ``split`` are the tables of
    a recipe, but for what acts when labels are made: ``overlap_iou``, ``min_visible``, ``max_truncation``,
    ``amodal``, ``outline`` and, but for layers, ``alpha_threshold`` belong to the recipe or the ``Shot`` of
    the samples.

    ``only`` makes image ``only`` alone, ``shard=(i, n)`` every ``n``-th from the ``i``-th (1 to ``n``), in a
    folder of its own below. ``progress`` is called in the calling thread, at the start and after each
    picture; what it raises ends the run, as Ctrl-C does: within a second, and the folder stays valid.
    """
    report = None if progress is None else lambda *steps: progress(Progress(*steps))
    shares = None if shard is None else [_number("shard", number) for number in shard]
    if shares is not None and len(shares) != 2:
        raise InvalidValueError(f"shard: {shard}, expected two numbers")
    target = path_of("folder", folder), _number("count", count)
    part = None if only is None else _number("only", only), shares
    if callable(source) and not isinstance(source, (Mapping, Pipeline)):
        _check_acts(set, quality, labels)
        tables = {"labels": labels, "pictures": pictures, "split": split}
        layout = [dumped(name, table or {}) for name, table in tables.items()]
        number = _number("seed", seed or 0)
        return _counts(_with(source, classes, layout, (*target, number, *part), report))
    if labels is not None or pictures is not None or split is not None or classes is not None:
        raise InvalidValueError("classes, labels, pictures, split: taken from the recipe; change them with set")
    pipeline = _opened(source, seed, set, quality)
    number = pipeline.seed if seed is None else _number("seed", seed)
    return _counts(_petcomp.generate_from(pipeline._native, (*target, number, *part), report))


#: Keys of the table ``labels`` that act when labels are made.
_OF_MAKING = ("overlap_iou", "min_visible", "max_truncation", "alpha_threshold", "amodal", "outline")


def _check_acts(set: Any, quality: Any, labels: Any) -> None:
    """Refuses what would change nothing, for the function makes its samples without it."""
    if set or quality:
        raise InvalidValueError("set, quality: apply only to recipes, expected none with a function")
    if not isinstance(labels, Mapping):
        return
    formats = labels.get("formats")
    has_layers = isinstance(formats, (list, tuple)) and "layers" in formats
    for key in labels:
        # Layers are made when they are written.
        if key in _OF_MAKING and not (has_layers and key == "alpha_threshold"):
            what = "acts when labels are made, expected in the recipe or the Shot of the samples"
            raise InvalidValueError(f"labels.{key}: {what}")


def _with(make: Any, classes: Sequence[str] | None, layout: list[str], target: Any, report: Any) -> str:
    if classes is None:
        raise ArgumentTypeError("classes: missing, expected the names of the classes")

    def native(k: int) -> _petcomp.Sample:
        sample = make(k)
        if isinstance(sample, Sample):
            return sample._native
        raise ArgumentTypeError(f"source: returned {type(sample).__name__} for {k}, expected a Sample")

    return _petcomp.generate_with(native, class_names(classes), layout, target, report)


def _opened(source: Any, seed: int | None, set: Mapping[str, Any] | None, quality: str | None) -> Pipeline:
    if not isinstance(source, Pipeline):
        return Pipeline(source, seed=seed or 0, set=set, quality=quality)
    if set or quality:
        raise InvalidValueError("set, quality: already fixed by the open pipeline")
    return source


def _counts(report: str) -> DatasetCounts:
    return DatasetCounts(**loaded(report))
