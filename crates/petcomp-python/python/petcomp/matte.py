"""A photo on a screen becomes a cut-out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import dumped, loaded
from ._show import image_tag, png, shown

__all__ = ["CutOut", "Keyed", "cut_out", "key"]


@dataclass(frozen=True, eq=False)
class Keyed:
    """What a keyer makes of a photo."""

    #: How much of each pixel is foreground: height x width, float32, 0 to 1.
    matte: npt.NDArray[np.float32]
    #: The photo through its matte: height x width x 4, float32, scene-linear, premultiplied.
    cutout: npt.NDArray[np.float32]
    #: How often the profile ``robust`` departed from Blender's.
    deviations: dict[str, int]

    def _repr_png_(self) -> bytes:
        return png(shown(self.cutout))

    def _repr_html_(self) -> str:
        return image_tag(shown(self.matte)) + image_tag(shown(self.cutout))


def key(
    image: npt.NDArray[Any],
    screen: Sequence[float] | npt.NDArray[Any],
    profile: str = "blender-3.4",
    *,
    garbage: npt.NDArray[Any] | None = None,
    core: npt.NDArray[Any] | None = None,
    **options: Any,
) -> Keyed:
    """Keys a photo as Blender's Keying node does, to the bit.

    ``image``: height x width x 3 or 4, float32 (scene-linear, alpha premultiplied; read where it is,
    without a copy, if its rows are contiguous) or uint8 (sRGB, straight alpha). ``screen``: three
    scene-linear numbers, a pixel (3, float32 or uint8 as ``image``), or a picture of the empty screen of
    the same size. ``garbage`` and ``core``: height x width, float32 (0 to 1) or bool: what is surely not,
    or surely, foreground. ``profile``: ``blender-3.4``, ``blender-4.2``, ``blender-4.5`` or ``robust``.
    ``options``: Blender's settings, as ``clip_black=0.1``, ``blur_pre=2``, ``despill_factor=0.5``.
    """
    settings = dumped("options", {"profile": profile, **options})
    matte, cutout, deviations = _petcomp.key(image, screen, garbage, core, settings)
    return Keyed(matte, cutout, loaded(deviations))


@dataclass(frozen=True, eq=False)
class CutOut:
    """An object without its background."""

    #: Height x width x 4, float32, scene-linear, premultiplied; trimmed to the object.
    rgba: npt.NDArray[np.float32]
    #: What each channel lets through, as measured: height x width x 3, float32, 0 to 1.
    transmittance: npt.NDArray[np.float32]
    #: Convex hull, n x 2, float64, pixels of ``rgba``, clockwise as seen.
    hull: npt.NDArray[np.float64]
    #: The part of the photo that it shows: x, y, width, height, pixels.
    roi: tuple[int, int, int, int]
    #: Pixels of ``rgba`` for one pixel of the photo.
    scale: float
    #: Mean colour of the screen, scene-linear.
    screen: tuple[float, float, float]
    #: Where the matte came from: ``physical``, ``key`` or ``outline``.
    method: str
    #: Mean matte on the screen, where it should be 0.
    residual_matte: float
    #: Notes and warnings: ``code``, ``severity`` and ``message`` of each.
    diagnostics: list[dict[str, str]]

    def _repr_png_(self) -> bytes:
        return png(shown(self.rgba))


def cut_out(image: npt.NDArray[Any], *, empty: npt.NDArray[Any] | None = None, **options: Any) -> CutOut:
    """Cuts the one object out of a photo on a uniform screen.

    ``image`` and ``empty`` (a photo of the empty screen): height x width x 3, float32 (scene-linear) or
    uint8 (sRGB). ``options`` are those of the list of photos (``method="key"``, ``soften_px=0.6``,
    ``segment={...}``). Raises ``PhotoError`` where there is no usable object.
    """
    rgba, transmittance, text = _petcomp.cut_out(image, empty, dumped("options", options))
    record = loaded(text)
    record["hull"] = np.array(record["hull"], dtype=np.float64).reshape(-1, 2)
    record["roi"], record["screen"] = tuple(record["roi"]), tuple(record["screen"])
    return CutOut(rgba, transmittance, **record)
