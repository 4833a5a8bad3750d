"""Turn a handful of photographs into labelled training images.

    import petcomp

    sample = petcomp.Pipeline("recipe.toml")[0]
    sample.image, sample.boxes, sample.classes

Names follow the Rust library. Images are NumPy arrays, height x width x channels: float32 is scene-linear
light with Rec. 709 primaries and premultiplied alpha, uint8 is sRGB with straight alpha. Lengths are metres,
angles radians, image positions pixels from the top left corner. petcomp releases the GIL while it works, and
Ctrl-C ends any call within a second.
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
    """Set the number of threads: 0 to 1024, where 0 is one per core."""
    _petcomp.set_threads(_number("threads", count))
