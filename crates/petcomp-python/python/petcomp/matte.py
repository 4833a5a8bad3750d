"""Keying and cutting out photos taken on a screen."""

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
    """Result of keying a photo."""

    #: Share of foreground in each pixel: height x width, float32, 0 to 1.
    matte: npt.NDArray[np.float32]
    #: The keyed foreground: height x width x 4, float32, scene-linear, premultiplied.
    cutout: npt.NDArray[np.float32]
    #: How often the profile ``robust`` deviated from Blender's.
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
    """Key a photo exactly like Blender's Keying node, bit for bit.

    * ``image``: height x width x 3 or 4, float32 (scene-linear, alpha premultiplied; used without a copy if
      C-contiguous) or uint8 (sRGB, straight alpha)
    * ``screen``: three scene-linear numbers, a pixel (3, float32 or uint8 like ``image``), or a photo of the
      empty screen of the same size
    * ``profile``: ``blender-3.4``, ``blender-4.2``, ``blender-4.5`` or ``robust``
    * ``garbage``, ``core``: garbage and core matte (certainly not, or certainly, foreground): height x width,
      float32 (0 to 1) or bool
    * ``options``: Blender's settings, e.g. ``clip_black=0.1``, ``blur_pre=2``, ``despill_factor=0.5``
    """
    settings = dumped("options", {"profile": profile, **options})
    matte, cutout, deviations = _petcomp.key(image, screen, garbage, core, settings)
    return Keyed(matte, cutout, loaded(deviations))


@dataclass(frozen=True, eq=False)
class CutOut:
    """An object without its background."""

    #: Height x width x 4, float32, scene-linear, premultiplied; trimmed to the object.
    rgba: npt.NDArray[np.float32]
    #: Measured transmittance of each channel: height x width x 3, float32, 0 to 1.
    transmittance: npt.NDArray[np.float32]
    #: Convex hull, n x 2, float64, pixels of ``rgba``, clockwise as seen.
    hull: npt.NDArray[np.float64]
    #: Region of the photo that ``rgba`` shows: x, y, width, height, pixels.
    roi: tuple[int, int, int, int]
    #: Pixels of ``rgba`` per pixel of the photo.
    scale: float
    #: Mean colour of the screen, scene-linear.
    screen: tuple[float, float, float]
    #: Source of the matte: ``physical``, ``key`` or ``outline``.
    method: str
    #: Mean matte on the screen, where it should be 0.
    residual_matte: float
    #: Notes and warnings: ``code``, ``severity`` and ``message`` of each.
    diagnostics: list[dict[str, str]]

    def _repr_png_(self) -> bytes:
        return png(shown(self.rgba))


def cut_out(image: npt.NDArray[Any], *, empty: npt.NDArray[Any] | None = None, **options: Any) -> CutOut:
    """Cut out the single object of a photo on a uniform screen.

    ``image`` and ``empty`` (a photo of the empty screen) are height x width x 3, float32 (scene-linear) or uint8
    (sRGB). ``options`` are the keys of ``[cut_out]`` in a list of photos, e.g. ``method="key"``,
    ``soften_px=0.6``, ``segment={...}``. Raises ``PhotoError`` if there is no usable object.
    """
    rgba, transmittance, text = _petcomp.cut_out(image, empty, dumped("options", options))
    record = loaded(text)
    record["hull"] = np.array(record["hull"], dtype=np.float64).reshape(-1, 2)
    record["roi"], record["screen"] = tuple(record["roi"]), tuple(record["screen"])
    return CutOut(rgba, transmittance, **record)
