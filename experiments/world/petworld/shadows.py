"""How dark the shadow of a bottle is: the light that a floor loses, over the area of the shadow's outline."""

import json
import math
import os

import bpy
import numpy as np

from . import bottle, photos, pixels, raster, studio

FLOOR = 0.02                # albedo: what the bottle throws back at the floor is left out
LAMP_DISTANCE_M = 1.2
LAMP_SIDE_M = 0.4           # wide enough for paths through the walls to meet it
TILTS_DEG = (0.0, 35.0)
WALLS = ("shade", "glass")  # as the piles have them, and traced through the refracting walls
SCALE_PX = 500.0            # pixels per metre
MARGIN_M = 0.08
EYE_M = 20.0                # far: heights hardly shift the picture


def run(args):
    out = os.path.join(args.out, "shadows")
    os.makedirs(out, exist_ok=True)
    for index in range(args.first, args.first + args.count):
        record = measure(args, index)
        pixels.write_json(os.path.join(out, f"b{index:04d}.json"), record)
        print(json.dumps(record), flush=True)


def measure(args, index):
    desc = bottle.describe(args.library_seed, index, {})
    parts = bottle.build(desc, bottle.shape(desc, args.cache), solid=True, detail=1)
    matrix = photos.lay(parts, 0, 0.0)
    found = [density(args, desc, parts, matrix, walls, tilt) for walls in WALLS for tilt in TILTS_DEG]
    return dict(index=index, colour=desc["colour"], class_name=desc["class_name"], shadows=found)


def density(args, desc, parts, matrix, walls, tilt):
    """Mean share of the lamp's light that is lost inside the outline of the shadow, per channel."""
    sc = studio.new_scene(args.threads, args.spp, denoise=False)
    sc.cycles.use_adaptive_sampling = False
    sc.cycles.sample_clamp_indirect = 0.0
    sc.cycles.caustics_reflective = True
    tilt = math.radians(tilt)
    lamp = np.array([math.sin(tilt), 0.0, math.cos(tilt)]) * LAMP_DISTANCE_M
    studio.area_light(sc, "lamp", 10, LAMP_SIDE_M, lamp, (0, 0, 0), visible=False)
    screen = photos.Screen()
    screen.paint((FLOOR,) * 3)
    art = bottle.seeded("label", desc["library_seed"], desc["index"])
    obs = studio.add_bottle(desc, parts, True, art, matrix)
    for ob in obs:
        show(ob, walls)
    outline, cam = shadow_outline(parts, matrix, math.tan(tilt))
    studio.set_camera(sc, cam)
    seed = int(args.seed)
    lit = studio.render(sc, cam["width"], cam["height"], seed=seed)
    for ob in obs:
        ob.hide_render = True
    empty = studio.render(sc, cam["width"], cam["height"], samples=64, seed=seed + 1)
    lost = (1.0 - lit / smooth(empty)).sum((0, 1))
    return dict(walls=walls, tilt_deg=round(math.degrees(tilt)), area_m2=round(float(outline.sum()) / SCALE_PX ** 2, 6),
                density=[round(float(q), 4) for q in lost / outline.sum()])


def show(ob, walls):
    """The floor alone is seen; light passes the simple walls or the refracting ones."""
    ob.visible_camera = False
    simple = ob.name.startswith("shade")
    if walls == "glass":
        ob.hide_render = simple
        ob.visible_shadow = ob.visible_diffuse = True


def shadow_outline(parts, matrix, slope):
    """Coverage of the floor by the bottle as the lamp's middle sees it, and a camera above."""
    verts = [p.verts @ matrix[:3, :3].T + matrix[:3, 3] for p in parts]
    flat = np.concatenate(verts)
    flat[:, 0] -= slope * flat[:, 2]
    flat[:, 2] *= 1e-3
    low, high = flat[:, :2].min(0) - MARGIN_M, flat[:, :2].max(0) + MARGIN_M
    w, h = (int(math.ceil(s * SCALE_PX / 2)) * 2 for s in high - low)
    middle = (low + high) / 2
    cam = studio.look_at_camera(w, h, SCALE_PX * EYE_M, (*middle, EYE_M), (*middle, 0.0))
    return raster.coverage(flat, raster.triangles_of(parts), cam, w, h), cam


def smooth(empty):
    """The least squares fit of a polynomial of second order: the lamp's own fall-off, without noise."""
    h, w = empty.shape[:2]
    y, x = np.mgrid[0:h, 0:w] / max(h, w) - 0.5
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1).reshape(-1, 6)
    fit = np.linalg.lstsq(terms, empty.reshape(-1, 3), rcond=None)[0]
    return (terms @ fit).reshape(h, w, 3)
