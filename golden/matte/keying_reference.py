#!/usr/bin/env python3
"""Run Blender's keying nodes on EXR files and save what comes out of them.

    blender -b --factory-startup --python-use-system-env -P keying_reference.py -- JOBS.json
    python3 keying_reference.py JOBS.json                     (with the `bpy` wheel installed)

JOBS.json is a list of objects, all done in one Blender session:

    node      keying | chroma_key | channel_key | difference_key | color_spill | empty (for timing: the input itself)
    input     EXR file, taken as it is: Non-Color, premultiplied
    params    settings under Blender 3.4's property names; see NODES and KEYING below.  Pictures are file names:
              key_image (instead of key_color), garbage_matte, core_matte, second_image
    prefix    outputs are written to PREFIX + name + ".exr" as 32-bit float
    outputs   {"Image": "name", "Matte": "name", "Edges": "name"}: which outputs of the node, and their names
    linked    optional: the output that the Composite node gets; the first one where it is not given
    repeats   optional: render so many times more, writing nothing, and print the processor seconds of each

There is no colour conversion anywhere, and the compositor runs on the CPU in full precision.  Tried with Blender 3.4.1
and with bpy 4.2.0 and 4.5.15, whose options are sockets where 3.4 has properties.
"""

import json
import os
import re
import sys
import tempfile
import time
import traceback

try:
    import bpy
except ImportError:
    sys.exit("keying_reference.py needs Blender: run it with 'blender -b -P' or install bpy")

NODES = {
    "keying": "CompositorNodeKeying",
    "chroma_key": "CompositorNodeChromaMatte",
    "channel_key": "CompositorNodeChannelMatte",
    "difference_key": "CompositorNodeDiffMatte",
    "color_spill": "CompositorNodeColorSpill",
}

# Blender 3.4 property: socket of the versions that have one instead
SOCKETS = {
    "keying": {
        "blur_pre": "Preprocess Blur Size", "screen_balance": "Key Balance", "clip_black": "Black Level",
        "clip_white": "White Level", "edge_kernel_radius": "Edge Search Size", "edge_kernel_tolerance": "Edge Tolerance",
        "blur_post": "Postprocess Blur Size", "dilate_distance": "Postprocess Dilate Size",
        "feather_distance": "Postprocess Feather Size", "despill_factor": "Despill Strength",
        "despill_balance": "Despill Balance",
    },
    "chroma_key": {"threshold": "Minimum", "tolerance": "Maximum", "gain": "Falloff"},
    "channel_key": {"limit_min": "Minimum", "limit_max": "Maximum"},
    "difference_key": {"tolerance": "Tolerance", "falloff": "Falloff"},
    "color_spill": {"ratio": "Limit Strength", "use_unspill": "Use Spill Strength"},
}
# parameters that are pictures, and those that are values of an input that all versions have
PICTURES = {"key_image": "Key Color", "second_image": "Image 2", "garbage_matte": "Garbage Matte",
            "core_matte": "Core Matte"}
VALUES = {"key_color": "Key Color", "fac": "Fac"}


def new_tree(width, height):
    """An empty compositor tree that the scene will evaluate, for pictures of that size."""
    for image in list(bpy.data.images):
        bpy.data.images.remove(image)
    scene = bpy.context.scene
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.use_compositing, render.use_sequencer, render.use_file_extension = True, False, True
    for name, value in (("compositor_device", "CPU"), ("compositor_precision", "FULL")):
        if hasattr(render, name):
            setattr(render, name, value)
    scene.frame_start = scene.frame_end = 1
    return tree


def load(path):
    image = bpy.data.images.load(os.path.abspath(path), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "PREMUL"
    if 0 in image.size[:]:
        raise ValueError("cannot read an image from %r" % path)
    return image


def link_picture(tree, path, socket):
    source = tree.nodes.new("CompositorNodeImage")
    source.image = load(path)
    output = source.outputs["Image"]
    if socket.type == "VALUE":
        split = tree.nodes.new("CompositorNodeSeparateColor")
        tree.links.new(output, split.inputs[0])
        output = split.outputs[0]
    tree.links.new(output, socket)


def set_option(node, kind, name, value):
    """Set an option wherever this Blender keeps it."""
    sockets = {s.identifier: s for s in node.inputs}
    socket = sockets.get(SOCKETS[kind].get(name))
    if socket is not None:
        socket.default_value = value
    elif name.startswith("unspill_") and "Spill Strength" in sockets:
        index = ("unspill_red", "unspill_green", "unspill_blue").index(name)
        sockets["Spill Strength"].default_value[index] = value
    else:
        setattr(node, name, value)


def make_node(tree, job):
    kind = job["node"]
    if kind == "empty":
        node = tree.nodes.new("CompositorNodeImage")
        node.image = load(job["input"])
        return node
    node = tree.nodes.new(NODES[kind])
    image = "Image 1" if kind == "difference_key" else "Image"
    link_picture(tree, job["input"], node.inputs[image])
    for name, value in job["params"].items():
        if name in PICTURES:
            link_picture(tree, value, node.inputs[PICTURES[name]])
        elif name == "key_color":
            node.inputs["Key Color"].default_value = list(value) + [1.0] * (4 - len(value))
        elif name in VALUES:
            node.inputs[VALUES[name]].default_value = value
        else:
            set_option(node, kind, name, value)
    return node


def add_file_output(tree, socket, folder, name):
    """Returns a File Output node that writes one 32-bit float EXR called NAME and a frame number."""
    node = tree.nodes.new("CompositorNodeOutputFile")
    node.base_path = folder
    node.file_slots[0].path = name
    form = node.format
    form.file_format, form.color_mode, form.color_depth, form.exr_codec = "OPEN_EXR", "RGBA", "32", "ZIP"
    if socket.type != "RGBA":
        try:
            form.color_mode = "BW"
        except TypeError:  # older versions cannot write a one-channel EXR: three equal ones then
            form.color_mode = "RGB"
    tree.links.new(socket, node.inputs[0])
    return node


def collect(folder, name, target):
    """Move the single file that a File Output node wrote for NAME."""
    found = [entry for entry in os.listdir(folder) if re.fullmatch(re.escape(name) + r"_\d+\.exr", entry)]
    if len(found) != 1:
        raise RuntimeError("expected one file for %r, found %r" % (name, found))
    source = os.path.join(folder, found[0])
    with open(source, "rb") as reader, open(target, "wb") as writer:
        writer.write(reader.read())
    os.remove(source)


def render():
    started = time.process_time()
    if "FINISHED" not in bpy.ops.render.render(write_still=False):
        raise RuntimeError("Blender did not finish the render")
    return time.process_time() - started


def do(job):
    """Do one job; returns the seconds of its extra renders."""
    size = load(job["input"]).size[:]
    tree = new_tree(*size)
    node = make_node(tree, job)
    sink = tree.nodes.new("CompositorNodeComposite")
    tree.links.new(node.outputs[job.get("linked", 0)], sink.inputs["Image"])
    with tempfile.TemporaryDirectory(prefix="keying_") as folder:
        writers = [add_file_output(tree, node.outputs[output], folder, name + "_") for output, name in job["outputs"].items()]
        render()
        for name in job["outputs"].values():
            collect(folder, name, job["prefix"] + name + ".exr")
        for writer in writers:
            tree.nodes.remove(writer)
        return [render() for _ in range(job.get("repeats", 0))]


def main(argv):
    with open(argv[0], encoding="utf-8") as source:
        jobs = json.load(source)
    if not bpy.app.binary_path:  # the bpy module has no --factory-startup switch
        bpy.ops.wm.read_factory_settings(use_empty=False)
    try:
        for job in jobs:
            for seconds in do(job):
                print("render seconds: %.4f" % seconds)
    except Exception as error:  # Blender would otherwise end with status 0
        traceback.print_exc()
        print("keying_reference.py: %s" % error, file=sys.stderr)
        sys.exit(1)
    print("keying_reference.py: %d jobs done by Blender %s" % (len(jobs), bpy.app.version_string))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:])
