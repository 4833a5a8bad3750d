"""Input pictures for the keyer, made from nothing but a seed."""

import math
import random
import struct

import exr_file

NAN, INF = float("nan"), float("inf")
# What single precision has in odd corners: the last are the smallest and largest normal and a subnormal number.
ODD_VALUES = (NAN, INF, -INF, 0.0, -0.0, 1.0, -1.0, 0.5, 3e38, -3e38, 1e-30, 1e30, 1.17549435e-38, 1e-42, -1e-42)


def floats(values):
    return struct.pack("<%df" % len(values), *values)


def write(path, width, height, pixel):
    """Write an RGBA picture from pixel(x, y) -> (r, g, b, a), rows from the top."""
    rows = [pixel(x, y) for y in range(height) for x in range(width)]
    exr_file.write(path, width, height, {c: floats([p[k] for p in rows]) for k, c in enumerate("RGBA")})


def studio(path, width, height, seed, screen, noise=0.02):
    """A soft-edged striped disc and a few thin lines before a noisy screen, lit unevenly."""
    r = random.Random(seed)
    radius = 0.33 * min(width, height)

    def pixel(x, y):
        cover = min(1.0, max(0.0, (radius - math.hypot(x - width * 0.55, y - height * 0.45)) / 2.5 + 0.5))
        cover = max(cover, 0.6 if (x + 2 * y) % 17 == 3 else 0.0)
        front = (0.6, 0.3, 0.2) if (x + y) % 6 < 3 else (0.75, 0.72, 0.7)
        light = 0.9 + 0.2 * x / width
        rgb = [light * (cover * f + (1 - cover) * s) + r.gauss(0, noise) for f, s in zip(front, screen)]
        return (*rgb, 1.0)

    write(path, width, height, pixel)


def wild(path, width, height, seed, alpha=True):
    """High dynamic range, negative values, and alpha of all sizes."""
    r = random.Random(seed)

    def pixel(_x, _y):
        scale = 10 ** r.uniform(-2, 1.5)
        return (*(r.gauss(0.4, 0.5) * scale for _ in range(3)), r.choice((0, 1, 1, r.random(), 1.5)) if alpha else 1.0)

    write(path, width, height, pixel)


def odd(path, width, height, seed):
    """A screen with pixels of NaN, infinity, extreme and subnormal numbers."""
    r = random.Random(seed)

    def pixel(_x, _y):
        base = [0.1 + 0.2 * r.random(), 0.7 - 0.4 * r.random(), 0.2, 1.0]
        if r.random() < 0.2:
            base[r.randrange(4)] = r.choice(ODD_VALUES)
        return tuple(base)

    write(path, width, height, pixel)


def plate(path, width, height, seed, noise=0.03, ties=False):
    """An uneven green screen; with ties, of cyan, yellow, grey and negative pixels in between."""
    r = random.Random(seed)
    tie = ((0.1, 0.6, 0.6), (0.6, 0.6, 0.1), (0.5, 0.5, 0.5), (0.6, 0.1, 0.6), (-0.2, 0.4, -0.1))

    def pixel(x, y):
        if ties and r.random() < 0.3:
            return (*r.choice(tie), 1.0)
        light = 0.8 + 0.4 * (x + y) / (width + height)
        return (*(light * c + r.gauss(0, noise) for c in (0.1, 0.7, 0.2)), 1.0)

    write(path, width, height, pixel)


def mask(path, width, height, seed, low=0.0, high=1.0):
    """Blocks of soft matte values, the same in every channel."""
    r = random.Random(seed)
    blocks = {(i, j): r.choice((0, 0, 0, 1, r.random())) for i in range(9) for j in range(9)}

    def pixel(x, y):
        value = low + (high - low) * blocks[9 * x // width, 9 * y // height]
        return (value,) * 4

    write(path, width, height, pixel)
