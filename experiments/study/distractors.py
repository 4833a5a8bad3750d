"""Unlabelled things that fall among the bottles, drawn on a green screen: a cap, a ring, a carton and a can."""

import cv2
import numpy as np

SCREEN = (62, 168, 58)
SIZE = 400
NOISE_SIGMA = 1.5
# Length in metres, longer sides over shorter ones, colours of the middle and of the edges (red, green, blue).
THINGS = {
    "cap": (0.03, 1.0, (40, 80, 190), (25, 55, 140)),
    "ring": (0.032, 1.0, (215, 215, 210), (180, 180, 175)),
    "carton": (0.16, 1.5, (150, 112, 74), (120, 88, 58)),
    "can": (0.115, 1.75, (196, 198, 202), (90, 92, 98)),
}


def entries(folder):
    """Entries of the distractors for a list of photos."""
    return [entry(name, draw(name, folder / f"{name}.png"), THINGS[name][0]) for name in THINGS]


def entry(name, path, length):
    return f'[[photos]]\nfile = "{path}"\nasset = "{name}"\nrole = "distractor"\nlength = {length}\n'


def draw(name, path):
    _, ratio, middle, edge = THINGS[name]
    outline = silhouette(name, ratio)
    across = np.abs(np.linspace(-1, 1, SIZE))[:, None, None] ** 2
    surface = np.array(middle) * (1 - across) + np.array(edge) * across
    picture = outline[..., None] * surface + (1 - outline[..., None]) * SCREEN
    noise = np.random.default_rng(0).normal(0, NOISE_SIGMA, picture.shape)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.clip(picture + noise, 0, 255).astype(np.uint8)[..., ::-1])
    return path.resolve()


def silhouette(name, ratio):
    """1 inside, 0 outside, antialiased."""
    mask = np.zeros((SIZE, SIZE), np.uint8)
    middle, reach = SIZE // 2, SIZE // 3
    if name in ("cap", "ring"):
        cv2.circle(mask, (middle, middle), reach, 255, -1, cv2.LINE_AA)
    else:
        half = round(reach / ratio)
        cv2.rectangle(mask, (middle - reach, middle - half), (middle + reach, middle + half), 255, -1)
    if name == "ring":
        cv2.circle(mask, (middle, middle), reach * 3 // 4, 0, -1, cv2.LINE_AA)
    return cv2.GaussianBlur(mask, (0, 0), 0.7) / 255
