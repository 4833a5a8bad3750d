"""petcomp turns a handful of photographs into labelled training images.

    import petcomp

    sample = petcomp.Pipeline("recipe.toml")[0]
    sample.image, sample.boxes, sample.classes

The words are those of the Rust library; pictures are arrays of NumPy, height x width x channels. float32
is scene-linear light with Rec. 709 primaries, alpha premultiplied; uint8 is sRGB, alpha straight. Lengths
are metres, angles radians, places in pictures pixels from the top-left corner. Work releases the
interpreter lock, and Ctrl-C ends it within a second.
"""

from __future__ import annotations

from . import _petcomp, asset, camera, errors, io, matte
from .camera import Camera
from .dataset import DatasetCounts, Progress, generate
from .errors import Error
from .evaluation import Metrics, evaluate
from .pipeline import Pipeline, _number
from .sample import Sample
from .scene import Scene
from .shot import Card, Shot, render

__version__ = "0.1.0"

__all__ = [
    "Camera",
    "Card",
    "DatasetCounts",
    "Error",
    "Metrics",
    "Pipeline",
    "Progress",
    "Sample",
    "Scene",
    "Shot",
    "__version__",
    "asset",
    "camera",
    "errors",
    "evaluate",
    "generate",
    "io",
    "matte",
    "render",
    "set_threads",
]


def set_threads(count: int) -> None:
    """Sets how many threads work: 0 to 1024, where 0 is one for each core."""
    _petcomp.set_threads(_number("threads", count))
