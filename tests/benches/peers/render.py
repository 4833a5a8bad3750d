#!/usr/bin/env python3
"""Renders a scene with Blender's Cycles at many sample counts: the other curve of `petcomp report render`.

    python3 tests/benches/peers/render.py golden/render/pile_of_20/scene.json -o cycles --size 320 240

The scene is a file of golden/render/scene_reference.py: one of golden/render, or one that
`petcomp scene export SCENE --to cycles DIR` wrote.  OUT gets one scene-linear picture per sample count
(spp_00016.exr) and times.json: CPU seconds of the render itself (all threads; without starting Blender, loading
files or saving).  The largest count is what the others are held against.  Pictures that are there are kept.
"""

import argparse
import json
import os
import shutil
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPT = os.path.join(HERE, "..", "..", "..", "golden", "render", "scene_reference.py")
COUNTS = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 4096]


def render(blender, scene, count, size, threads, out):
    """Renders once; returns CPU seconds and the program's version."""
    with tempfile.TemporaryDirectory() as work:
        command = [blender, "-b", "--factory-startup", "--python-use-system-env", "-noaudio", "-P", SCRIPT, "--", scene,
                   "--out", work, "--samples", str(count), "--threads", str(threads), "--seed", str(count)]
        if size:
            command += ["--size", *map(str, size)]
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if run.returncode:
            raise SystemExit(run.stdout)
        shutil.copy(os.path.join(work, "beauty.exr"), out)
        with open(os.path.join(work, "report.json")) as handle:
            report = json.load(handle)
    seconds = report["cpu_seconds"]
    return seconds["render_beauty"] + seconds.get("render_passing", 0.0), report["blender"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", "--out", required=True)
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"))
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--blender", default="blender")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    table = os.path.join(args.out, "times.json")
    told = {"program": "", "pictures": []}
    if os.path.exists(table):
        with open(table) as handle:
            told = json.load(handle)
    for count in args.counts:
        picture = "spp_%05d.exr" % count
        if any(entry["file"] == picture for entry in told["pictures"]):
            continue
        seconds, told["program"] = render(args.blender, args.scene, count, args.size, args.threads,
                                          os.path.join(args.out, picture))
        told["pictures"].append({"samples": count, "file": picture, "cpu_seconds": round(seconds, 4)})
        told["pictures"].sort(key=lambda entry: entry["samples"])
        with open(table, "w") as handle:
            json.dump(told, handle, indent=1)
            handle.write("\n")
        print("%5d spp: %.2f CPU s" % (count, seconds), flush=True)


if __name__ == "__main__":
    main()
