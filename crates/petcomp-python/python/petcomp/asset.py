"""Cut-outs with real size and class, kept in a folder."""

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
    """What became of the photos of a list."""

    #: Photos that are cut out.
    photos: int
    #: How many of these cut-outs were there before.
    kept: int
    #: Lengths of the objects that lie wholly in their photos and their standard errors, metres, in the
    #: order of the list.
    lengths: list[tuple[float, float]]
    #: Photos that gave no cut-out, and why.
    refused: list[str]
    #: How many of these a person rejected.
    rejected: int
    #: Cut-outs that the folder has of photos that are not in the list.
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
    """Cuts out all photos of a list (TOML or CSV, or a folder with one) into an asset folder.

    ``resume`` keeps the cut-outs that are there already of the same photo, entry, options and version of
    petcomp. A contact sheet that the program drew of other cut-outs goes. ``progress`` is called with the
    photos done and their number, in the calling thread. What it raises ends the run, as Ctrl-C does: the
    photos in hand may still be written, and the manifest with them, but no others.
    """
    paths = path_of("list", list), folder_of("folder", folder)
    report = _petcomp.build_assets(*paths, progress, resume)
    record = loaded(report)
    record["lengths"] = [tuple(pair) for pair in record["lengths"]]
    return Built(**record)


def list_folder(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """What an asset folder holds: its manifest as plain data."""
    manifest: dict[str, Any] = loaded(_petcomp.list_assets(path_of("folder", folder)))
    return manifest
