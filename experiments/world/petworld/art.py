"""Procedural printed matter: bottle labels as NumPy pictures."""

import numpy as np

# 5 x 7 letter shapes, one byte per row, most significant of 5 bits on the left.
_FONT = {
    "A": "0E11111F111111", "B": "1E11111E11111E", "C": "0E11101010110E", "D": "1E11111111111E",
    "E": "1F10101E10101F", "F": "1F10101E101010", "G": "0E11101713110F", "H": "1111111F111111",
    "I": "0E04040404040E", "K": "11121418141211", "L": "1010101010101F", "M": "111B1515111111",
    "N": "11191513111111", "O": "0E11111111110E", "P": "1E11111E101010", "Q": "0E11111115120D",
    "R": "1E11111E141211", "S": "0F10100E01011E", "T": "1F040404040404", "U": "1111111111110E",
    "V": "11111111110A04", "W": "1111111515150A", "X": "11110A040A1111", "Y": "1111110A040404",
    "Z": "1F01020408101F", "0": "0E11131519110E", "1": "040C040404040E", "2": "0E11010204081F",
    "3": "1F02040201110E", "5": "1F101E0101110E", ".": "00000000000C0C", "%": "18190204081303",
    " ": "00000000000000", "J": "0702020202120C",
}
_NAMES = ("AQUARO", "VELMO", "NORDIX", "FRESKA", "LUMINA", "KOLVA", "PERLE", "SOLARA", "BRIVO", "MIRELA")
_KINDS = ("MINERAL WATER", "COLA ZERO", "LEMON DRINK", "STILL WATER", "ORANGE SODA", "APPLE SPRITZ", "ICE TEA")


def text_mask(text, height, bold=1.0):
    """A smooth 0..1 mask of a line of text, height pixels tall."""
    rows = []
    for ch in text:
        bits = bytes.fromhex(_FONT.get(ch, _FONT[" "]))
        rows.append(np.array([[(b >> (4 - i)) & 1 for i in range(5)] + [0] for b in bits], float))
    m = np.concatenate(rows, 1)
    k = max(1, int(round(height / 7)))
    big = np.kron(np.pad(m, ((1, 1), (1, 1))), np.ones((k, k)))
    r = max(1, int(k * 0.95))
    ker = np.hanning(2 * r + 3)
    ker /= ker.sum()
    big = np.apply_along_axis(lambda v: np.convolve(v, ker, "same"), 0, big)
    big = np.apply_along_axis(lambda v: np.convolve(v, ker, "same"), 1, big)
    soft = max(0.06, 0.35 / k)
    return np.clip((big - (0.5 - 0.10 * bold)) / soft + 0.5, 0, 1)


def stamp(img, mask, top, left, colour):
    """Paint colour through mask at a position, wrapping around in x."""
    h, w = img.shape[:2]
    mh, mw = mask.shape
    y0, y1 = max(0, top), min(h, top + mh)
    if y1 <= y0:
        return
    xs = (left + np.arange(mw)) % w
    m = mask[y0 - top:y1 - top][..., None]
    img[y0:y1, xs] = img[y0:y1, xs] * (1 - m) + np.asarray(colour) * m


def hsv(h, s, v):
    k = (np.array([5.0, 3.0, 1.0]) + h * 6) % 6
    return v - v * s * np.clip(np.minimum(k, 4 - k), 0, 1)


def label(rng, height=256, width=1024):
    """An sRGB label picture (float 0..1) that wraps around in x."""
    hue = rng.random()
    light = rng.random() < 0.45
    main = hsv(hue, rng.uniform(0.55, 0.95), rng.uniform(0.35, 0.85))
    second = hsv((hue + rng.choice([0.08, 0.5, 0.6, 0.33])) % 1, rng.uniform(0.4, 0.95), rng.uniform(0.6, 0.95))
    paper = np.array([0.93, 0.93, 0.90]) if light else main
    ink = main if light else np.array([0.96, 0.96, 0.94])
    img = np.empty((height, width, 3))
    img[:] = paper
    y = np.arange(height)[:, None] / height
    x = np.arange(width)[None] / width
    if rng.random() < 0.5:               # vertical gradient
        img *= (1.0 - 0.28 * np.abs(y - rng.uniform(0.2, 0.8)))[..., None]
    wave = rng.uniform(0.6, 0.85) + rng.uniform(0.03, 0.09) * np.sin(2 * np.pi * (rng.integers(1, 4) * x + rng.random()))
    band = np.clip((y - wave) * height / 2, 0, 1)[..., None]
    img = img * (1 - band) + second * band
    edge = np.clip((np.abs(y - 0.5) - 0.465) * height / 1.5, 0, 1)[..., None]
    img = img * (1 - edge) + (main * 0.6) * edge
    name, kind = rng.choice(_NAMES), rng.choice(_KINDS)
    for rep in (0, 1):                   # two fronts, as most wrap labels have
        cx = int(width * (0.06 + 0.5 * rep))
        disc_r = height * rng.uniform(0.16, 0.26)
        dx = (np.arange(width)[None] - (cx + 0.27 * width) + width / 2) % width - width / 2
        disc = np.clip(disc_r - np.hypot(dx, (np.arange(height)[:, None] - 0.36 * height)), 0, 1)[..., None]
        if rng.random() < 0.8:
            img = img * (1 - disc) + second * disc
        m = text_mask(str(name), int(height * 0.32))
        stamp(img, m, int(height * 0.16), cx, ink)
        m = text_mask(str(kind), int(height * 0.11))
        stamp(img, m, int(height * 0.55), cx + 8, ink * 0.9)
        m = text_mask(f"{rng.choice(['0.5', '1.5', '0.33', '1.0'])} L  NET", int(height * 0.09))
        stamp(img, m, int(height * 0.78), cx + 8, ink if not light else np.array([0.15, 0.15, 0.2]))
        # fine print
        px = cx + int(0.34 * width)
        tone = np.array([0.1, 0.1, 0.12]) if light else np.array([0.92, 0.92, 0.9])
        for line in range(6):
            words = "".join(rng.choice(list("AEIOUNRSTL  ")) for _ in range(14))
            stamp(img, text_mask(words, 7, 0.6) * 0.85, int(height * (0.14 + 0.055 * line)), px, tone)
        if rep == 0:                     # bar code on a white field
            bw, bh = int(0.09 * width), int(0.30 * height)
            field = np.ones((bh + 12, bw + 12))
            stamp(img, field, int(height * 0.52), px, np.array([0.97, 0.97, 0.97]))
            bars = np.repeat(rng.random(bw // 2) < 0.5, 2)[:bw].astype(float)
            stamp(img, np.repeat(bars[None], bh, 0), int(height * 0.52) + 6, px + 6, np.array([0.03, 0.03, 0.03]))
        else:
            for line in range(5):
                words = "".join(rng.choice(list("0123 5%AN")) for _ in range(12))
                stamp(img, text_mask(words, 9, 0.6) * 0.9, int(height * (0.53 + 0.08 * line)), px, tone)
    return np.clip(img, 0, 1)
