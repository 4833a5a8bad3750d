#!/usr/bin/env python3
"""A scene rendered by petcomp at its presets and by Blender's Cycles at many sample counts.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/render.py [SCENE] [-o FOLDER] [--size W H]
    target/release/petcomp-report render SCENE --size W H --cycles FOLDER/render    (the same points as a separate chart)

SCENE is a file for golden/render/scene_reference.py: one of golden/render, or one written by
`petcomp scene export SCENE RECIPE --to cycles DIR`. Seconds are the processor time of the rendering alone as each program
reports it, without start-up, files and texture pyramids. Error: `petcomp-report render` compares both programs with the
image of the largest count, which has its own seeds and is kept for the next run. Cycles' images (spp_00016.exr) and
times.json go to FOLDER/render.
"""

import csv
import json
import math
import pathlib
import shutil
import statistics
import sys
import tempfile

import numpy as np
from linear import read_exr, write_exr
from side_by_side import CORES, INSIDE, Comparison, arguments, pinned, spent, told, version

SCRIPT = "golden/render/scene_reference.py"
DEFAULT_PRESET = "normal"
# Samples of one part of the reference, and the seed of the first one: other than those of the pictures that are compared.
PART, FIRST_SEED = 256, 1_000_000
PRESETS = ("draft", "normal", "good", "high", "reference")


class Cycles:
    """Cycles' images of a scene in a folder."""

    def __init__(self, args):
        self.args, self.folder = args, args.output / "render"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.program, self.seconds = version([args.blender, "--version"]), {}

    def command(self, samples, work, seed=None):
        return pinned(self.args.blender, "-b", "--factory-startup", "--python-use-system-env", "-noaudio", "-P", SCRIPT, "--",
                      self.args.scene, "--out", work, "--samples", samples, "--threads", len(CORES), "--seed", seed or samples,
                      "--size", *self.args.size)

    def render(self, samples):
        """Render once, keep the image and return the processor seconds."""
        took = self.render_to(self.folder / self.name(samples), samples)
        self.seconds.setdefault(samples, []).append(took)
        self.tell()
        return took

    def render_to(self, path, samples, seed=None):
        with tempfile.TemporaryDirectory() as work:
            said = spent(self.command(samples, work, seed))[1]
            report = pathlib.Path(work, "report.json")
            if not report.exists():
                raise RuntimeError(said[-300:])
            seconds = json.loads(report.read_text())["cpu_seconds"]
            shutil.copy(pathlib.Path(work, "beauty.exr"), path)
        return seconds["render_beauty"] + seconds.get("render_passing", 0.0)

    def name(self, samples):
        return "spp_%05d.exr" % samples

    def tell(self):
        pictures = [{"samples": samples, "file": self.name(samples), "cpu_seconds": round(statistics.median(seconds), 4)}
                    for samples, seconds in sorted(self.seconds.items())]
        (self.folder / "times.json").write_text(json.dumps({"program": self.program, "pictures": pictures}, indent=1) + "\n")

    def reference(self, samples):
        """Render the reference image: the mean of parts with their own seeds. Parts of an earlier run with the same
        settings are reused, so that a reference of an hour may be interrupted."""
        kept, asked = self.folder / "reference.json", [str(self.args.scene), self.args.size, self.program, min(PART, samples)]
        told_before = json.loads(kept.read_text()) if kept.exists() else {}
        seconds = told_before["seconds"] if told_before.get("asked") == asked else []
        count = math.ceil(samples / PART)
        for number in range(len(seconds), count):
            seconds.append(self.render_to(self.part(number), min(PART, samples), FIRST_SEED + number))
            kept.write_text(json.dumps({"asked": asked, "seconds": seconds}))
            print(f"reference: part {number + 1} of {count}", file=sys.stderr)
        write_exr(self.folder / self.name(samples), np.mean([read_exr(self.part(k), "RGBA") for k in range(count)], axis=0))
        self.seconds[samples] = [sum(seconds[:count])]
        self.tell()

    def part(self, number):
        return self.folder / f"part_{number:03d}.exr"


class Report:
    """The report of `petcomp-report render`, once per round."""

    def __init__(self, args, cycles):
        self.rounds, self.folder = [], args.output / "render" / "report"
        self.command = pinned(args.report, "-q", "-j", len(CORES), "render", args.scene, "-o", self.folder, "--size",
                              *args.size, "--cycles", cycles, "--golden", self.folder / "no_golden", "--repeats", 1)

    def rows(self, number):
        """Rows of a round, by first word of the program and setting."""
        while len(self.rounds) <= number:
            spent(self.command)
            with open(self.folder / "render.csv", newline="") as source:
                self.rounds.append({(row["program"].split()[0], row["setting"]): row for row in csv.DictReader(source)})
        return self.rounds[number]

    def seconds(self, preset):
        """Return a function that returns the seconds of the next round on each call."""
        numbers = iter(range(1 << 30))
        return lambda: float(self.rows(next(numbers))["petcomp", preset]["CPU s"])

    def error(self, *key):
        """Error in the last round, whose images by Cycles already existed."""
        return float(self.rounds[-1][key]["RMSE to Cycles"])


def compare(comparison, args, cycles):
    """Add Cycles first, so that petcomp's report of a round finds the images of that round."""
    report, ours = Report(args, cycles.folder), version([args.petcomp, "--version"])
    for samples in args.counts:
        comparison.add("Cycles", cycles.program, f"{samples} spp", told(cycles.command(samples, "OUT")),
                       lambda samples=samples: cycles.render(samples),
                       lambda samples=samples: report.error("Cycles", f"{samples} spp"))
    for preset in PRESETS:
        setting = preset + (", default" if preset == DEFAULT_PRESET else "")
        comparison.add("petcomp", ours, setting, told(report.command), report.seconds(preset),
                       lambda preset=preset: report.error("petcomp", preset))


def main():
    parser = arguments(__doc__)
    parser.add_argument("scene", nargs="?", type=pathlib.Path, default=pathlib.Path("golden/render/pile_of_20/scene.json"))
    parser.add_argument("--size", type=int, nargs=2, default=[160, 120], metavar=("W", "H"))
    parser.add_argument("--counts", type=int, nargs="+", default=[1, 4, 16, 64, 256], help="samples per pixel")
    parser.add_argument("--reference", type=int, default=2048, help="samples per pixel of the reference (default: %(default)s)")
    parser.add_argument("--blender", default="blender", metavar="PROGRAM")
    args = parser.parse_args()
    comparison = Comparison("render", args, INSIDE, "{}, {} x {}".format(args.scene, *args.size), "root mean square, linear light",
                            f"Cycles at {args.reference} samples per pixel")
    with comparison.absent_if_it_fails("Cycles"):
        cycles = Cycles(args)
        cycles.reference(args.reference)
        compare(comparison, args, cycles)
    comparison.finish()


if __name__ == "__main__":
    main()
