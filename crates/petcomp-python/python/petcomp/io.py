"""Pictures from files and to files, as petcomp reads and writes them."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import path_of

__all__ = ["read", "write"]


def read(path: str | os.PathLike[str], alpha: bool = False) -> npt.NDArray[np.float32]:
    """A picture: height x width x 3, float32, scene-linear (Rec. 709 primaries), values above 1 kept.

    With ``alpha``: height x width x 4, premultiplied. PNG, JPEG, TIFF, Radiance HDR and OpenEXR, by
    content; profiles and the orientation of the camera are applied.
    """
    return _petcomp.read_picture(path_of("path", path), alpha)


def write(path: str | os.PathLike[str], image: npt.NDArray[Any]) -> None:
    """A picture to a file whose extension names the format: exr, png, jpg or tif.

    ``image`` is height x width x 3 or 4: float32 (scene-linear, premultiplied) or uint8 (sRGB, straight
    alpha). An exr holds it scene-linear as 32-bit floats, so that nothing is lost; png and jpg hold sRGB codes
    of 8 bits, tif of 16, clipped to 0 to 1.
    """
    _petcomp.write_picture(path_of("path", path), image)
