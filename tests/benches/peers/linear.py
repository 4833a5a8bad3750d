"""Reads and writes scene-linear images with OpenEXR and OpenCV, as arrays of rows from the top."""

import cv2
import numpy as np
import OpenEXR


def to_srgb(linear):
    """Encode as display values 0 to 1 (IEC 61966-2-1)."""
    c = np.clip(linear, 0, 1)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * np.maximum(c, 1e-9) ** (1 / 2.4) - 0.055)


def from_srgb(display):
    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)


def write_codes(path, codes):
    """Write 8 or 16 bit codes, R G B or grey, as PNG or JPEG."""
    if not cv2.imwrite(str(path), codes[..., ::-1] if codes.ndim == 3 else codes):
        raise OSError(f"{path}: not written")


def read_codes(path):
    """Read codes as fractions of full scale: R G B, R G B A or grey."""
    codes = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if codes is None:
        raise OSError(f"{path}: not a picture")
    shares = codes / np.iinfo(codes.dtype).max
    return shares[..., [2, 1, 0, *range(3, shares.shape[2])]] if shares.ndim == 3 else shares


def write_exr(path, rgb, dtype=np.float32, compression=OpenEXR.ZIP_COMPRESSION):
    planes = {name: np.ascontiguousarray(rgb[..., k].astype(dtype)) for k, name in enumerate("RGBA"[:rgb.shape[2]])}
    OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage}, planes).write(str(path))


def read_exr(path, names="RGB"):
    """Read channels of the first part, stacked along the last axis."""
    planes = OpenEXR.File(str(path), separate_channels=True).channels()
    return np.stack([planes[name].pixels.astype(np.float64) for name in names], axis=-1)
