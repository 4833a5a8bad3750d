"""Compares the darkness of cut-outs' shadows with those that Cycles renders for the same bottles.

    cache/python/bin/python -m study.shadows ASSETS SHADOWS -o PICTURE.png

ASSETS is an asset folder built from photographs of the world, SHADOWS the output of `world.py shadows` for the bottles of
that library. A cut-out blocks the same share of light along a light ray as along the line of sight: 1 minus its view
transmittance. The measure is the lost light divided by the area of the shadow's outline.
"""

import argparse
import json
import tomllib
from pathlib import Path

import matplotlib
import numpy as np
import OpenEXR

matplotlib.use("Agg")
from matplotlib import pyplot

CHANNELS = ("red", "green", "blue")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("assets", type=Path)
    parser.add_argument("shadows", type=Path)
    parser.add_argument("-o", "--output", required=True, type=Path)
    options = parser.parse_args()
    cut_outs = dict(lost_light(options.assets))
    records = [json.loads(path.read_text()) for path in sorted(options.shadows.glob("b*.json"))]
    records = [record for record in records if name_of(record) in cut_outs]
    if not records:
        raise SystemExit(f"{options.shadows}: no record of a bottle in {options.assets}")
    figure, axes = pyplot.subplots(1, 4, figsize=(15, 4.2), sharex=True, sharey=True)
    print("| walls | tilt of the lamp | cut-outs / Cycles, median (5 to 95 %) | mean absolute difference |\n| --- | --- | --- | --- |")
    areas = np.array([record["shadows"][0]["area_m2"] for record in records])
    ours = np.array([cut_outs[name_of(record)] for record in records]) / areas[:, None]
    for k, axis in enumerate(axes):
        cycles = np.array([record["shadows"][k]["density"] for record in records])
        compare(axis, records[0]["shadows"][k], ours, cycles)
    axes[0].set_ylabel("cut-outs")
    figure.tight_layout()
    figure.savefig(options.output, dpi=110)


def name_of(record):
    return f"b{record['index']:04d}"


def lost_light(assets):
    """Yield, by asset, the light that its first cut-out stops, square metres per channel."""
    for asset in tomllib.loads((assets / "assets.toml").read_text())["assets"]:
        photo = asset["photos"][0]
        channels = OpenEXR.File(str(assets / photo["file"])).channels()
        stopped = [1.0 - channels[name].pixels.astype(float) for name in ("VR", "VG", "VB")]
        yield asset["name"], np.array([plane.sum() for plane in stopped]) / photo["px_per_metre"] ** 2


def compare(axis, case, ours, cycles):
    ratios = ours / cycles
    low, middle, high = np.percentile(ratios, [5, 50, 95])
    title = f"{case['walls']} walls, lamp at {case['tilt_deg']} degrees"
    print(f"| {case['walls']} | {case['tilt_deg']} | {middle:.2f} ({low:.2f} to {high:.2f}) | {np.abs(ours - cycles).mean():.3f} |")
    for channel, name in enumerate(CHANNELS):
        axis.plot(cycles[:, channel], ours[:, channel], "o", color=name, ms=4, alpha=0.6)
    axis.plot([0, 1], [0, 1], color="grey", lw=1)
    axis.set_title(f"{title}: x {middle:.2f}")
    axis.set_xlabel("Cycles")


if __name__ == "__main__":
    main()
