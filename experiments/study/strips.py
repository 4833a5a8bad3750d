"""Shows the look and the cost of each switch of the recipe.

    cache/python/bin/python -m study.strips PROGRAM OUT

Writes OUT/switches.jpg, with a row for each switch that shows the same pictures without and with it and their
labels, and OUT/switches.csv with single-thread milliseconds per picture. Inputs are the repository's samples.
"""

import argparse
import csv
import os
import shutil
import subprocess
from pathlib import Path

from PIL import Image, ImageDraw

from . import files, main as studies, synthetic

SAMPLES = studies.HERE.parent / "tests/samples"
DISTRACTORS = ["b0006", "b0007"]
SHOWN = 2
# What is shown of a picture, pixels.
SEEN = (60, 45, 420, 315)
WIDTH, HEIGHT = 240, 180
HEAD = 16


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--pictures", type=int, default=24, help="pictures to time (default 24)")
    parser.add_argument("--rounds", type=int, default=3, help="timing rounds, of which the fastest counts (default 3)")
    options = parser.parse_args()
    arms = studies.read_arms()
    recipe = make_recipe(options.program.resolve(), options.out)
    rows = [row(options, arms, recipe, name, switch) for name, switch in switches(arms).items()]
    sheet([pictures for pictures, _ in rows]).save(options.out / "switches.jpg", quality=80)
    with (options.out / "switches.csv").open("w") as file:
        csv.writer(file, lineterminator="\n").writerows([["switch", "off_ms", "on_ms"], *(times for _, times in rows)])


def screening(arms):
    """The screening whose switches are shown; its base is the base of all."""
    return arms["screenings"]["first"]


def switches(arms):
    """Changes `both`, `off` and `on` of each switch, by name."""
    screened = {name: {"on": switch["set"]} for name, switch in screening(arms)["switches"].items()}
    return screened | arms["strips"]["switches"]


def make_recipe(program, out):
    """Write a recipe for the samples, with some bottles as distractors, which fall only if the recipe has any."""
    photos = (SAMPLES / "bottles/photos.toml").read_text().replace('file = "', f'file = "{SAMPLES}/bottles/')
    entries = [as_distractor(entry) for entry in photos.split("[[photos]]")]
    listed = files.write_text(out / "photos.toml", "[[photos]]".join(entries))
    subprocess.run([program, "-q", "asset", "build", listed, "-o", out / "assets"], check=True, stdout=subprocess.DEVNULL)
    return files.write_text(out / "recipe.toml", f'assets = "assets"\nbackgrounds = "{SAMPLES}/backgrounds"\n')


def as_distractor(entry):
    if not any(f'asset = "{name}"' in entry for name in DISTRACTORS):
        return entry
    return "\n".join('role = "distractor"' if line.startswith("class") else line for line in entry.split("\n"))


def row(options, arms, recipe, name, switch):
    """Return the pictures without and with a switch, and its name with the milliseconds of both."""
    base = arms["synthetic"]["set"] + synthetic.described(arms["generators"], screening(arms)["base"])["set"]
    changes = {side: base + switch.get("both", []) + switch.get(side, []) for side in ("off", "on")}
    times = {side: [] for side in changes}
    for _ in range(options.rounds):
        for side, change in changes.items():
            folder = options.out / name / side
            times[side].append(generate(options, recipe, change, folder))
    quickest = [min(times[side]) for side in changes]
    pictures = [shown(options.out / name / side) for side in changes]
    return (name, *pictures), [name, *(f"{one:.1f}" for one in quickest)]


def generate(options, recipe, changes, folder):
    """Generate pictures; return CPU milliseconds per picture."""
    words = [word for change in changes for word in ("--set", change)]
    command = [options.program.resolve(), "-q", "-j", "1", "dataset", "generate", recipe, *words]
    shutil.rmtree(folder, ignore_errors=True)
    before = os.times()
    subprocess.run([*command, "-n", str(options.pictures), "--seed", "1", "--yes", "-o", folder], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return 1000 * spent / options.pictures


def shown(folder):
    return [with_boxes(path) for path in sorted((folder / "images").rglob("*.jpg"))[:SHOWN]]


def with_boxes(path):
    picture = Image.open(path).convert("RGB")
    draw = ImageDraw.Draw(picture)
    for line in files.label_of(path).read_text().split("\n"):
        if line:
            draw.rectangle(corners(*map(float, line.split()[1:]), *picture.size), outline=(255, 255, 0))
    return picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS, SEEN)


def corners(x, y, width, height, columns, rows):
    left, right = (columns * (x + sign * width / 2) for sign in (-1, 1))
    top, bottom = (rows * (y + sign * height / 2) for sign in (-1, 1))
    return [left, top, right, bottom]


def sheet(rows):
    whole = Image.new("RGB", (2 * SHOWN * WIDTH + HEAD, len(rows) * (HEIGHT + HEAD)), "white")
    draw = ImageDraw.Draw(whole)
    for k, (name, off, on) in enumerate(rows):
        top = k * (HEIGHT + HEAD)
        on_left = SHOWN * WIDTH + HEAD
        draw.text((4, top + 2), f"without {name}", fill="black")
        draw.text((on_left + 4, top + 2), f"with {name}", fill="black")
        for left, pictures in ((0, off), (on_left, on)):
            for place, picture in enumerate(pictures):
                whole.paste(picture, (left + place * WIDTH, top + HEAD))
    return whole


if __name__ == "__main__":
    main()
