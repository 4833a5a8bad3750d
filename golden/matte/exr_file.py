"""Scan-line OpenEXR files of 32-bit floats, in plain Python: enough for pictures of test size.

Rows are stored from the top.  A picture is (width, height, {channel name: bytes of little-endian floats}).
"""

import struct
import zlib

FLOAT = 2
NO_COMPRESSION, ZIPS, ZIP = 0, 2, 3
ROWS_PER_BLOCK = {NO_COMPRESSION: 1, ZIPS: 1, ZIP: 16}


def attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def zipped(raw):
    """Split into even and odd bytes, take differences of neighbours, deflate; as it is where that is not smaller."""
    parts = bytearray(raw[0::2] + raw[1::2])
    for i in range(len(parts) - 1, 0, -1):
        parts[i] = (parts[i] - parts[i - 1] + 128) & 255
    packed = zlib.compress(bytes(parts), 9)
    return packed if len(packed) < len(raw) else bytes(raw)


def write(path, width, height, channels, compression=ZIP):
    """Write channels of float bytes."""
    names = sorted(channels)
    entries = b"".join(n.encode() + b"\0" + struct.pack("<iBxxxii", FLOAT, 0, 1, 1) for n in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2) + b"".join((
        attribute("channels", "chlist", entries), attribute("compression", "compression", bytes([compression])),
        attribute("dataWindow", "box2i", window), attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)))) + b"\0"
    row, blocks, rows = 4 * width, [], ROWS_PER_BLOCK[compression]
    for top in range(0, height, rows):
        lines = range(top, min(top + rows, height))
        packed = b"".join(channels[n][y * row:(y + 1) * row] for y in lines for n in names)
        packed = packed if compression == NO_COMPRESSION else zipped(packed)
        blocks.append(struct.pack("<ii", top, len(packed)) + packed)
    at = len(header) + 8 * len(blocks)
    with open(path, "wb") as out:
        out.write(header)
        for block in blocks:
            out.write(struct.pack("<Q", at))
            at += len(block)
        out.write(b"".join(blocks))


def text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def read_header(data):
    attributes, at = {}, 8
    while data[at]:
        name, at = text(data, at)
        _kind, at = text(data, at)
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def channel_names(entries):
    names, at = [], 0
    while entries[at]:
        name, at = text(entries, at)
        if struct.unpack_from("<i", entries, at)[0] != FLOAT:
            raise ValueError("channel %s is not 32-bit float" % name)
        names.append(name)
        at += 16
    return names


def unzip(block, size):
    """Undo deflate, the difference of neighbouring bytes, and the split into odd and even bytes."""
    if len(block) == size:
        return block
    raw = bytearray(zlib.decompress(block))
    for i in range(1, len(raw)):
        raw[i] = (raw[i - 1] + raw[i] - 128) & 255
    half = (len(raw) + 1) // 2
    out = bytearray(len(raw))
    out[0::2], out[1::2] = raw[:half], raw[half:]
    return bytes(out)


def read(path):
    """Return (width, height, channels)."""
    with open(path, "rb") as source:
        data = source.read()
    attributes, at = read_header(data)
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names = channel_names(attributes["channels"])
    compression = attributes["compression"][0]
    rows = ROWS_PER_BLOCK[compression]
    channels = {n: bytearray(4 * width * height) for n in names}
    for block in range((height + rows - 1) // rows):
        start, = struct.unpack_from("<Q", data, at + 8 * block)
        y, size = struct.unpack_from("<ii", data, start)
        count = min(rows, y1 + 1 - y)
        line = 4 * width * len(names)
        packed = data[start + 8:start + 8 + size]
        raw = packed if compression == NO_COMPRESSION else unzip(packed, count * line)
        for i in range(count):
            for k, name in enumerate(names):
                to, of = 4 * width * (y - y0 + i), i * line + 4 * width * k
                channels[name][to:to + 4 * width] = raw[of:of + 4 * width]
    return width, height, {n: bytes(c) for n, c in channels.items()}
