"""Reading and writing image files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import path_of

__all__ = ["read", "write"]


def read(path: str | os.PathLike[str], alpha: bool = False) -> npt.NDArray[np.float32]:
    """Read an image: height x width x 3, float32, scene-linear (Rec. 709 primaries), values above 1 kept.

    With ``alpha``: height x width x 4, premultiplied. The format (PNG, JPEG, TIFF, Radiance HDR or OpenEXR) is
    detected from the content. Colour profiles and the camera's orientation are applied.
    """
    return _petcomp.read_picture(path_of("path", path), alpha)


def write(path: str | os.PathLike[str], image: npt.NDArray[Any]) -> None:
    """Write an image to a file whose extension sets the format: exr, png, jpg or tif.

    ``image`` is height x width x 3 or 4: float32 (scene-linear, premultiplied) or uint8 (sRGB, straight
    alpha). exr stores scene-linear 32-bit floats, without loss; png and jpg store 8-bit sRGB codes, tif 16-bit
    ones, clipped to 0 to 1.
    """
    _petcomp.write_picture(path_of("path", path), image)
