#!/usr/bin/env python3
"""Makes the inputs of the golden scenes: small textures, a small plate, scene files.

    blender -b --factory-startup --python-use-system-env -P golden/render/scenes.py -- WORLD

WORLD is a folder of sample bottles and backgrounds (`bottles/`, `backgrounds/`).  Scenes whose
quads have no pose yet are then dropped and rendered by `references.sh`.
"""

import importlib.util
import json
import math
import os
import sys

import bpy
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
loader = importlib.util.spec_from_file_location("scene_reference", os.path.join(HERE, "scene_reference.py"))
ref = importlib.util.module_from_spec(loader)
loader.loader.exec_module(ref)

WIDTH, HEIGHT = 128, 96
BOTTLES = ["b0000_0", "b0003_0", "b0005_1", "b0008_0"]
BACKGROUND = "bg0001"


def write_half(path, rgba):
    """Half-float EXR with alpha, values untouched."""
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Raw"
    image = bpy.data.images.new("out", rgba.shape[1], rgba.shape[0], alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(np.ascontiguousarray(rgba[::-1], dtype=np.float32).ravel())
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode = "OPEN_EXR", "RGBA"
    settings.color_depth, settings.exr_codec = "16", "ZIP"
    image.save_render(path, scene=scene)
    bpy.data.images.remove(image)


def cutout(world, name):
    """Premultiplied colour and coverage of one bottle, and its size in metres."""
    folder = os.path.join(world, "bottles")
    color = ref.read_pixels(bpy, os.path.join(folder, name + "_fg.exr"))[..., :3]
    view = ref.read_pixels(bpy, os.path.join(folder, name + "_view.png"))[..., :3]
    alpha = 1.0 - view.mean(axis=2, keepdims=True)
    rgba = np.concatenate([np.minimum(color, alpha), alpha], axis=2)
    with open(os.path.join(folder, name.split("_")[0] + ".json")) as handle:
        photo = json.load(handle)["photos"][int(name[-1])]
    metre = photo["px_per_metre"]["mid_bottle"]
    width = 144
    height = round(width * rgba.shape[0] / rgba.shape[1])
    size = [rgba.shape[1] / metre, rgba.shape[0] / metre]
    return np.clip(ref.resample_area(rgba, width, height), 0.0, 1.0), size


def leaf():
    """A texture made of formulas: coloured stripes and a soft hole, 40 x 24."""
    y, x = np.mgrid[0:24, 0:40] + 0.5
    stripe = (np.floor(x / 5) + np.floor(y / 6)) % 2
    alpha = np.clip((np.hypot(x - 20, y - 12) - 4) / 4, 0.15, 1.0)
    color = np.stack([0.15 + 0.7 * stripe, 0.6 - 0.4 * stripe, 0.1 + 0.02 * x], axis=2)
    return np.concatenate([color * alpha[..., None], alpha[..., None]], axis=2)


def pose(center, tilt_deg, axis_deg, yaw_deg):
    """Yaw about z, then a tilt about a level axis."""
    a, t, y = math.radians(axis_deg), math.radians(tilt_deg), math.radians(yaw_deg)
    k = np.array([math.cos(a), math.sin(a), 0.0])
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    tilt = np.eye(3) + math.sin(t) * cross + (1 - math.cos(t)) * cross @ cross
    yaw = np.array([[math.cos(y), -math.sin(y), 0], [math.sin(y), math.cos(y), 0], [0, 0, 1.0]])
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = tilt @ yaw, center
    return m.tolist()


def main():
    world = sys.argv[sys.argv.index("--") + 1]
    os.makedirs(os.path.join(HERE, "textures"), exist_ok=True)
    bottles = []
    for name in BOTTLES:
        rgba, size = cutout(world, name)
        file = "textures/%s.exr" % name
        write_half(os.path.join(HERE, file), rgba)
        bottles.append(("../" + file, size))
    write_half(os.path.join(HERE, "textures/leaf.exr"), leaf())
    plate = ref.read_pixels(bpy, os.path.join(world, "backgrounds", BACKGROUND + ".jpg"))
    plate[..., :3] = ref.srgb_to_linear(plate[..., :3])
    write_half(os.path.join(HERE, "textures/plate.exr"), ref.resample_area(plate, WIDTH, HEIGHT))

    with open(os.path.join(world, "backgrounds", BACKGROUND + ".json")) as handle:
        back = json.load(handle)
    c = back["camera"]
    base = {
        "render": {"width": WIDTH, "height": HEIGHT, "samples": 4096, "max_bounces": 0, "threads": 2},
        "camera": {"K": [[c["fx"], 0.0, c["cx"]], [0.0, c["fy"], c["cy"]], [0.0, 0.0, 1.0]],
                   "R": c["world_to_camera_R"], "t": c["world_to_camera_t"],
                   "resolution": [c["width"], c["height"]]},
        "tray": {"size": back["tray"]["floor_m"]},
        "plate": {"path": "../textures/plate.exr"},
        "ground": {"extent": [1.68, 1.11]},
        "lights": [{"shape": "square", "size": 0.35, "power": 9.0, "color": [1.0, 0.95, 0.85],
                    "position": [0.5, 0.3, 1.2]}],
        "environment": {"color": [0.3, 0.35, 0.4]},
    }

    def save(name, quads, **changes):
        os.makedirs(os.path.join(HERE, name), exist_ok=True)
        with open(os.path.join(HERE, name, "scene.json"), "w") as handle:
            json.dump({**base, **changes, "quads": quads}, handle, indent=1)
            handle.write("\n")

    def bottle(k, **more):
        texture, size = bottles[k % len(bottles)]
        scale = 0.85 + 0.05 * (k * 7 % 7)
        return {"id": k + 1, "texture": texture, "size": [s * scale for s in size],
                "thickness": 0.022, **more}

    def graded(k):
        return bottle(k, hue_shift=(37 * k) % 50 - 25, saturation=0.7 + 0.09 * (k % 6), value=0.8 + 0.07 * (k % 5))

    one = [{"id": 1, "texture": "../textures/leaf.exr", "size": [0.2, 0.12],
            "pose": pose([0.05, 0.03, 0.07], 25, 40, 20)}]
    save("one_card_and_its_shadow", one)
    save("disk_and_second_light", one, lights=[
        {"shape": "disk", "size": 0.2, "power": 6.0, "color": [1.0, 0.6, 0.4], "position": [-0.6, 0.1, 0.9]},
        {"shape": "rectangle", "size": [0.5, 0.05], "power": 5.0, "color": [0.5, 0.7, 1.0],
         "position": [0.4, -0.5, 0.8], "target": [0.1, 0.0, 0.0]}])
    save("two_crossing", [
        bottle(0, pose=pose([0.0, 0.02, 0.06], 22, 90, 15)),
        {"id": 2, "texture": "../textures/leaf.exr", "size": [0.22, 0.13],
         "pose": pose([0.02, 0.0, 0.06], -28, 80, 75)}])
    save("pile_of_12", [graded(k) for k in range(12)], physics={"rest_speed": 0.002, "seed": 3})
    save("pile_of_20_hard_light", [bottle(k) for k in range(20)], physics={"rest_speed": 0.002, "seed": 7},
         lights=[{"shape": "square", "size": 0.05, "power": 9.0, "position": [-0.45, 0.35, 1.1]}])


main()
