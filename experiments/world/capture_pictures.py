"""The pictures of docs/capture.md, from the bottles of golden/capture.

    petcomp capture frames -o OUT/frames --size 1280x800 --width 1.28 --stripes
    python3 experiments/world/capture_pictures.py photos golden/capture/soft b00 OUT
    petcomp asset add OUT/photos/*.png --captured --empty OUT/empty/*.png --display OUT/frames/display.toml \\
        --name b00 --class cap --thickness 0.07 -o OUT/assets
    python3 experiments/world/capture_pictures.py pictures golden/capture/soft b00 OUT docs/images

The parts with the bottle are rendered (experiments/world); the rest of a photo shows the display, with sensor noise.
Needs numpy and opencv-python.
"""
import glob
import json
import os
import sys

import cv2
import numpy as np

GREY = (120, 120, 120)


def decode(codes):
    v = codes.astype(float) / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def encode(light):
    v = np.where(light <= 0.0031308, light * 12.92, 1.055 * np.clip(light, 0, None) ** (1 / 2.4) - 0.055)
    return np.round(255 * np.clip(v, 0, 1)).astype(np.uint8)


def read(path):
    return decode(cv2.imread(path)[..., :3])


class Place:
    """A rendered place: its display, and the position of the rendered view in a photo."""

    def __init__(self, folder):
        with open(os.path.join(folder, "place.json")) as handle:
            self.record = json.load(handle)
        self.folder = folder
        (w, h), (vw, vh) = self.record["display_px"], self.record["view_px"]
        self.left, self.top = (w - vw) // 2, (h - vh) // 2
        y, x = np.mgrid[0:h, 0:w]
        x, y = x + 0.5 - self.left, y + 0.5 - self.top
        u, v, s = np.tensordot(np.array(self.record["display_from_photo"]), np.stack([x, y, np.ones_like(x)]), 1)
        self.at = [np.clip((c / s).astype(int), 0, n - 1) for c, n in [(v, h), (u, w)]]
        view = [np.clip(c.astype(int), 0, n - 1) for c, n in [(y, vh), (x, vw)]]
        self.empty = [read(f"{folder}/empty_{k}.jpg")[view[0], view[1]] for k in ("black", "white")]
        self.rng = np.random.default_rng(1)

    def bare(self, frame):
        """A photo of a frame without a bottle."""
        light = read(frame)[self.at[0], self.at[1]]
        photo = self.empty[0] * (1 - light) + self.empty[1] * light
        sensor = self.record["sensor"]
        deviation = np.sqrt(sensor["shot"] ** 2 * photo + sensor["read"] ** 2)
        return photo + deviation * self.rng.standard_normal(photo.shape)

    def photo(self, frame, name, bottle):
        """A photo of a frame with the bottle."""
        photo = self.bare(frame)
        record = next(b for b in self.record["bottles"] if b["name"] == bottle)
        part = read(f"{self.folder}/{bottle}_{name}.jpg")
        x, y = self.left + record["crop_px"][0], self.top + record["crop_px"][1]
        photo[y:y + part.shape[0], x:x + part.shape[1]] = part
        return photo


def write_photos(folder, bottle, out):
    place = Place(folder)
    for name in ("photos", "empty"):
        os.makedirs(f"{out}/{name}", exist_ok=True)
    for frame in sorted(glob.glob(f"{out}/frames/*.png")):
        name = os.path.basename(frame)[3:-4]
        cv2.imwrite(f"{out}/photos/{name}.png", encode(place.photo(frame, name, bottle)))
        if name in ("black", "white"):
            cv2.imwrite(f"{out}/empty/{name}.png", encode(place.bare(frame)))


def strip(paths, height, part=np.s_[:, :]):
    """Put pictures side by side."""
    pictures = [cv2.imread(path)[part] for path in paths]
    sized = [cv2.resize(p, (round(p.shape[1] * height / p.shape[0]), height), interpolation=cv2.INTER_AREA) for p in pictures]
    framed = [cv2.copyMakeBorder(p, 10, 10, 5, 5, cv2.BORDER_CONSTANT, value=GREY) for p in sized]
    return np.hstack(framed)


def write_pictures(folder, bottle, out, images):
    frames = [f"{out}/frames/{name}.png" for name in ("00_black", "01_white", "02_stripes_x_coarse_1", "15_stripes_y_fine_2")]
    place = Place(folder)
    (vw, vh), top, left = place.record["view_px"], place.top, place.left
    photos = [f"{out}/photos/{name}.png" for name in ("black", "white", "stripes_y_fine_1")]
    save = lambda name, picture: cv2.imwrite(f"{images}/{name}.jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])
    save("capture_frames", strip(frames, 230))
    save("capture_photos", strip(photos, 180, np.s_[top:top + vh, left:left + vw]))
    save("capture_sheet", cv2.imread(f"{out}/assets/contact_sheet.png"))


if __name__ == "__main__":
    {"photos": write_photos, "pictures": write_pictures}[sys.argv[1]](*sys.argv[2:])
