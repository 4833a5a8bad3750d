"""The pinhole camera, and how to solve it from a rectangle of known size."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _petcomp
from ._documents import check_array, dumped, loaded, numbers_in, path_of
from ._show import table
from .errors import InvalidValueError

__all__ = ["Camera", "Solution", "solve"]

_log = logging.getLogger("petcomp")

Numbers = Sequence[float] | npt.NDArray[np.floating[Any]]


#: Three coordinates for each pixel of the largest image.
_MOST_COORDINATES = 3 * 2**27
#: Longest side of an image, pixels.
_MOST_PIXELS = 2**31


def _floats(name: str, value: Any, shape: tuple[int, ...]) -> list[Any]:
    """Convert to finite numbers of the given shape, where -1 is any length."""
    check_array(name, value)
    result: list[Any] = _array(name, value, shape).tolist()
    return result


def _array(name: str, value: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """The same, as a C-contiguous array."""
    check_array(name, value, _MOST_COORDINATES)
    try:
        array = np.require(numbers_in(value), np.float64, ["C", "A"])
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(f"{name}: {value!r}, expected numbers of shape {shape}") from None
    fits = array.ndim == len(shape) and all(want in (-1, got) for want, got in zip(shape, array.shape))
    if not fits:
        raise InvalidValueError(f"{name}: shape {array.shape}, expected {shape}")
    if not np.isfinite(array).all():
        raise InvalidValueError(f"{name}: {value!r}, expected finite numbers")
    return array


def _pixels(name: str, value: Any) -> list[int]:
    """Check the width and height of an image."""
    numbers = _floats(name, value, (2,))
    if all(1 <= n <= _MOST_PIXELS and n == int(n) for n in numbers):
        return [int(n) for n in numbers]
    raise InvalidValueError(f"{name}: {value!r}, expected two whole numbers from 1 to {_MOST_PIXELS}")


class Camera:
    """A pinhole camera without distortion: its pose and intrinsics.

    The axes are OpenCV's (x right, y down, z forward). The world is in metres with z up. The centre of a pixel
    is at ``+0.5``.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _petcomp.Camera) -> None:
        if not isinstance(native, _petcomp.Camera):
            raise InvalidValueError("camera: not callable, expected from_rectangle, looking_down, look_at or from_dict")
        self._native = native

    @classmethod
    def from_rectangle(
        cls,
        corners: Numbers | Sequence[Sequence[float]],
        size: Numbers,
        image: Sequence[int],
        focal_px: float | None = None,
    ) -> Camera:
        """Solve the camera from the four corners of a rectangle of known size.

        ``corners`` are pixels, clockwise from the rectangle's top left; ``size`` is its width and height in
        metres; ``image`` is the width and height of the image in pixels. The rectangle becomes the world plane
        ``z = 0``, centred, with ``+x`` along its width. Warnings go to the logger ``petcomp`` of ``logging``.

        Raises ``CameraError`` if no camera can have seen the rectangle, and ``InvalidValueError`` if its size
        is not in metres.
        """
        label: dict[str, Any] = {
            "format": "plane-label",
            "version": 1,
            "image": dict(zip(("file", "width", "height"), ("", *_pixels("image", image)))),
            "surface": {
                "id": "",
                **dict(zip(("width_m", "height_m"), _floats("size", size, (2,)))),
                "corners_px": _floats("corners", corners, (4, 2)),
            },
        }
        if focal_px is not None:
            label["camera"] = {"focal_px": focal_px, "focal_fixed": True}
        solution = solve(label)
        for warning in solution.warnings:
            _log.warning("%s [%s]", warning["message"], warning["code"])
        return solution.camera

    @classmethod
    def looking_down(cls, height: float, focal_px: float, image: Sequence[int]) -> Camera:
        """A camera straight above the origin, ``height`` > 0 in metres, the top of the image towards ``+y``."""
        return cls(_petcomp.Camera.looking_down(height, focal_px, _pixels("image", image)))

    @classmethod
    def look_at(cls, eye: Numbers, target: Numbers, focal_px: float, image: Sequence[int]) -> Camera:
        """An upright camera at ``eye`` that looks at ``target`` (both metres)."""
        eye, target = _floats("eye", eye, (3,)), _floats("target", target, (3,))
        return cls(_petcomp.Camera.look_at(eye, target, focal_px, _pixels("image", image)))

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Camera:
        """Create a camera from plain data in the format of scene files."""
        return cls(_petcomp.Camera.from_json(dumped("camera", document)))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Camera:
        """Read the camera of a camera file, ``NAME.camera.json``, without its lens distortion."""
        return cls(_petcomp.read_camera(path_of("path", path)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data in the format of scene files."""
        document: dict[str, Any] = loaded(self._native.to_json())
        return document

    @property
    def image(self) -> tuple[int, int]:
        """Width and height of the image, pixels."""
        width, height = self._native.image
        return width, height

    @property
    def focal_px(self) -> tuple[float, float]:
        """Focal lengths along x and y, pixels."""
        x, y = self._native.focal_px
        return x, y

    @property
    def principal_px(self) -> tuple[float, float]:
        """Principal point, pixels from the top left corner of the image."""
        x, y = self._native.principal_px
        return x, y

    @property
    def center(self) -> npt.NDArray[np.float64]:
        """Position in the world: 3, float64, metres."""
        return np.array(self._native.center)

    @property
    def tilt(self) -> float:
        """Angle between the optical axis and straight down, radians."""
        return self._native.tilt

    @property
    def intrinsics(self) -> npt.NDArray[np.float64]:
        """Intrinsic matrix K: 3 x 3, float64, pixels."""
        return np.array(self._native.intrinsics())

    @property
    def camera_from_world(self) -> npt.NDArray[np.float64]:
        """Pose of the world in the camera's frame: 4 x 4, float64, metres."""
        return np.array(self._native.camera_from_world())

    @property
    def pixel_from_surface(self) -> npt.NDArray[np.float64]:
        """Homography from the plane ``z = 0`` (metres) to pixels: 3 x 3, float64."""
        return np.array(self._native.pixel_from_surface())

    def project(self, points: Any) -> npt.NDArray[np.float64]:
        """Project points (n x 3, metres): n x 3, float64, with x and y in pixels and depth in metres.

        Points at or behind the camera give NaN.
        """
        return self._native.project(_array("points", points, (-1, 3)))

    def rays(self, pixels: Any) -> npt.NDArray[np.float64]:
        """Return directions through pixels (n x 2): n x 3, float64, with depth 1 along the optical axis."""
        return self._native.rays(_array("pixels", pixels, (-1, 2)))

    def resized(self, image: Sequence[int]) -> Camera:
        """Return the same view at another image size."""
        return Camera(self._native.resized(_pixels("image", image)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._native == other._native

    def __hash__(self) -> int:
        return hash((self.image, self.focal_px, self.principal_px))

    def __reduce__(self) -> tuple[Any, ...]:
        return Camera.from_dict, (self.to_dict(),)

    def __repr__(self) -> str:
        (w, h), (fx, _), (x, y, z) = self.image, self.focal_px, self.center
        tilt = np.degrees(self.tilt)
        return f"Camera({w} x {h}, {fx:.1f} px, at [{x:.3f}, {y:.3f}, {z:.3f}] m, {tilt:.1f} degrees)"

    def _repr_html_(self) -> str:
        (w, h), (fx, fy), (cx, cy) = self.image, self.focal_px, self.principal_px
        x, y, z = self.center
        rows = [
            ("picture", f"{w} x {h} px"),
            ("focal length", f"{fx:.2f}, {fy:.2f} px"),
            ("principal point", f"{cx:.2f}, {cy:.2f} px"),
            ("centre", f"{x:.4f}, {y:.4f}, {z:.4f} m"),
            ("tilt", f"{np.degrees(self.tilt):.2f} degrees"),
        ]
        return table(("camera", ""), rows)


@dataclass(frozen=True)
class Solution:
    """A solved camera and its reliability."""

    #: The camera; the labelled rectangle is the plane ``z = 0``, centred.
    camera: Camera
    #: Width and height of the rectangle as fitted, metres.
    size: tuple[float, float]
    #: RMS reprojection error of the labelled corners, or of the labelled points if there are no corners,
    #: pixels.
    rms_px: float
    #: Probability of a worse fit by chance; None without degrees of freedom.
    p_value: float | None
    #: Relative standard deviation of the focal length; None if nothing is known about it.
    focal_sigma: float | None
    #: Standard deviation of the tilt, radians.
    tilt_sigma: float | None
    #: Warnings to review: ``code``, ``severity`` and ``message`` of each.
    warnings: list[dict[str, str]]
    #: The camera file that ``petcomp camera solve`` writes.
    file: dict[str, Any]


def solve(label: Mapping[str, Any] | str | os.PathLike[str], force: bool = False) -> Solution:
    """Solve the camera of a label: a file, or plain data in the format of ``NAME.label.json``.

    The result for a file is that of ``petcomp camera solve``, which also reads the focal length in the photo's EXIF
    data. Plain data are taken as they are.

    Raises ``CameraError``, or ``InvalidValueError`` for a size that is not in metres, a camera too far away to
    see objects and a lens that folds the corners of the image over. ``force`` accepts these three, and a
    camera that does not fit its label.
    """
    is_file = isinstance(label, (str, os.PathLike))
    text = _petcomp.read_label(path_of("label", label)) if is_file else dumped("label", label)
    camera, text = _petcomp.solve_camera(text, force)
    record = loaded(text)
    record["size"] = tuple(record["size"])
    return Solution(Camera(camera), **record)
