#!/usr/bin/env python3
"""Make a reference world of crushed PET bottles with exact ground truth.

Five kinds of results, all deterministic for given seeds and settings:

  world.py bottles      one crushed bottle on a uniform green, blue or grey screen
  world.py backgrounds  a table with a plastic tray and a robot arm, from above
  world.py piles        the same bottles piled physically in the tray
  world.py shadows      how dark the shadow of each bottle is
  world.py displays     bottles on a luminous display that shows one picture after the other

Run with Python 3.11 and the bpy package:

  python3 world.py bottles --out OUT --library-seed 1 --count 4
"""

import argparse
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
# NumPy's linear algebra rounds differently on other processors, and a crush is chaotic: its kernels for AVX2 everywhere.
# Its threads wait for each other longer than they work.
os.environ |= {"OPENBLAS_CORETYPE": "Haswell", "OPENBLAS_NUM_THREADS": "1"}


def positive(kind):
    def parse(text):
        v = kind(text)
        if not v > 0:
            raise argparse.ArgumentTypeError(f"must be positive: {text}")
        return v
    return parse


def between(lo, hi, kind=float):
    def parse(text):
        v = kind(text)
        if not lo <= v <= hi:
            raise argparse.ArgumentTypeError(f"must be between {lo} and {hi}: {text}")
        return v
    return parse


def parser():
    from petworld import crush
    p = argparse.ArgumentParser(prog="world.py", description="Reference world of crushed PET bottles.")
    sub = p.add_subparsers(dest="command", required=True)

    def common(name, text):
        q = sub.add_parser(name, help=text, description=text)
        q.add_argument("--out", required=True, metavar="DIR", help="output folder, with a subfolder for each kind")
        q.add_argument("--seed", type=between(0, 2**31, int), default=1, help="seed of cameras, lights, poses and noise (default 1)")
        q.add_argument("--first", type=between(0, 10**6, int), default=0, help="index of the first picture set (default 0)")
        q.add_argument("--count", type=positive(int), default=1, help="number of picture sets (default 1)")
        q.add_argument("--spp", type=between(1, 4096, int), default=32, help="render samples per pixel (default 32)")
        q.add_argument("--threads", type=between(1, 256, int), default=3, help="render threads (default 3)")
        q.add_argument("--no-denoise", action="store_true", help="do not denoise the renders")
        q.add_argument("--noise", type=between(0, 20), default=1.0, help="sensor noise, relative to a good camera (default 1)")
        q.add_argument("--blur", type=between(0, 5), default=0.35, help="optical blur, sigma in pixels (default 0.35)")
        q.add_argument("--exposure", type=between(0.05, 20), default=1.0, help="exposure factor (default 1)")
        q.add_argument("--cost-log", metavar="FILE", help="append the time of each picture to FILE as JSON lines")
        return q

    def library(q):
        q.add_argument("--library-seed", type=between(0, 2**31, int), default=1, help="seed of the bottle library (default 1)")
        q.add_argument("--cache", metavar="DIR", help="folder in which to keep crushed shapes between runs")
        q.add_argument("--wall", choices=("solid", "thin"), help="refracting double wall, or one thin surface")

    b = common("bottles", "photos of single bottles on a screen, with their outlines")
    library(b)
    b.set_defaults(wall="solid")
    b.add_argument("--photos", type=between(1, 8, int), default=2, help="photos per bottle, each of another flat side (default 2)")
    b.add_argument("--width", type=between(64, 4096, int), default=640, help="picture width in pixels (default 640)")
    b.add_argument("--screen", choices=("auto", "green", "blue", "grey"), default="auto", help="screen colour (default: one not in the bottle)")
    b.add_argument("--light", choices=("auto", "soft", "window", "lamp", "overhead"), default="auto")
    b.add_argument("--uneven", type=between(0, 1), default=0.0, help="extra uneven screen light, 0 to 1 (default 0)")
    b.add_argument("--albedo-jitter", type=between(0, 1), default=0.0, help="log-normal spread of the screen colour (default 0)")
    b.add_argument("--colour", choices=("clear", "blue", "green", "brown"), help="force the plastic's colour")
    b.add_argument("--style", choices=tuple(crush.STYLES), help="force the bottle style")
    b.add_argument("--litres", type=float, choices=tuple(crush.SIZES), help="force the nominal volume")
    b.add_argument("--class", dest="bottle_class", type=int, choices=(0, 1, 2, 3), help="force the class: 0 cap+label, 1 cap, 2 label, 3 none")
    b.add_argument("--flatness", type=between(0.15, 0.9), help="force the pressing gap, relative to the diameter")

    d = common("displays", "light of bottles on a luminous display, picture by picture, and on painted screens")
    library(d)
    d.set_defaults(wall="solid")

    s = common("shadows", "light that a floor loses under single bottles")
    library(s)
    s.set_defaults(spp=256)

    def tray(q):
        q.add_argument("--width", type=between(64, 4096, int), help="picture width in pixels")
        q.add_argument("--height", type=between(64, 4096, int), help="picture height in pixels")
        q.add_argument("--room-seed", type=between(0, 2**31, int), default=1, help="seed of table, tray, arm and clutter (default 1)")
        q.add_argument("--tray", default="0.56x0.37", metavar="LxW", help="tray floor in metres (default 0.56x0.37)")
        q.add_argument("--format", choices=("png", "jpg"), default="png", help="format of the 8-bit picture (default png)")

    g = common("backgrounds", "the empty tray on its table, with pose ground truth")
    tray(g)
    g.set_defaults(width=1280, height=960)
    g.add_argument("--views", default="fronto,above,tilted", help="comma-separated list of fronto, above, tilted, extreme; used in turn")
    g.add_argument("--lights", default="bright,dim,ambient", help="comma-separated list of bright, dim, ambient; used in turn")

    g.add_argument("--paper", action="store_true", help="put a sheet of white paper in the tray")

    l = common("piles", "bottles piled in the tray, with detection ground truth")
    library(l)
    tray(l)
    l.set_defaults(width=640, height=480, wall="thin")
    l.add_argument("--library-count", type=positive(int), default=136, help="number of bottles of the library that may appear (default 136)")
    l.add_argument("--bottles", default="5-13", metavar="MIN-MAX", help="bottles per pile (default 5-13)")
    l.add_argument("--mode", choices=("test", "cycle", "real"), default="test",
                   help="test: every light x every camera position per pile; cycle: one picture per pile, the combinations in "
                        "turn; real: bright light, one camera, bottles taken off the top one by one")
    l.add_argument("--steps", type=between(1, 50, int), default=6, help="pictures per pile in mode real (default 6)")
    l.add_argument("--visible", type=between(0.5, 1), default=0.97, help="visible share from which a bottle counts as unobstructed (default 0.97)")
    return p


def check(p, a):
    if getattr(a, "views", None) is not None:
        a.views = [v for v in a.views.split(",") if v]
        bad = set(a.views) - {"fronto", "above", "tilted", "extreme"}
        if bad or not a.views:
            p.error(f"--views: unknown {sorted(bad)}" if bad else "--views: empty")
    if getattr(a, "lights", None) is not None:
        a.lights = [v for v in a.lights.split(",") if v]
        bad = set(a.lights) - {"bright", "dim", "ambient"}
        if bad or not a.lights:
            p.error(f"--lights: unknown {sorted(bad)}" if bad else "--lights: empty")
    if getattr(a, "tray", None) is not None:
        try:
            l, w = (float(q) for q in a.tray.split("x"))
        except ValueError:
            p.error(f"--tray: not LxW: {a.tray}")
        if not (0.1 <= w <= 1.5 and 0.1 <= l <= 1.5):
            p.error("--tray: sides must be between 0.1 and 1.5 m")
        a.tray = (l, w)
    if getattr(a, "bottles", None) is not None and a.command == "piles":
        try:
            lo, hi = (int(q) for q in a.bottles.split("-"))
        except ValueError:
            p.error(f"--bottles: not MIN-MAX: {a.bottles}")
        if not 1 <= lo <= hi <= 60 or hi > a.library_count:
            p.error("--bottles: want 1 <= MIN <= MAX <= 60 and no more than --library-count")
        a.bottles = (lo, hi)
    return a


def main(argv):
    p = parser()
    a = check(p, p.parse_args(argv))
    from petworld import display, photos, shadows, trays
    {"bottles": photos.run, "displays": display.run, "shadows": shadows.run, "backgrounds": trays.run_backgrounds, "piles": trays.run_piles}[a.command](a)


if __name__ == "__main__":
    main(sys.argv[1:])
