"""Samples: images with labels."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import label_names, loaded
from ._show import image_tag, png, table
from .errors import InvalidValueError
from .scene import Scene

__all__ = ["Sample"]

#: Colours of boxes in notebooks, sRGB.
_COLORS = [(255, 80, 80), (80, 200, 255), (255, 210, 60), (120, 255, 120), (230, 120, 255)]


class Sample:
    """An image and its labels, made by ``Pipeline`` or ``render``.

    Everything is computed on first access. Labels follow the recipe: an object without one
    (``labels.obstructed``) appears only in ``labels``.
    """

    def __init__(self, native: _petcomp.Sample) -> None:
        self._native = native

    @classmethod
    def from_masks(
        cls,
        image: npt.NDArray[Any],
        masks: Sequence[npt.NDArray[Any]],
        object_classes: Sequence[int],
        classes: Sequence[str],
    ) -> Sample:
        """Create a sample from any image, to write it as part of a dataset.

        * ``image``: height x width x 3 or 4, float32 (scene-linear, premultiplied, alpha 0 to 1) or uint8 (sRGB)
        * ``masks``: one per object, height x width, bool or float32 (above 0.5 is inside); where masks overlap,
          the last is in front, and the others are obstructed: unless ``labels["obstructed"]`` says otherwise,
          ``generate`` gives them no label
        * ``object_classes``: the class of each object, an index into ``classes``
        """
        numbers = [_class_number(number) for number in object_classes]
        return cls(_petcomp.Sample.from_masks(image, list(masks), numbers, label_names(classes)))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        width, height = self._native.size
        return width, height

    @cached_property
    def image(self) -> npt.NDArray[np.uint8]:
        """The image for display, over black: height x width x 3, uint8, sRGB.

        For ``Pipeline[k]`` it equals the program's decoded file, with JPEG's losses if the recipe writes JPEG. The
        array is kept: copy it before you draw on it. Changes to it do not reach ``generate``; those to
        ``image_linear`` do.
        """
        return self._native.image()

    @cached_property
    def image_linear(self) -> npt.NDArray[np.float32]:
        """The image: height x width x 4, float32, scene-linear (Rec. 709 primaries), premultiplied.

        This is the sample's own memory: changes to it also change what ``generate`` writes.
        """
        return self._native.image_linear()

    @cached_property
    def depth(self) -> npt.NDArray[np.float32]:
        """Depth of the foremost object that covers more than 5 % of a pixel: height x width, float32, metres.

        Measured along the optical axis. Infinite where there is no object, and everywhere in a sample ``from_masks``,
        whose depth is unknown.
        """
        return self._native.depth()

    @cached_property
    def ids(self) -> npt.NDArray[np.uint32]:
        """Id of the object that ``depth`` is of: height x width, uint32; 0 where there is none."""
        return self._native.ids()

    @cached_property
    def boxes(self) -> npt.NDArray[np.float64]:
        """Bounding box of each labelled object: n x 4 (left, top, right, bottom), float64, pixels."""
        return self._native.boxes()

    @cached_property
    def object_ids(self) -> npt.NDArray[np.int64]:
        """Id of each labelled object: n, int64."""
        return np.array([id for id, _, _ in self._native.labelled()], dtype=np.int64)

    @cached_property
    def classes(self) -> npt.NDArray[np.int64]:
        """Class of each labelled object, an index into ``class_names``: n, int64."""
        return np.array([number for _, number, _ in self._native.labelled()], dtype=np.int64)

    @cached_property
    def ignored(self) -> npt.NDArray[np.bool_]:
        """Whether finding the object counts neither as right nor as wrong (COCO's ``iscrowd``): n, bool."""
        return np.array([ignored for _, _, ignored in self._native.labelled()], dtype=np.bool_)

    @cached_property
    def class_names(self) -> list[str]:
        """Names of the classes, in order."""
        return self._native.class_names()

    @cached_property
    def masks(self) -> list[dict[str, Any]]:
        """Mask of each labelled object as COCO's compressed RLE.

        ``{"size": [height, width], "counts": "..."}``, which pycocotools decodes.
        """
        return [loaded(self._native.mask_json(i)) for i in range(len(self.classes))]

    def mask_arrays(self) -> npt.NDArray[np.bool_]:
        """Return the masks as arrays: n x height x width, bool."""
        width, height = self.size
        masks = [self._native.mask(i) for i in range(len(self.classes))]
        return np.stack(masks) if masks else np.zeros((0, height, width), dtype=np.bool_)

    @cached_property
    def labels(self) -> dict[str, Any]:
        """Everything known about every object, labelled or not, as plain data."""
        document: dict[str, Any] = loaded(self._native.labels_json())
        return document

    @cached_property
    def scene(self) -> Scene | None:
        """The resolved scene that the image shows; None if there is none."""
        text = self._native.scene_json()
        return None if text is None else Scene.from_dict(loaded(text))

    @cached_property
    def draws(self) -> dict[str, float]:
        """Every value drawn for the sample, by its path."""
        return dict(self._native.draws())

    def __len__(self) -> int:
        return len(self.classes)

    def __repr__(self) -> str:
        width, height = self.size
        return f"Sample({width} x {height}, {len(self)} labels)"

    def _with_boxes(self) -> npt.NDArray[np.uint8]:
        """Return the image with its boxes drawn on it."""
        shown = self.image.copy()
        for box, number in zip(self.boxes, self.classes):
            _draw_box(shown, box, _COLORS[number % len(_COLORS)])
        return shown

    def _repr_png_(self) -> bytes:
        return png(self._with_boxes())

    def _repr_html_(self) -> str:
        rows = [
            (id, self.class_names[number], " ".join(f"{edge:g}" for edge in box))
            for id, number, box in zip(self.object_ids, self.classes, self.boxes)
        ]
        return image_tag(self._with_boxes()) + table(("object", "class", "box"), rows)


def _class_number(value: Any) -> int:
    if isinstance(value, (int, np.integer)) and 0 <= value < 2**32:
        return int(value)
    raise InvalidValueError(f"object_classes: {value!r}, expected numbers of classes from 0")


def _draw_box(image: npt.NDArray[np.uint8], box: npt.NDArray[np.float64], color: tuple[int, int, int]) -> None:
    height, width = image.shape[:2]
    x0, y0 = max(int(box[0]), 0), max(int(box[1]), 0)
    x1, y1 = min(int(box[2]), width) - 1, min(int(box[3]), height) - 1
    if x0 > x1 or y0 > y1:
        return
    image[[y0, y1], x0 : x1 + 1] = color
    image[y0 : y1 + 1, [x0, x1]] = color
