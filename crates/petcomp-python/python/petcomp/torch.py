"""A PyTorch dataset of images generated during training; only this module imports PyTorch."""

from __future__ import annotations

import copyreg
import os
from collections.abc import Callable, Mapping
from typing import Any

import torch
from torch.utils.data import Dataset as _Dataset

from . import _petcomp
from .errors import ArgumentTypeError
from .pipeline import Pipeline, _number
from .sample import Sample

__all__ = ["Dataset", "collate", "to_tensors"]


def to_tensors(sample: Sample) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
    """Convert a sample to the input of torchvision's detectors.

    Image: 3 x height x width, float32, 0 to 1, sRGB.

    Target: ``boxes`` (n x 4, float32: left, top, right, bottom, pixels), ``labels`` (n, int64: class + 1, since 0
    is the background), ``area`` (n, float32) and ``iscrowd`` (n, int64, all 0). Ignored objects are left out,
    since these detectors would learn a crowd as an object. ``Dataset`` adds ``image_id``.
    """
    picture = torch.from_numpy(sample.image).permute(2, 0, 1).to(torch.float32) / 255
    keep = ~sample.ignored
    boxes = torch.from_numpy(sample.boxes[keep]).to(torch.float32)
    sides = boxes[:, 2:] - boxes[:, :2]
    target = {
        "boxes": boxes,
        "labels": torch.from_numpy(sample.classes[keep]) + 1,
        "area": sides[:, 0] * sides[:, 1],
        "iscrowd": torch.zeros(len(boxes), dtype=torch.int64),
    }
    return picture, target


class Dataset(_Dataset[Any]):
    """Samples ``0`` to ``count - 1`` of a recipe, generated on access.

    Sample ``k`` equals that of ``petcomp dataset generate``, whichever worker makes it, forked or spawned. Each
    worker opens the recipe once and computes with ``threads`` threads (default 1, because workers already share
    the processors, and the memory for cut-outs and photos). ``transform`` receives the ``Sample``; the default is
    ``to_tensors``, whose target then has ``k`` as its ``image_id``. A worker must not return a ``Sample``, which
    cannot leave the process that made it.
    """

    def __init__(
        self,
        recipe: str | os.PathLike[str] | Mapping[str, Any],
        count: int,
        *,
        seed: int = 0,
        set: Mapping[str, Any] | None = None,
        quality: str | None = None,
        transform: Callable[[Sample], Any] = to_tensors,
        threads: int = 1,
    ) -> None:
        self._count = _number("count", count)
        self._transform = transform
        self._threads = _number("threads", threads)
        # Open it here to report errors in the recipe at once, and to share it with forks.
        self._pipeline = Pipeline(recipe, seed=seed, set=set, quality=quality)
        self._worker_process: int | None = None

    @property
    def classes(self) -> list[str]:
        """Names of the classes, in order."""
        return self._pipeline.classes

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Any:
        k = index + self._count if index < 0 else index
        if not 0 <= k < self._count:
            raise IndexError(f"sample {index} of {self._count}")
        self._settle_in()
        made = self._transform(self._pipeline[k])
        if self._transform is to_tensors:
            made[1]["image_id"] = k
        return made

    def _settle_in(self) -> None:
        """Set up a worker, once."""
        from . import set_threads

        process, worker = os.getpid(), torch.utils.data.get_worker_info()
        if worker is not None and self._worker_process != process:
            set_threads(self._threads)
            _petcomp.share_memory(worker.num_workers)
            copyreg.pickle(Sample, _stays)
            self._worker_process = process


def _stays(sample: Sample) -> tuple[Any, ...]:
    """Pickle a sample that leaves a worker; raising here would lose the error and hang the loader."""
    return _refuse_sample, ()


def _refuse_sample() -> None:
    raise ArgumentTypeError("transform: a Sample, which cannot leave the process that created it; expected its arrays")


def collate(batch: list[tuple[Any, Any]]) -> tuple[list[Any], list[Any]]:
    """Return images and targets of a batch as lists, since each image has its own number of boxes."""
    pictures, targets = zip(*batch)
    return list(pictures), list(targets)
