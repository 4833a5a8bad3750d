"""Folders of cut-outs with real size and class."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from . import _petcomp
from ._documents import folder_of, loaded, path_of

__all__ = ["Built", "build", "list_folder"]


@dataclass(frozen=True)
class Built:
    """Result of building the photos of a list."""

    #: Number of photos that have been cut out.
    photos: int
    #: How many of these cut-outs were kept from an earlier run.
    kept: int
    #: Length and standard error, metres, of each object that lies wholly in its photo, in the order of the
    #: list.
    lengths: list[tuple[float, float]]
    #: Photos without a cut-out, with the reason.
    refused: list[str]
    #: How many of these were rejected in a review.
    rejected: int
    #: Cut-outs in the folder whose photos are not in the list.
    unlisted: list[str]
    #: Records of cut-outs that a person should review.
    needs_review: list[dict[str, Any]]
    #: Names of the classes, in order.
    classes: list[str]
    #: Names of all assets in the folder.
    assets: list[str]


def build(
    list: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    progress: Callable[[int, int], object] | None = None,
    *,
    resume: bool = False,
) -> Built:
    """Cut out all photos of a list (TOML or CSV, or a folder with one) into an asset folder.

    ``resume`` keeps existing cut-outs of the same photo, entry, options and petcomp version. A contact sheet
    that shows other cut-outs is deleted. ``progress`` is called in the calling thread with the number of
    finished photos and the total. An exception in it ends the run like Ctrl-C: the photos in progress may
    still be finished and added to the manifest, but no others.
    """
    paths = path_of("list", list), folder_of("folder", folder)
    report = _petcomp.build_assets(*paths, progress, resume)
    record = loaded(report)
    record["lengths"] = [tuple(pair) for pair in record["lengths"]]
    return Built(**record)


def list_folder(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the manifest of an asset folder as plain data."""
    manifest: dict[str, Any] = loaded(_petcomp.list_assets(path_of("folder", folder)))
    return manifest
