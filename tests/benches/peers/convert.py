#!/usr/bin/env python3
"""Reads, writes and compares images: petcomp and OpenImageIO's `oiiotool`, `petcomp diff` and its `idiff`.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/convert.py [-o FOLDER] [--size W H]

Writes convert.json and diff.json. Both sides are timed as whole processes. petcomp has no command that only converts, so a
separate program (library.rs) calls its library as the stages do when they read and write. EXR is scene-linear, PNG and
JPEG are sRGB; both programs convert. Both use their default compression level; `bytes` is the resulting size. Error of a
conversion: RMSE to the source in linear light, as OpenEXR or OpenCV reads the file back. `petcomp diff` also computes SSIM
and FLIP, unlike `idiff`. Error of a comparison: relative error of the mean difference that it reports.
"""

import re

import numpy as np

import bottle
import linear
from side_by_side import CORES, WHOLE, Comparison, arguments, library, pinned, seconds_of, spent, told, version

TO_SRGB, TO_LINEAR = ["--colorconvert", "linear", "sRGB"], ["--colorconvert", "sRGB", "linear"]
CONVERSIONS = {
    "EXR float to EXR half": ("float.exr", "half.exr", ["-d", "half"]),
    "EXR float to PNG 16": ("float.exr", "16.png", [*TO_SRGB, "-d", "uint16"]),
    "EXR float to JPEG 95": ("float.exr", "95.jpg", [*TO_SRGB, "--compression", "jpeg:95"]),
    "EXR half to EXR half": ("given_half.exr", "half.exr", ["-d", "half"]),
    "PNG 16 to EXR half": ("given_16.png", "half.exr", [*TO_LINEAR, "-d", "half"]),
    "JPEG to EXR half": ("given.jpg", "half.exr", [*TO_LINEAR, "-d", "half"]),
}
COMPARED = ("given_half.exr", "given_16.png", "given.jpg")
# What both programs leave with when pictures differ: 0 alike, 1 a warning, 2 a failure.
DIFFERENT = (0, 1, 2)


def write(folder, seen):
    """Write the same image in every format, and another that differs by a little grain."""
    codes = lambda picture, most: np.round(most * linear.to_srgb(picture))
    grain = np.random.default_rng(3).normal(scale=0.01, size=seen.shape)
    for prefix, picture in (("", seen), ("other_", np.clip(seen + grain, 0, 1))):
        at = lambda name: folder / (prefix + name)
        linear.write_exr(at("float.exr"), picture)
        linear.write_exr(at("given_half.exr"), picture, dtype=np.float16)
        linear.write_codes(at("given_16.png"), codes(picture, 65535).astype(np.uint16))
        linear.write_codes(at("given.jpg"), codes(picture, 255).astype(np.uint8))


def stored(path):
    """Values as stored in the file: floats, or codes as fractions of full scale."""
    return linear.read_exr(path) if path.suffix == ".exr" else linear.read_codes(path)


def made_linear(path):
    return stored(path) if path.suffix == ".exr" else linear.from_srgb(stored(path))


def conversions(args, folder, described):
    comparison = Comparison("convert", args, WHOLE, described, "root mean square, linear light", "the source of each, read by OpenEXR and OpenCV")
    program, ours = library(), version([args.petcomp, "--version"])

    def add(name, tells, setting, command, source, target, **beside):
        error = lambda: float(np.sqrt(np.mean((made_linear(target) - made_linear(source)) ** 2)))
        comparison.add(name, tells, setting, told(command), lambda: seconds_of(command), error,
                       more=lambda: {"bytes": target.stat().st_size}, **beside)

    for setting, (source, target, words) in CONVERSIONS.items():
        out = folder / f"petcomp_{setting.replace(' ', '_')}_{target}"
        add("petcomp", ours, setting, pinned(program, 1, "convert", folder / source, out), folder / source, out)
    with comparison.absent_if_it_fails("oiiotool"):
        theirs = version([args.oiiotool, "--version"])
        for setting, (source, target, words) in CONVERSIONS.items():
            out = folder / f"oiiotool_{setting.replace(' ', '_')}_{target}"
            command = pinned(args.oiiotool, "--threads", len(CORES), folder / source, *words, "-o", out)
            add("oiiotool", theirs, setting, command, folder / source, out, beside=setting)
    comparison.finish()


def comparisons(args, folder, described):
    comparison = Comparison("diff", args, WHOLE, described, "of the mean difference that is told, relative", "NumPy on what OpenEXR and OpenCV read")

    def add(program, tells, name, command, **beside):
        paths = [folder / name, folder / f"other_{name}"]
        said = [""]
        def run():
            seconds, said[0] = spent(pinned(*command, *paths), accept=DIFFERENT)
            return seconds
        def error():
            true = np.abs(stored(paths[0]) - stored(paths[1])).mean()
            return abs(float(re.search(r"Mean error\s*=\s*([\d.e+-]+)", said[0]).group(1)) - true) / true
        comparison.add(program, tells, name, told(pinned(*command, *paths)), run, error, **beside)

    ours = version([args.petcomp, "--version"])
    for name in COMPARED:
        add("petcomp", ours, name, [args.petcomp, "-j", len(CORES), "diff"])
    with comparison.absent_if_it_fails("idiff"):
        theirs = version([args.oiiotool, "--version"])
        for name in COMPARED:
            add("idiff", theirs, name, [args.idiff], beside=name)
    comparison.finish()


def main():
    parser = arguments(__doc__)
    parser.add_argument("--size", type=int, nargs=2, default=[1280, 960], metavar=("W", "H"))
    parser.add_argument("--oiiotool", default="oiiotool", metavar="PROGRAM")
    parser.add_argument("--idiff", default="idiff", metavar="PROGRAM")
    args = parser.parse_args()
    folder = args.output / "convert"
    folder.mkdir(parents=True, exist_ok=True)
    write(folder, np.clip(bottle.drawn(*args.size).seen, 0, 1))
    described = "a noisy photo of {} x {}".format(*args.size)
    conversions(args, folder, described)
    comparisons(args, folder, described)


if __name__ == "__main__":
    main()
