#!/usr/bin/env python3
"""Makes the inputs of the golden scenes: small textures, a small plate, scene files.

    blender -b --factory-startup --python-use-system-env -P golden/render/scenes.py -- WORLD [SCENE...]

WORLD is a folder of sample bottles and backgrounds (`bottles/`, `backgrounds/`); with names, only those
scenes are made.  Scenes whose quads have no pose yet are then dropped and rendered by `references.sh`.
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


def veil():
    """A soft grey-white texture, nowhere opaque: 32 x 24."""
    y, x = np.mgrid[0:24, 0:32] + 0.5
    alpha = 0.25 + 0.35 * (0.5 + 0.5 * np.sin(x / 3.0) * np.cos(y / 4.0))
    color = np.stack([0.8 + 0.0 * x, 0.75 + 0.005 * y, 0.7 + 0.005 * x], axis=2)
    return np.concatenate([color * alpha[..., None], alpha[..., None]], axis=2)


def gel():
    """A film of three colours with a wavy seam: what it adds, and its opacity per channel; 36 x 24."""
    y, x = np.mgrid[0:24, 0:36] + 0.5
    third = np.clip((x + 2.0 * np.sin(y / 3.0)) / 12.0, 0.0, 2.999).astype(int)
    passes = np.array([[0.85, 0.25, 0.15], [0.15, 0.7, 0.3], [0.2, 0.35, 0.9]])[third]
    opacity = 1.0 - passes * (0.9 + 0.1 * np.cos(x + y))[..., None]
    color = np.minimum(0.25 * passes + 0.05, opacity)
    return np.concatenate([color, opacity.mean(axis=2, keepdims=True)], axis=2), opacity


def directions(width, height):
    """Unit vectors of the texels of an equirectangular map."""
    v, u = (np.mgrid[0:height, 0:width] + 0.5) / np.array([height, width]).reshape(2, 1, 1)
    turn, fall = (0.5 - u) * 2 * math.pi, v * math.pi
    return np.stack([np.sin(fall) * np.cos(turn), np.sin(fall) * np.sin(turn), np.cos(fall)], axis=2)


def opaque(rgb):
    return np.concatenate([rgb, np.ones(rgb.shape[:2] + (1,))], axis=2)


def room():
    """A room: a warm wide window, a small cold lamp, walls of two greys, a dark floor; 48 x 24."""
    d = directions(48, 24)
    toward = lambda x, y, z: d @ (np.array([x, y, z]) / math.sqrt(x * x + y * y + z * z))
    rgb = np.where(d[..., 2:] > 0, 0.25, 0.1) + np.zeros(3)
    rgb = rgb + np.where(toward(0.9, 0.2, 0.6) > 0.9, 1.0, 0.0)[..., None] * np.array([7.0, 5.0, 3.0])
    rgb = rgb + np.where(toward(-0.3, -0.8, 0.7) > 0.975, 1.0, 0.0)[..., None] * np.array([4.0, 7.0, 12.0])
    return opaque(rgb)


def sun():
    """A clear sky with a sun four texels large that gives most of the light; 96 x 48."""
    d = directions(96, 48)
    up = np.clip(d[..., 2:], 0.0, 1.0)
    rgb = np.where(d[..., 2:] > 0, 0.5 - 0.3 * up, 0.05) * np.array([0.7, 0.85, 1.1])
    rgb[12:14, 60:62] = [640.0, 590.0, 480.0]
    return opaque(rgb)


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


def looking(eye, target, focal):
    """A camera of the picture's size at `eye` that looks at `target`, the world's z axis upwards."""
    eye, target = np.array(eye), np.array(target)
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    r = np.stack([x, np.cross(z, x), z])
    k = [[focal, 0.0, WIDTH / 2], [0.0, focal, HEIGHT / 2], [0.0, 0.0, 1.0]]
    return {"K": k, "R": r.tolist(), "t": (-r @ eye).tolist(), "resolution": [WIDTH, HEIGHT]}


def main():
    world, *wanted = sys.argv[sys.argv.index("--") + 1:]
    os.makedirs(os.path.join(HERE, "textures"), exist_ok=True)
    bottles = []
    for name in BOTTLES:
        rgba, size = cutout(world, name)
        file = "textures/%s.exr" % name
        write_half(os.path.join(HERE, file), rgba)
        bottles.append(("../" + file, size))
    add, opacity = gel()
    made = {"leaf": leaf(), "veil": veil(), "gel": add, "gel_opacity": opaque(opacity), "room": room(), "sun": sun()}
    for name, rgba in made.items():
        write_half(os.path.join(HERE, "textures/%s.exr" % name), rgba)
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
        if wanted and name not in wanted:
            return
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

    # Noise of about 6e-4, far below every limit.
    base["render"] = {**base["render"], "samples": 2048}

    def plain(ident, texture, size, *at, **more):
        return {"id": ident, "texture": "../textures/%s.exr" % texture, "size": size, "pose": pose(*at), **more}

    save("tilted_translucent", [
        plain(1, "veil", [0.26, 0.2], [0.02, 0.03, 0.13], 58, 15, 10),
        plain(2, "veil", [0.24, 0.16], [-0.04, -0.02, 0.09], -47, 100, 35)])
    save("pile_of_5", [graded(k) for k in range(5)], physics={"rest_speed": 0.002, "seed": 5})
    save("pile_of_20", [graded(k) for k in range(20)], physics={"rest_speed": 0.002, "seed": 2})
    save("pile_of_30", [graded(k) for k in range(30)], physics={"rest_speed": 0.002, "seed": 11})
    few = [plain(1, "leaf", [0.2, 0.12], [0.08, 0.04, 0.07], 25, 40, 20),
           bottle(1, pose=pose([-0.1, -0.02, 0.05], 8, 70, 30)),
           plain(9, "veil", [0.16, 0.12], [0.02, -0.06, 0.1], -20, 10, 50)]
    save("very_soft_light", few, environment={"color": [0.0, 0.0, 0.0]},
         lights=[{"shape": "square", "size": 1.4, "power": 14.0, "position": [0.2, 0.1, 1.1]}])
    save("very_hard_light", few,
         lights=[{"shape": "disk", "size": 0.01, "power": 9.0, "position": [0.6, -0.3, 1.0]}])
    for turn in (0, 110, 230):
        save("room_turned_%03d" % turn, few, lights=[],
             environment={"path": "../textures/room.exr", "rotation_z": turn, "strength": 1.2})
    save("sun_in_the_sky", few, lights=[], environment={"path": "../textures/sun.exr", "rotation_z": 20})
    save("coloured_film", [
        plain(1, "gel", [0.24, 0.16], [0.06, 0.03, 0.06], 12, 40, 15, film="../textures/gel_opacity.exr"),
        plain(2, "gel", [0.2, 0.14], [-0.04, 0.0, 0.1], -15, 90, 70, film="../textures/gel_opacity.exr",
              hue_shift=25, value=0.8),
        bottle(2, pose=pose([-0.02, -0.05, 0.03], 4, 0, 100))])
    save("two_sides", [
        plain(1, "leaf", [0.2, 0.12], [0.07, 0.04, 0.08], 165, 40, 20, back={"texture": "../textures/veil.exr"}),
        plain(2, "veil", [0.2, 0.14], [-0.08, 0.02, 0.07], 20, 40, 20,
              back={"texture": "../textures/gel.exr", "film": "../textures/gel_opacity.exr"}),
        plain(3, "veil", [0.16, 0.12], [0.0, -0.09, 0.05], 192, 10, 60,
              back={"texture": "../textures/gel.exr", "film": "../textures/gel_opacity.exr"})])
    save("grazing_camera", few, camera=looking([0.15, -0.75, 0.14], [0.0, 0.0, 0.03], 1.4 * WIDTH))
    edge = {**base["camera"], "K": [[2.3 * c["fx"], 0.0, c["cx"]], [0.0, 2.3 * c["fy"], c["cy"]], [0.0, 0.0, 1.0]]}
    ring = [[0.15 * math.cos(0.785 * k), 0.1 * math.sin(0.785 * k), 0.02 + 0.012 * k] for k in range(8)]
    save("over_the_plate_s_edge", [graded(k) | {"pose": pose(at, 5 + 2 * k, 50 * k, 45 * k)} for k, at in enumerate(ring)],
         camera=edge)
    # Bottles out to the corners. 256 samples: noise of about 1.7e-3.
    rim = [[0.37 * math.cos(0.785 * k + 0.4), 0.25 * math.sin(0.785 * k + 0.4), 0.02 + 0.012 * k] for k in range(8)]
    around = [graded(k) | {"pose": pose(at, 5 + 2 * k, 50 * k, 45 * k)} for k, at in enumerate(rim)]
    for name, k1 in (("barrel_lens", -0.25), ("pincushion_lens", 0.25)):
        save(name, around, camera={**base["camera"], "k1": k1},
             render={**base["render"], "samples": 256})
    # A wide aperture: circles of confusion of up to 3 pixels before and behind the middle.
    tilted = looking([0.1, -0.62, 0.5], [0.0, 0.0, 0.03], 1.4 * WIDTH)
    save("depth_of_field", [graded(k) | {"pose": pose(at, 5 + 2 * k, 50 * k, 45 * k)} for k, at in enumerate(ring)],
         camera={**tilted, "aperture": {"diameter": 0.08, "focus": 0.8}})
    # One card far before another, which is in focus, and the soft edge of the first over it.
    save("soft_over_sharp", [
        plain(1, "veil", [0.3, 0.2], [0.02, 0.02, 0.02], 3, 30, 10),
        plain(2, "leaf", [0.14, 0.1], [0.04, -0.03, 0.35], 10, 60, 35)],
         camera={**base["camera"], "aperture": {"diameter": 0.08, "focus": 1.08}})


main()
