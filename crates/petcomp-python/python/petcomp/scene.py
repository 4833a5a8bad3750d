"""Scenes: the description of one image, including its unknowns."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _petcomp
from ._documents import dumped, loaded, path_of
from .camera import Camera

__all__ = ["Scene"]


class Scene:
    """Description of one image to make: objects, poses, camera and lights.

    A scene is plain data with the keys of scene files (``docs/formats.md``): ``image`` (width and height,
    pixels), ``surface`` (``{"size": [metres, metres]}``), ``camera`` (a ``Camera``, or ``{"rectangle": {...}}``),
    ``objects``, ``lights``, ``plate``, ``ambient``, ``exposure`` and more. It is validated on creation; errors
    name an invalid value by its path. Scenes are immutable: ``replace`` returns a new one.
    """

    __slots__ = ("_fields",)

    def __init__(
        self,
        *,
        image: Sequence[int],
        surface: Mapping[str, Any],
        camera: Camera | Mapping[str, Any],
        **fields: Any,
    ) -> None:
        source = {"known": camera.to_dict()} if isinstance(camera, Camera) else camera
        document = {"image": image, "surface": surface, "camera": source, **fields}
        self._fields: dict[str, Any] = loaded(_petcomp.check_scene(dumped("scene", document)))

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Scene:
        """Create a scene from plain data in the format of scene files."""
        scene = cls.__new__(cls)
        scene._fields = loaded(_petcomp.check_scene(dumped("scene", document)))
        return scene

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Scene:
        """Read a scene file, TOML or JSON."""
        scene = cls.__new__(cls)
        scene._fields = loaded(_petcomp.read_scene(path_of("path", path)))
        return scene

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write a scene file, TOML or JSON depending on its name."""
        _petcomp.write_scene(path_of("path", path), dumped("scene", self._fields))

    def to_dict(self) -> dict[str, Any]:
        """Return a copy as plain data in the format of scene files."""
        document: dict[str, Any] = json.loads(json.dumps(self._fields))
        return document

    def replace(self, **fields: Any) -> Scene:
        """Return the same scene with other values of these fields."""
        camera = fields.get("camera")
        if isinstance(camera, Camera):
            fields["camera"] = {"known": camera.to_dict()}
        return Scene.from_dict({**self._fields, **fields})

    def __getitem__(self, field: str) -> Any:
        return self.to_dict()[field]

    def __contains__(self, field: object) -> bool:
        return field in self._fields

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._fields == other._fields

    def __hash__(self) -> int:
        return hash(json.dumps(self._fields, sort_keys=True))

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene.from_dict, (self.to_dict(),)

    def __repr__(self) -> str:
        (w, h), objects = self._fields["image"], len(self._fields.get("objects", []))
        return f"Scene({w} x {h}, {objects} objects)"
