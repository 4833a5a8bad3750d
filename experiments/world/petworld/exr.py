"""Reading OpenEXR files without compression, channel by channel."""

import struct

import numpy as np


def read(path):
    """The float channels of a scan-line file, by name, row 0 on top."""
    data = open(path, "rb").read()
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError(f"{path}: not an OpenEXR file")
    header, at = _header(data)
    if header["compression"] != b"\0":
        raise ValueError(f"{path}: compressed, expected plain scan lines")
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names = _channels(header["channels"])
    offsets = struct.unpack_from(f"<{height}Q", data, at)
    rows = [np.frombuffer(data, "<f4", len(names) * width, o + 8).reshape(len(names), width) for o in offsets]
    planes = np.stack(rows, 1)
    return dict(zip(names, planes))


def _header(data):
    at, fields = 8, {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        size, = struct.unpack_from("<i", data, at)
        fields[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return fields, at + 1


def _channels(data):
    at, names = 0, []
    while data[at]:
        name, at = _text(data, at)
        if struct.unpack_from("<i", data, at)[0] != 2:
            raise ValueError(f"channel {name}: not 32-bit floats")
        names.append(name)
        at += 16
    return names


def _text(data, at):
    end = data.index(0, at)
    return data[at:end].decode(), end + 1
