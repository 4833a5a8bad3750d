"""A photo of film on a screen with full ground truth, and the errors of its mattes.

    photo = F + T K + noise

F is the light that the object adds, K the empty screen and T the share of K that reaches the camera in each channel, all
scene-linear. The object lies on its screen, so light passes through it twice: on its way to the screen and on its way
back. T is therefore less than V, the share that it lets through of a new background with its own light. A film is a pair
like F, V; a matte with a single alpha is the film (its premultiplied colour, 1 - alpha).
"""

import functools
import pathlib
from dataclasses import dataclass

import linear
import numpy as np

BACKGROUNDS, PATCHES, PATCH_PX = 3, 2000, 40
# Standard deviation of a sensor's noise, as in the sample world: read noise, and shot noise at a value of 1.
READ, SHOT = 0.002, 0.008


@dataclass
class Photo:
    name: str
    seen: np.ndarray  # the codes of the photo made linear again: what every method gets
    light: np.ndarray  # F
    passes: np.ndarray  # V
    cover: np.ndarray  # what the object covers, 0 to 1
    screen: np.ndarray  # mean colour of the screen beside the object


def photographed(name, light, passes, screen, cover, rng):
    exact = light + passes**2 * screen  # looked through and lit through
    noisy = exact + rng.normal(size=exact.shape) * np.sqrt(READ**2 + SHOT**2 * exact)
    codes = np.round(255 * linear.to_srgb(noisy)) / 255
    return Photo(name, linear.from_srgb(codes), light, passes, cover, screen[cover == 0].mean(axis=0))


def drawn(width=640, height=480, seed=1):
    """A synthetic crushed bottle: tinted film with folds and highlights, opaque cap and label, on an uneven green screen."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width] + 0.5
    u, v = (x - width / 2) / width, (y - height / 2) / height
    waves = [np.sin(2 * np.pi * (a * u + b * v + c)) / (1 + k / 4)
             for k, (a, b, c) in enumerate(rng.uniform(-1, 1, (12, 3)) * [14, 10, 1])]
    folds = sum(waves) / 3
    ragged = 0.012 * np.sin(40 * np.arctan2(v, u)) + 0.02 * np.sin(9 * np.arctan2(v, u) + 1)
    covers = lambda distance: np.clip(0.5 - distance * width, 0, 1)  # a pixel from outside to inside
    outside = (np.abs(u / 0.36) ** 3 + np.abs(v / 0.3) ** 3 - 1) / 9 + ragged / 4
    body = covers(outside)
    cap = covers(np.maximum(np.abs(u - 0.34) - 0.05, np.abs(v) - 0.1) / 1.2)
    label = covers(np.maximum(np.abs(u + 0.12) - 0.09, np.abs(v) - 0.22) / 1.2) * body
    # Two walls let through 0.77 or so; creases and the rim, seen aslant, less, and they reflect more.
    aslant = np.clip(1 - np.abs(folds) / 0.12, 0, 1) + 2 * np.exp(outside / 0.012) * body
    film = np.exp(-(1 + 1.5 * aslant)[..., None] * [0.26, 0.25, 0.25])
    shine = 0.05 + 0.08 * np.clip(folds, 0, None) + 0.06 * aslant + 0.9 * np.clip(folds - 0.9, 0, None)
    grey = np.ones(3)
    light, passes = shine[..., None] * [1.0, 1.0, 1.03], film
    stripes = 0.25 + 0.5 * (np.sin(60 * v) > 0)[..., None] * grey
    for part, colour, through in ((label, stripes * [1.0, 0.8, 0.75], 0.06), (cap, grey * [0.05, 0.12, 0.5], 0.0)):
        part = part[..., None]
        light, passes = light * (1 - part) + colour * part, passes * (1 - part) + through * part
    cover = np.maximum(body, cap)
    light, passes = light * cover[..., None], 1 - cover[..., None] * (1 - passes)
    screen = (0.8 + 0.3 * (u + 0.5) - 0.5 * v**2)[..., None] * [0.06, 0.42, 0.12]
    return photographed(f"drawn, {width} x {height}", light, passes, screen, cover, rng)


def known(folder, most):
    """Photos of a folder with ground truth: NAME.png, NAME_fg.exr (F), NAME_view.png (V, linear codes), NAME_plate.exr (K)."""
    for path in sorted(pathlib.Path(folder).glob("*_plate.exr"))[:most]:
        part = lambda ending: path.with_name(path.name.replace("_plate.exr", ending))
        cover = linear.read_codes(part("_mask.png"))
        yield Photo(part("").name, linear.from_srgb(linear.read_codes(part(".png"))), linear.read_exr(part("_fg.exr")),
                    linear.read_codes(part("_view.png")), cover, linear.read_exr(path)[cover == 0].mean(axis=0))


@functools.cache
def backgrounds(shape):
    """New backgrounds: patches of random colours and sizes."""
    rng, pictures = np.random.default_rng(7), []
    for _ in range(BACKGROUNDS):
        picture = np.full(shape, 0.2)
        for _ in range(PATCHES):
            y, x = (rng.integers(0, side) for side in shape[:2])
            down, across = rng.integers(1, PATCH_PX, 2)
            picture[y:y + down, x:x + across] = rng.random(3)
        pictures.append(picture)
    return pictures


def errors(photo, light, passes):
    """Mean absolute error of F + V B over new backgrounds B, in linear light, over all pixels and channels; and that of
    alpha = 1 - mean(V)."""
    passes = np.broadcast_to(passes, photo.passes.shape)
    off = [np.abs(light + passes * b - photo.light - photo.passes * b).mean() for b in backgrounds(photo.light.shape)]
    return {"error": float(np.mean(off)), "alpha_error": float(np.abs((passes - photo.passes).mean(axis=-1)).mean())}
