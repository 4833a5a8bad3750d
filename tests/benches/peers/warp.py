#!/usr/bin/env python3
"""Warps a photo to a metric top view: `petcomp camera rectify` and OpenCV's warpPerspective on the same photo.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/warp.py [-o FOLDER]

The surface carries a pattern known in closed form (a zone plate over waves). Each pixel of the photo is the pattern's mean
over 8 x 8 samples, as linear floats. Both programs get the photo in memory and the true homography's corners, from which
petcomp solves its camera before timing starts. Error: RMSE between a top view and the pattern's mean over its pixels, for a
map as fine as the photo and one a quarter as fine, for which the photo is downscaled.
"""

import json

import cv2
import numpy as np

import camera
import linear
from side_by_side import INSIDE, Comparison, arguments, here, library, library_seconds, pinned, seconds_of, told, version

SAMPLES, TIMES = 8, 3
RINGS = 4000.0  # up to 430 cycles a metre in the corners: more than the coarse map can show, less than the photo can
MAPS = {"as fine as the photo": 1200.0, "a quarter as fine": 300.0}  # pixels per metre
VIEW = 40.0, 1.0  # tilt in degrees, distance in metres


def pattern(x, y):
    """Scene-linear grey at a point of the surface, metres from its centre."""
    rings = np.cos(RINGS * (x**2 + y**2))
    return 0.5 + 0.2 * rings + 0.2 * np.sin(140 * x) * np.cos(90 * y)


def mean_over_pixels(width, height, surface_from_pixel):
    """Render the pattern through a homography, each pixel the mean of its samples."""
    total = np.zeros((height, width))
    y, x = np.mgrid[:height, :width]
    for i in range(SAMPLES):
        for j in range(SAMPLES):
            at = np.stack([x + (i + 0.5) / SAMPLES, y + (j + 0.5) / SAMPLES, np.ones(x.shape)], axis=-1) @ surface_from_pixel.T
            total += pattern(at[..., 0] / at[..., 2], at[..., 1] / at[..., 2])
    return total / SAMPLES**2


def view():
    """Homography from metres on the tray to pixels of the photo (3 x 3), and the tray's corners in the photo."""
    tilt, away = np.radians(VIEW[0]), VIEW[1]
    c, s = np.cos(tilt), np.sin(tilt)
    rotation, translation = np.array([[1, 0, 0], [0, -c, -s], [0, s, -c]]), np.array([0, 0, away])
    homography = camera.K @ np.column_stack([rotation[:, 0], rotation[:, 1], translation])
    return homography, camera.projected(camera.CORNERS, rotation, translation)


def surface_from_map(px_per_metre):
    step, (width, height) = 1 / px_per_metre, camera.TRAY
    return np.array([[step, 0, -width / 2], [0, -step, height / 2], [0, 0, 1]])


def main():
    args = arguments(__doc__).parse_args()
    folder = args.output / "warp"
    homography, corners = view()
    label, = camera.write_labels(folder, [(None, None, corners)])
    grey = mean_over_pixels(camera.WIDTH, camera.HEIGHT, np.linalg.inv(homography))
    photo = np.repeat(grey[..., None], 3, axis=-1).astype(np.float32)
    linear.write_exr(folder / "photo.exr", photo)
    comparison = Comparison("warp", args, INSIDE, f"a photo of {camera.WIDTH} x {camera.HEIGHT} floats seen from above",
                            "root mean square to the surface's own pattern, linear light", "the pattern, 64 samples a pixel")
    for name, px_per_metre in MAPS.items():
        size = [round(side * px_per_metre) for side in camera.TRAY]
        wanted = mean_over_pixels(*size, surface_from_map(px_per_metre))
        petcomps(comparison, args, folder, label, name, px_per_metre, wanted)
        opencvs(comparison, photo, homography, name, px_per_metre, size, wanted)
    comparison.finish()


def error(found, wanted):
    inner = np.s_[8:-8, 8:-8]  # where a filter reaches beyond the tray is nobody's fault
    return float(np.sqrt(np.mean((found[inner] - wanted[inner]) ** 2)))


def petcomps(comparison, args, folder, label, name, px_per_metre, wanted):
    photo, top, program = folder / "photo.exr", folder / f"top_{px_per_metre:g}.exr", library()
    seconds_of(pinned(args.petcomp, "-q", "camera", "rectify", photo, label, "-o", top, "--px-per-metre", px_per_metre))
    work = ["rectify", photo, label, px_per_metre]
    comparison.add("petcomp", version([args.petcomp, "--version"]), f"default, {name}", told(pinned(program, TIMES, *work)),
                   lambda: library_seconds(program, TIMES, *work), lambda: error(linear.read_exr(top)[..., 0], wanted))


def opencvs(comparison, photo, homography, name, px_per_metre, size, wanted):
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])  # OpenCV's pixel (0, 0) has its centre at 0
    photo_from_map = np.linalg.inv(half) @ homography @ surface_from_map(px_per_metre) @ half
    for filtered in ("linear", "cubic", "area", "lanczos4"):
        made, flag = [None], getattr(cv2, f"INTER_{filtered.upper()}") | cv2.WARP_INVERSE_MAP
        def run(made=made, flag=flag):
            seconds, made[0] = here(lambda: cv2.warpPerspective(photo, photo_from_map, size, flags=flag))
            return seconds
        comparison.add("OpenCV warpPerspective", cv2.__version__, f"{filtered}, {name}",
                       f"cv2.warpPerspective(photo, photo_from_map, {tuple(size)}, flags=cv2.INTER_{filtered.upper()} | "
                       "cv2.WARP_INVERSE_MAP)", run, lambda made=made: error(made[0][..., 0], wanted), beside=f"default, {name}")


if __name__ == "__main__":
    main()
