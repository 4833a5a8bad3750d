"""Writes the HEIC pictures of this folder as phones do, 48 x 32 pixels by pillow-heif, and one of them as a JPEG."""

import struct

import numpy
import pillow_heif
from PIL import Image, ImageCms

W, H = 48, 32
LOSSLESS = {"quality": -1, "chroma": 444}
# Colorants of Display P3 under D50.
P3 = {b"rXYZ": (0.51512, 0.2412, -0.00105), b"gXYZ": (0.29198, 0.69225, 0.04189), b"bXYZ": (0.1571, 0.06657, 0.78407)}


def p3_profile():
    """The profile of sRGB with other colorants."""
    icc = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    for tag in range(struct.unpack(">I", icc[128:132])[0]):
        name, at, _ = struct.unpack(">4sII", icc[132 + 12 * tag : 144 + 12 * tag])
        if name in P3:
            icc[at + 8 : at + 20] = struct.pack(">3i", *(round(v * 65536) for v in P3[name]))
    return bytes(icc)


def camera_notes():
    """Held upright, a lens of 26 mm."""
    exif = Image.Exif()
    exif[0x0112] = 6
    exif.get_ifd(0x8769).update({0xA405: 26, 0xA002: W, 0xA003: H})
    return exif.tobytes()


pillow_heif.register_heif_opener()
y, x = numpy.mgrid[0:H, 0:W]
red, green = 255 * x // (W - 1), 255 * y // (H - 1)
ramp = numpy.stack([red, green, 0 * x + 128], 2).astype(numpy.uint8)
photo = Image.fromarray(ramp)
described = {"exif": camera_notes(), "icc_profile": p3_profile()}
photo.save("phone.heic", **LOSSLESS, **described)
photo.save("phone.jpg", quality=100, subsampling=0, **described)
Image.fromarray(numpy.dstack([ramp, 255 - red]).astype(numpy.uint8)).save("alpha.heic", **LOSSLESS)
deep = (numpy.stack([x * H + y] * 3, 2) * 65535 // (W * H - 1)).astype(numpy.uint16)
pillow_heif.from_bytes("RGB;16", (W, H), deep.tobytes()).save("deep.heic", **LOSSLESS)
