#!/usr/bin/env python3
"""Solves cameras from four corners of a rectangle of known size: petcomp and OpenCV on the same corners.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/camera.py [-o FOLDER] [--views N]

Random views show a tray of 0.56 x 0.37 m from a camera of known focal length, tilted by 5 to 65 degrees; corners have
half a pixel of noise (standard deviation). Error: RMS distance on the tray between the computed and the true position of a
pixel, over 25 pixels of each view. Seconds are those of one solution in memory: petcomp (library.rs) including standard
deviations and warnings; OpenCV called from Python, which costs some microseconds. `findHomography` uses no focal length.
"""

import json

import cv2
import numpy as np

from side_by_side import INSIDE, Comparison, arguments, here, library, library_seconds, pinned, seconds_of, told, version

WIDTH, HEIGHT, FOCAL = 1280, 960, 1300.0
TRAY = 0.56, 0.37
SIGMA_PX = 0.5
EXACT = 1e-6  # both programs know the same: lens, middle of the picture and size of the tray
CORNERS = np.array([[-TRAY[0], TRAY[1], 0], [TRAY[0], TRAY[1], 0], [TRAY[0], -TRAY[1], 0], [-TRAY[0], -TRAY[1], 0]]) / 2
GRID = np.array([[x, y, 0] for x in np.linspace(-0.4, 0.4, 5) * TRAY[0] for y in np.linspace(-0.4, 0.4, 5) * TRAY[1]])
K = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]])
TIMES = 10


def projected(points, rotation, translation):
    seen = (points @ rotation.T + translation) @ K.T
    return seen[:, :2] / seen[:, 2:]


def draw(rng):
    """Draw a camera that sees the whole tray: rotation and translation from the world to OpenCV's frame."""
    while True:
        tilt, turn, roll = np.radians([rng.uniform(5, 65), rng.uniform(0, 360), rng.uniform(-20, 20)])
        away = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        right = np.cross([np.sin(turn), np.cos(turn), 0.1], away)
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(-away, right), -away])
        rotation = cv2.Rodrigues(np.array([0, 0, roll]))[0] @ rotation
        translation = np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.8, 1.4)])
        corners = projected(CORNERS, rotation, translation)
        if np.all(corners > 5) and np.all(corners < [WIDTH - 5, HEIGHT - 5]):
            return rotation, translation, corners + rng.normal(scale=SIGMA_PX, size=(4, 2))


def write_labels(folder, views):
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for k, (_, _, corners) in enumerate(views):
        path = folder / f"view_{k:03}.label.json"
        path.write_text(json.dumps({
            "format": "plane-label", "version": 1, "image": {"file": "none.png", "width": WIDTH, "height": HEIGHT},
            "surface": {"id": "tray", "width_m": TRAY[0], "height_m": TRAY[1], "corners_px": corners.tolist(),
                        "corner_sigma_px": SIGMA_PX, "dimension_sigma_m": EXACT},
            "camera": {"focal_px": FOCAL, "focal_fixed": True, "principal_point_px": [WIDTH / 2, HEIGHT / 2],
                       "principal_point_sigma_px": EXACT}}))
        paths.append(path)
    return paths


def judged(views, found):
    """Errors of cameras (rotation, translation, K) or homographies (tray to pixels, 3 x 3)."""
    tray, degrees, away = [], [], []
    for (rotation, translation, _), other in zip(views, found):
        if isinstance(other, tuple):
            r, t, k = other
            homography = k @ np.column_stack([r[:, 0], r[:, 1], t])
            degrees.append(np.degrees(np.linalg.norm(cv2.Rodrigues(r @ rotation.T)[0])))
            away.append(1e3 * np.linalg.norm(r.T @ t - rotation.T @ translation))
        else:
            homography = other
        pixels = np.column_stack([projected(GRID, rotation, translation), np.ones(len(GRID))])
        back = pixels @ np.linalg.inv(homography).T
        tray.extend(1e3 * np.linalg.norm(back[:, :2] / back[:, 2:] - GRID[:, :2], axis=1))
    root = lambda values: float(np.sqrt(np.mean(np.square(values)))) if values else None
    return {"error": root(tray), "rotation_deg": root(degrees), "position_mm": root(away)}


def petcomps(comparison, views, args):
    labels, program = write_labels(args.output / "camera", views), library()
    seconds_of(pinned(args.petcomp, "-q", "camera", "solve", *labels))

    def found():
        for path in labels:
            opencv = json.loads(path.with_name(path.name.replace(".label.", ".camera.")).read_text())["opencv"]
            half = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])  # OpenCV's pixel (0, 0) has its centre at 0
            yield np.array(opencv["R"]), np.array(opencv["t"]), np.array(opencv["K"]) + half

    add(comparison, "petcomp", version([args.petcomp, "--version"]), "default, known focal length",
        f"{told(pinned(program, TIMES, 'solve', labels[0]))} ..", views, found,
        lambda: library_seconds(program, TIMES, "solve", *labels) / len(labels))


def opencvs(comparison, views):
    def pnp(flag):
        def solve(corners):
            _, r, t = cv2.solvePnP(CORNERS, corners, K, None, flags=flag)
            return cv2.Rodrigues(r)[0], t[:, 0], K
        return solve

    ways = {"solvePnP, iterative": pnp(cv2.SOLVEPNP_ITERATIVE), "solvePnP, IPPE": pnp(cv2.SOLVEPNP_IPPE),
            "solvePnP, SQPNP": pnp(cv2.SOLVEPNP_SQPNP),
            "findHomography, no focal length": lambda corners: cv2.findHomography(CORNERS[:, :2], corners)[0]}
    for setting, solve in ways.items():
        found = [None] * len(views)
        def run(solve=solve, found=found):
            seconds, found[:] = here(lambda: [solve(corners) for _, _, corners in views])
            return seconds / len(views)
        add(comparison, "OpenCV", cv2.__version__, setting, f"cv2.{setting}", views, lambda found=found: found, run)


def add(comparison, program, tells, setting, command, views, found, run):
    of = lambda key: judged(views, found())[key]
    comparison.add(program, tells, setting, command, run, error=lambda: of("error"),
                   more=lambda: {key: of(key) for key in ("rotation_deg", "position_mm")})


def main():
    parser = arguments(__doc__)
    parser.add_argument("--views", type=int, default=200)
    args = parser.parse_args()
    rng = np.random.default_rng(1)
    views = [draw(rng) for _ in range(args.views)]
    comparison = Comparison("camera", args, INSIDE, f"{args.views} views of a rectangle, corners {SIGMA_PX} px off, one at a time",
                            "place on the rectangle, root mean square, mm", "the cameras that drew the views")
    petcomps(comparison, views, args)
    opencvs(comparison, views)
    comparison.finish()


if __name__ == "__main__":
    main()
