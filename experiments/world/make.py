#!/usr/bin/env python3
"""Makes the reality of the experiments: rooms with piles, and photographs for petcomp.

    make.py --out WORLD [--rooms 21,22,23] [--sets photos,backgrounds,test,real] [--piles 100] ...

WORLD is a cache. Existing files are not made again, so rerun the same command to resume an interrupted run,
or use a larger `--piles` to add piles. Each pile depends only on its own number.
"""

import argparse
import concurrent.futures
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
# Floor of the tray, metres. 21 to 23 are for choosing and confirming; 24 decides in the end.
TRAYS = {21: "0.56x0.37", 22: "0.45x0.32", 23: "0.60x0.40", 24: "0.50x0.34"}
# No bottle is in two of these.
LIBRARY_SEEDS = {"photos": 2100, "test": 2200, "real": 2300}
# Other numbers, other poses and cameras.
SEEDS = {"test": 1, "real": 2}
# Pictures that one process makes before the next one starts: what an interruption loses at most
# is one picture, so this only spares the start of Blender.
CHUNK = 6


def main(argv):
    options = parse(argv)
    todo = [job for job in jobs(options) if not job["done"].exists()]
    print(f"{len(todo)} pictures to make", flush=True)
    made = 0
    with concurrent.futures.ThreadPoolExecutor(options.processes) as pool:
        for chunk in pool.map(lambda chunk: render(options, chunk), chunks(todo)):
            made += len(chunk)
            print(f"{made} of {len(todo)}", flush=True)


def parse(argv):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--rooms", default="21,22,23", help="comma-separated list (default 21,22,23)")
    parser.add_argument("--sets", default="photos,backgrounds,test,real", help="comma-separated list")
    parser.add_argument("--piles", type=int, default=100, help="piles per room and set (default 100)")
    parser.add_argument("--bottles", type=int, default=24, help="bottles to photograph (default 24)")
    parser.add_argument("--backgrounds", type=int, default=6, help="photos of an empty tray (default 6)")
    parser.add_argument("--processes", type=int, default=os.cpu_count(), help="pictures to render in parallel")
    options = parser.parse_args(argv)
    options.rooms = [int(room) for room in options.rooms.split(",")]
    options.sets = options.sets.split(",")
    for room in options.rooms:
        if room not in TRAYS:
            parser.error(f"--rooms: no room {room}, expected some of {sorted(TRAYS)}")
    return options


def jobs(options):
    """Yield the requested pictures: their arguments and the file that is written last."""
    if "photos" in options.sets:
        yield from photos(options)
    if "backgrounds" in options.sets:
        yield from backgrounds(options)
    piles = [name for name in ("test", "real") if name in options.sets]
    for index in range(options.piles):
        for name in piles:
            yield from (pile(options, name, room, index) for room in options.rooms)


def photos(options):
    out = options.out / "photos"
    for index in range(options.bottles):
        yield {
            "out": out,
            "command": ["bottles", "--library-seed", LIBRARY_SEEDS["photos"], "--photos", 2, "--width", 600, "--spp", 12],
            "index": index,
            "done": out / "bottles" / f"b{index:04d}.json",
        }


def backgrounds(options):
    """Yield photos of the empty trays, and one of each with a sheet of white paper in it."""
    for room in options.rooms:
        out = options.out / f"room{room}"
        command = ["backgrounds", "--room-seed", room, "--tray", TRAYS[room], "--format", "jpg", "--spp", 8]
        for index in range(options.backgrounds):
            done = out / "backgrounds" / f"bg{index:04d}.json"
            yield {"out": out, "command": command, "index": index, "done": done}
        beside_paper = [*command, "--paper", "--lights", "ambient"]
        done = out / "paper" / "backgrounds" / "bg0000.json"
        yield {"out": out / "paper", "command": beside_paper, "index": 0, "done": done}


def pile(options, name, room, index):
    out = options.out / f"room{room}" / name
    light = ("bright", "dim", "ambient")[index % 3]
    command = ["piles", "--room-seed", room, "--tray", TRAYS[room], "--seed", SEEDS[name]]
    command += ["--library-seed", LIBRARY_SEEDS[name], "--mode", "cycle", "--bottles", "5-15"]
    command += ["--width", 480, "--height", 360, "--spp", 6, "--wall", "solid", "--format", "jpg"]
    done = out / "piles" / "truth" / f"p{index:05d}_{light}_v{index % 4}.json"
    return {"out": out, "command": command, "index": index, "done": done}


def chunks(todo):
    """Yield chunks of neighbouring numbers of one set, in the requested order."""
    sets = {}
    for job in todo:
        sets.setdefault((str(job["out"]), tuple(map(str, job["command"]))), []).append(job)
    queues = [[jobs[at:at + CHUNK] for at in range(0, len(jobs), CHUNK)] for jobs in sets.values()]
    while any(queues):
        for queue in queues:
            if queue:
                yield queue.pop(0)


def render(options, chunk):
    cache = ["--cache", options.out / "shapes"] if chunk[0]["command"][0] != "backgrounds" else []
    for first, count in runs([job["index"] for job in chunk]):
        arguments = [*chunk[0]["command"], "--out", chunk[0]["out"], "--first", first, "--count", count, *cache]
        command = [sys.executable, HERE / "world.py", *arguments, "--threads", 1]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr[-2000:]}")
    return chunk


def runs(numbers):
    """`(first, count)` of each unbroken stretch."""
    stretches = []
    for number in numbers:
        if stretches and sum(stretches[-1]) == number:
            stretches[-1] = (stretches[-1][0], stretches[-1][1] + 1)
        else:
            stretches.append((number, 1))
    return stretches


if __name__ == "__main__":
    main(sys.argv[1:])
