#!/usr/bin/env python3
"""Compare petcomp with Blender's Keying node on random pictures and settings, bit by bit.

    python3 golden/matte/random_comparison.py -n 300 --petcomp target/release/petcomp \\
        --blender blender --bpy42 PYTHON --bpy45 PYTHON [--seed 0] [--keep FOLDER]

Prints for each version the number of jobs, of floats compared (image, matte and edges) and of floats that differ; NaN
equals NaN, and +0 is not -0.  Exit status 1 where any float differs.
"""

import argparse
import os
import random
import struct
import subprocess
import sys
import tempfile

import blenders
import exr_file
import pictures

FALLOFFS = ("SMOOTH", "SPHERE", "ROOT", "INVERSE_SQUARE", "SHARP", "LINEAR")
KEYS = ((0.1, 0.75, 0.2), (0.1, 0.2, 0.8), (0.8, 0.2, 0.1), (0.5, 0.5, 0.5), (0.1, 0.7, 0.7), (0.7, 0.7, 0.1), (1, 1, 1))


def random_params(r):
    """Settings of which about half stay at their default."""
    choices = {
        "blur_pre": lambda: r.choice((1, 2, 3, 4, 7, 20)), "screen_balance": r.random,
        "clip_black": lambda: r.choice((r.random() * 0.5, 0.3)), "clip_white": lambda: r.choice((1 - r.random() * 0.6, 0.3)),
        "edge_kernel_radius": lambda: r.choice((0, 1, 2, 3, 5, 12)), "edge_kernel_tolerance": lambda: r.random() ** 2,
        "blur_post": lambda: r.choice((1, 2, 3, 4, 9, 30)), "dilate_distance": lambda: r.choice((-7, -3, -2, -1, 1, 2, 3, 8)),
        "feather_distance": lambda: r.choice((-9, -4, -1, 1, 2, 5, 13)), "feather_falloff": lambda: r.choice(FALLOFFS),
        "despill_factor": r.random, "despill_balance": r.random,
    }
    return {name: choose() for name, choose in choices.items() if r.random() < 0.5}


def random_job(r, folder, number):
    """Write the pictures of a job; returns the job."""
    def at(name):
        return os.path.join(folder, "%04d_%s.exr" % (number, name))

    width, height = r.choice(((1, 1), (r.randint(1, 40), 1), (1, r.randint(1, 40)), *[(r.randint(2, 40), r.randint(2, 32))] * 7))
    seed, params = r.randrange(1 << 30), random_params(r)
    kind = r.choice(("studio", "studio", "wild", "odd"))
    key = r.choice((*KEYS, tuple(r.random() for _ in range(3))))
    if kind == "studio":
        pictures.studio(at("input"), width, height, seed, key, r.choice((0.0, 0.02, 0.1)))
    else:
        getattr(pictures, kind)(at("input"), width, height, seed)
    if r.random() < 0.2:
        pictures.plate(at("plate"), width, height, seed + 1, ties=r.random() < 0.5)
        params["key_image"] = at("plate")
    else:
        params["key_color"] = key
    for name in ("garbage_matte", "core_matte"):
        if r.random() < 0.25:
            bounds = r.choice(((0, 1), (0, 1), (-0.5, 1.7)))
            pictures.mask(at(name), width, height, seed + 2, *bounds)
            params[name] = at(name)
    outputs = {"Image": "image", "Matte": "matte", "Edges": "edges"}
    return dict(node="keying", input=at("input"), params=params, outputs=outputs,
                prefix=os.path.join(folder, "%04d_blender_" % number))


def petcomp_command(program, profile, job):
    prefix, params = job["prefix"].replace("_blender_", "_petcomp_"), job["params"]
    command = [program, "matte", "key", job["input"], "-o", prefix + "image.exr", "--matte", prefix + "matte.exr",
               "--edges", prefix + "edges.exr", "--profile", profile]
    if "key_image" in params:
        command += ["--plate", params["key_image"]]
    else:
        command += ["--screen", ",".join(repr(float(c)) for c in params["key_color"])]
    for name, option in (("garbage_matte", "--garbage"), ("core_matte", "--core")):
        command += [option, params[name]] if name in params else []
    for name, value in params.items():
        if name not in blenders.GIVEN_ELSEWHERE:
            command += ["--set", "key.%s=%s" % (name, value)]
    return command


def differing(ours, theirs):
    """(floats compared, floats that differ) of two files; a matte that Blender wrote as RGB counts once."""
    width, height, mine = exr_file.read(ours)
    _width, _height, other = exr_file.read(theirs)
    compared = wrong = 0
    for name, samples in mine.items():
        against = other[name] if name in other else next(iter(other.values()))
        compared += width * height
        if samples != against:
            for i in range(0, len(samples), 4):
                a, b = samples[i:i + 4], against[i:i + 4]
                (x,), (y,) = struct.unpack("<f", a), struct.unpack("<f", b)
                wrong += a != b and not (x != x and y != y)
    return compared, wrong


def compare(version, command, args, folder):
    r = random.Random("%s %s" % (args.seed, version))
    jobs = [random_job(r, folder, i) for i in range(args.number)]
    blenders.run(version, command, jobs)
    compared = wrong = 0
    for job in jobs:
        ours = petcomp_command(args.petcomp, blenders.PROFILES[version], job)
        subprocess.run(ours, check=True)
        for name in job["outputs"].values():
            theirs = job["prefix"] + name + ".exr"
            count, bad = differing(theirs.replace("_blender_", "_petcomp_"), theirs)
            compared, wrong = compared + count, wrong + bad
            if bad:
                print("%s %s: %d of %d differ; %s" % (version, name, bad, count, " ".join(ours)))
    print("Blender %s: %d jobs, %d floats compared, %d differ" % (version, len(jobs), compared, wrong), flush=True)
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=300, dest="number", help="jobs for each version (default: 300)")
    parser.add_argument("--seed", default="0")
    parser.add_argument("--petcomp", default="target/release/petcomp", metavar="PROGRAM")
    parser.add_argument("--keep", metavar="FOLDER", help="leave the pictures here")
    blenders.add_arguments(parser)
    args = parser.parse_args()
    wrong = 0
    for version, command in blenders.chosen(args).items():
        with tempfile.TemporaryDirectory() as scratch:
            folder = os.path.join(args.keep, version) if args.keep else scratch
            os.makedirs(folder, exist_ok=True)
            wrong += compare(version, command, args, folder)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
