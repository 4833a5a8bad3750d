"""Rendering from data in memory: cards over a plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import dumped, label_names
from .camera import Camera, _floats
from .errors import ArgumentTypeError, InvalidValueError
from .sample import Sample

__all__ = ["Card", "Shot", "render"]


@dataclass(frozen=True, eq=False)
class Card:
    """A textured, see-through rectangle in space."""

    #: Unique id in labels, not 0.
    id: int
    #: Height x width x 4, float32 (scene-linear, premultiplied) or uint8 (sRGB, straight alpha).
    texture: npt.NDArray[Any]
    #: Width and height, metres.
    size: tuple[float, float]
    #: Centre in the world, metres.
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: 3 x 3 rotation of the card in the world, or angles about x, then y, then z, radians.
    rotation: Any = (0.0, 0.0, 0.0)
    #: Class; None for a distractor, which is drawn like any other card but not labelled.
    class_: int | None = 0

    def _place(self) -> tuple[Any, ...]:
        size = _floats("size", self.size, (2,))
        position = _floats("position", self.position, (3,))
        number = None if self.class_ is None else _id("class_", self.class_)
        return _id("id", self.id), number, size, position, _rotation(self.rotation)


def _id(name: str, value: Any) -> int:
    if isinstance(value, (int, np.integer)) and 0 <= value < 2**32:
        return int(value)
    raise InvalidValueError(f"{name}: {value!r}, expected a whole number from 0")


def _rotation(value: Any) -> list[Any]:
    """Rows of a rotation matrix, from a matrix or three angles."""
    if np.shape(value) != (3,):
        return _floats("rotation", value, (3, 3))
    x, y, z = _floats("rotation", value, (3,))
    (cx, cy, cz), (sx, sy, sz) = np.cos([x, y, z]), np.sin([x, y, z])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rows: list[Any] = (about_z @ about_y @ about_x).tolist()
    return rows


@dataclass(frozen=True, eq=False)
class Shot:
    """Everything needed to render an image, in memory and without unknowns.

    ``Shot(camera).with_plate(plate).with_card(card).with_light(light).with_ambient(1.0)``
    """

    #: The camera; its ``image`` sets the image size.
    camera: Camera
    #: Background: height x width x 3, float32 (scene-linear) or uint8 (sRGB); None for a transparent one.
    plate: npt.NDArray[Any] | None = None
    #: Cards, in any order.
    cards: tuple[Card, ...] = ()
    #: Area lights in the format of scene files: ``position``, ``size`` (metres), ``power`` (watts), ...
    lights: tuple[Mapping[str, Any], ...] = ()
    #: Radiance of a constant environment, scene-linear.
    ambient: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: Factor from rendered radiance to plate values.
    exposure: float = 1.0
    #: Names of the classes, in order.
    classes: tuple[str, ...] = ("object",)
    #: Sampling settings: the table ``[render]`` of a recipe.
    options: Mapping[str, Any] = field(default_factory=dict)
    #: Label settings: the table ``[labels]`` of a recipe.
    labels: Mapping[str, Any] = field(default_factory=dict)

    def with_plate(self, plate: npt.NDArray[Any]) -> Shot:
        """Return the shot with a background of the camera's image size."""
        return replace(self, plate=plate)

    def with_card(self, card: Card) -> Shot:
        """Return the shot with another card."""
        return replace(self, cards=(*self.cards, card))

    def with_light(self, light: Mapping[str, Any]) -> Shot:
        """Return the shot with another light."""
        return replace(self, lights=(*self.lights, light))

    def with_ambient(self, ambient: float | Sequence[float]) -> Shot:
        """Return the shot with a constant environment of this radiance."""
        color = (ambient,) * 3 if isinstance(ambient, (int, float, np.number)) else ambient
        red, green, blue = _floats("ambient", color, (3,))
        return replace(self, ambient=(red, green, blue))


def render(shot: Shot) -> Sample:
    """Render and label a shot; the image and its labels come from the same render samples."""
    if not isinstance(shot, Shot):
        raise ArgumentTypeError(f"shot: {type(shot).__name__}, expected a Shot")
    if not isinstance(shot.camera, Camera):
        raise ArgumentTypeError(f"camera: {type(shot.camera).__name__}, expected a Camera")
    if not all(isinstance(card, Card) for card in shot.cards):
        raise ArgumentTypeError("cards: expected cards")
    settings = dumped(
        "shot",
        {
            "lights": list(shot.lights),
            "ambient": _floats("ambient", shot.ambient, (3,)),
            "exposure": shot.exposure,
            "render": shot.options,
            "labels": shot.labels,
            "classes": label_names(shot.classes),
        },
    )
    places = [card._place() for card in shot.cards]
    textures = [card.texture for card in shot.cards]
    native = shot.camera._native
    return Sample(_petcomp.render_shot(native, shot.plate, places, textures, settings))
