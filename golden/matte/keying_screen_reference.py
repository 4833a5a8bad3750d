#!/usr/bin/env python3
"""Write the golden cases of the Keying Screen node, by Blender 4.5 (the `bpy` wheel).

    PYTHON golden/matte/keying_screen_reference.py

The clip is patches of one colour each, with a tracking marker in the middle of each: a marker's colour is the mean of its
pattern, which lies inside the patch, so that every marker's colour is known.
"""

import os
import sys
import tempfile

import exr_file
import pictures
from keying_reference import add_file_output, bpy, collect, new_tree, render

HERE = os.path.dirname(os.path.abspath(__file__))
VERSION = "4.5.15"
PATCH = 8  # pixels; a marker's pattern is half as wide
# name: (about, columns and rows of patches, smoothness, {patch with a marker: its colour})
CASES = {
    "one": ("one marker", (4, 3), 0.0, {(1, 1): (0.1, 0.75, 0.2)}),
    "three": ("three markers", (5, 4), 0.0, {(0, 0): (0.1, 0.75, 0.2), (3, 1): (0.15, 0.5, 0.125), (2, 3): (0.0, 1.5, 0.3)}),
    "smooth": ("three markers, half smooth", (5, 4), 0.5,
               {(0, 0): (0.1, 0.75, 0.2), (3, 1): (0.15, 0.5, 0.125), (2, 3): (0.0, 1.5, 0.3)}),
    "far": ("markers in one corner of a wide picture", (8, 2), 0.0, {(0, 0): (0.2, 0.1, 0.9), (1, 1): (0.3, 0.2, 0.6)}),
}


def load_clip(path, size, points):
    clip = bpy.data.movieclips.load(path)
    clip.colorspace_settings.name = "Non-Color"
    (width, height), half = size, PATCH / 4
    for column, row in points:
        x, y = (column + 0.5) * PATCH, (row + 0.5) * PATCH  # from the top left
        marker = clip.tracking.tracks.new(name="%d %d" % (column, row), frame=1).markers[0]
        marker.co = (x / width, 1 - y / height)
        corners = [(sx * half / width, sy * half / height) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        marker.pattern_corners = corners
    return clip


def make(name, about, patches, smoothness, points):
    width, height = size = tuple(n * PATCH for n in patches)
    folder = os.path.join(HERE, "keying_screen_%s_%s" % (name, VERSION))
    os.makedirs(folder, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        path = os.path.join(work, "clip.exr")
        pictures.write(path, width, height, lambda x, y: list(points.get((x // PATCH, y // PATCH), (0, 0, 0))) + [1.0])
        tree = new_tree(width, height)
        node = tree.nodes.new("CompositorNodeKeyingScreen")
        node.clip = load_clip(path, size, points)
        node.inputs["Smoothness"].default_value = smoothness
        sink = tree.nodes.new("CompositorNodeComposite")
        tree.links.new(node.outputs["Screen"], sink.inputs["Image"])
        add_file_output(tree, node.outputs["Screen"], work, "screen_")
        render()
        reference = os.path.join(folder, "reference.exr")
        collect(work, "screen", reference)
    w, h, channels = exr_file.read(reference)
    assert (w, h) == size, (w, h)
    exr_file.write(reference, w, h, channels)
    write_case(folder, about, size, smoothness, points)


def write_case(folder, about, size, smoothness, points):
    lines = ['about = "%s"' % about, 'node = "keying_screen"', "size = %s" % list(size), "smoothness = %s" % smoothness, ""]
    for (column, row), color in points.items():
        at = [(column + 0.5) * PATCH, (row + 0.5) * PATCH]
        lines += ["[[points]]", "at_px = %s" % at, "color = %s" % [float(c) for c in color], ""]
    lines += ["[reference]", 'program = "Blender"', 'version = "%s"' % VERSION,
              'script = "golden/matte/keying_screen_reference.py"', "",
              "# Blender sums in single precision: a few of its steps between 1 and 2.", "[tolerance]",
              "hard_fail = 1e-6", ""]
    with open(os.path.join(folder, "case.toml"), "w", encoding="utf-8") as out:
        out.write("\n".join(lines))


def main():
    if not bpy.app.version_string.startswith(VERSION):
        sys.exit("keying_screen_reference.py needs bpy %s, not %s" % (VERSION, bpy.app.version_string))
    bpy.ops.wm.read_factory_settings(use_empty=False)
    for name, case in CASES.items():
        make(name, *case)


if __name__ == "__main__":
    main()
