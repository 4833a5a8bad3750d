#!/usr/bin/env python3
"""Time Blender's Keying node and petcomp's keyer on the same 4K picture size, one after the other.

    python3 tests/benches/peers/matte.py --blender blender

Blender: seconds of a render whose tree is image -> Keying -> Composite, least of N, less that of image -> Composite; the
picture is in memory and nothing is written.  "Matte only" links the node's Matte instead of its Image to the Composite,
which makes a colour of it.  petcomp: `cargo bench --bench matte`, pictures in memory likewise; the lower
end of criterion's interval.
"""

import argparse
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..")
sys.path.insert(0, os.path.join(ROOT, "golden", "matte"))
import blenders  # noqa: E402
import exr_file  # noqa: E402
import pictures  # noqa: E402

WIDTH, HEIGHT, SCREEN = 3840, 2160, (0.1, 0.75, 0.2)
ALL = dict(blur_pre=6, clip_black=0.1, clip_white=0.9, edge_kernel_radius=3, blur_post=4, dilate_distance=3,
           feather_distance=8)


def picture(path, patterns=16):
    """A striped bar before a noisy screen, made of a few rows again and again."""
    r = random.Random(1)

    def row(front, k):
        values = []
        for x in range(WIDTH):
            cover = min(1.0, max(0.0, (900 - abs(x - WIDTH / 2)) / 8 + 0.5)) if front else 0.0
            subject = (0.6, 0.3, 0.2)[k] if x // 40 % 2 else (0.75, 0.72, 0.7)[k]
            values.append(cover * subject + (1 - cover) * SCREEN[k] + r.uniform(-0.01, 0.01))
        return pictures.floats(values)

    bands = [[row(front, k) for _ in range(patterns)] for front in (False, True) for k in range(3)]
    inside = range(HEIGHT // 8, HEIGHT * 7 // 8)
    channels = {c: b"".join(bands[k + 3 * (y in inside)][y % patterns] for y in range(HEIGHT)) for k, c in enumerate("RGB")}
    channels["A"] = pictures.floats([1.0]) * (WIDTH * HEIGHT)
    exr_file.write(path, WIDTH, HEIGHT, channels, exr_file.NO_COMPRESSION)


def time_blender(version, command, repeats):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "input.exr")
        picture(path)
        common = dict(input=path, prefix=folder + os.sep, outputs={}, repeats=repeats)
        key = dict(key_color=SCREEN)
        jobs = [dict(common, node="empty", params={}), dict(common, node="keying", params=key),
                dict(common, node="keying", params=key, linked="Matte"),
                dict(common, node="keying", params=dict(key, **ALL))]
        said = blenders.run(version, command, jobs)
    seconds = [float(s) for s in re.findall(r"render seconds: ([\d.]+)", said)]
    empty, defaults, matte, everything = (seconds[i * repeats:(i + 1) * repeats] for i in range(4))
    for name, times in (("empty tree", empty), ("defaults", defaults), ("matte only", matte), ("all stages", everything)):
        print("Blender %s, %s: least %.1f ms, median %.1f ms" % (version, name, min(times) * 1e3,
                                                                 statistics.median(times) * 1e3))
    return {"defaults": min(defaults) - min(empty), "matte only": min(matte) - min(empty), "all stages": min(everything) - min(empty)}


def time_petcomp():
    said = subprocess.run(["cargo", "bench", "--bench", "matte", "--", "--noplot"], cwd=ROOT, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True, check=True).stdout
    unit = {"ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0}
    found = re.findall(r"^(matte/\S+ ?[^\n]*?)\s+time:\s+\[(\S+) (\S+)", said, re.M)
    return {name.strip().split("/", 2)[2]: float(value) * unit[u] for name, value, u in found}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=10, dest="repeats", help="renders of each tree (default: 10)")
    blenders.add_arguments(parser)
    args = parser.parse_args()
    ours = time_petcomp()
    for name, seconds in ours.items():
        print("petcomp %s: %.2f ms, %.2f of a copy" % (name, seconds * 1e3, seconds / ours["copy"]))
    for version, command in blenders.chosen(args).items():
        net = time_blender(version, command, args.repeats)
        profile = blenders.PROFILES[version]
        for name, of in (("defaults", "key/defaults"), ("matte only", "key/matte only"), ("all stages", "key/all stages, %s" % profile)):
            print("Blender %s, %s: %.1f ms net; petcomp %.2f ms: %.1f times as fast" % (
                version, name, net[name] * 1e3, ours[of] * 1e3, net[name] / ours[of]))


if __name__ == "__main__":
    main()
