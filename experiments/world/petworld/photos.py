"""Bottle photos: one crushed bottle on a uniform screen, with its exact outline."""

import json
import math
import os
import time

import bpy
import numpy as np

from . import bottle, pixels, raster, studio

SCREENS = {
    "green": (0.045, 0.42, 0.085),
    "blue": (0.030, 0.095, 0.52),
    "grey": (0.30, 0.30, 0.30),
}
WHITE = 0.8                                 # albedo of the white reference screen
LIGHTS = ("soft", "window", "lamp", "overhead")


def lay(parts, side, yaw):
    """World matrix that lays a bottle on its side-th flat side, turned by yaw."""
    rots = bottle.rest_rotations(parts)
    pts = np.concatenate([p.verts for p in parts]).astype(float)
    c = pts.mean(0)
    heights = [float(((pts - c) @ r[2]).max() - ((pts - c) @ r[2]).min()) for r in rots]
    chosen = []
    for _ in range(side + 1):               # low sides first, each unlike those before it
        cost = [h * (1 + 1.5 * max([0.0] + [float(r[2] @ q[2]) for q in chosen])) +
                (1e3 if any(r is q for q in chosen) else 0) for h, r in zip(heights, rots)]
        chosen.append(rots[int(np.argmin(cost))])
    r = chosen[-1]
    v = pts @ r.T
    xy = v[:, :2] - v[:, :2].mean(0)
    w, e = np.linalg.eigh(xy.T @ xy)
    axis = e[:, 1]
    neck = next(p for p in parts if p.name == "neck").verts.mean(0) @ r.T
    if (neck[:2] - v[:, :2].mean(0)) @ axis < 0:
        axis = -axis
    a = yaw - math.atan2(axis[1], axis[0])
    z = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    r = z @ r
    v = pts @ r.T
    lo, hi = v.min(0), v.max(0)
    m = np.eye(4)
    m[:3, :3] = r
    m[:3, 3] = [-(lo[0] + hi[0]) / 2, -(lo[1] + hi[1]) / 2, 0.0004 - lo[2]]      # just off the screen
    return m


def light_rig(sc, rng, kind, uneven):
    """Add the lamps of a preset; returns the objects."""
    ang = rng.uniform(0, 2 * math.pi)
    d = np.array([math.cos(ang), math.sin(ang), 0.0])
    obs = []
    if kind == "soft":
        p = d * rng.uniform(0.55, 0.8) + [0, 0, rng.uniform(0.8, 1.1)]
        obs.append(studio.area_light(sc, "key", 10, rng.uniform(0.4, 0.7), p, (0, 0, 0)))
        p = -d * 0.9 + [0.2, 0, 0.7]
        obs.append(studio.area_light(sc, "fill", 3, 0.4, p, (0, 0, 0), colour=(0.93, 0.97, 1.0)))
        world, strength = "panels", 0.22
    elif kind == "window":
        obs.append(studio.area_light(sc, "glow", 2.0, 0.8, d * 1.2 + [0, 0, 0.7], (0, 0, 0), colour=(0.9, 0.96, 1.0)))
        world, strength = "window", 0.8
    elif kind == "lamp":
        p = d * rng.uniform(0.40, 0.60) + [0, 0, rng.uniform(0.55, 0.75)]
        obs.append(studio.area_light(sc, "lamp", 5, 0.14, p, (0, 0, 0), colour=(1.0, 0.93, 0.82)))
        world, strength = "mixed", 0.25
    else:
        obs.append(studio.area_light(sc, "overhead", 14, 1.2, d * 0.45 + [0, 0, 1.5], (0, 0, 0), size_y=0.3))
        world, strength = "panels", 0.15
    if uneven > 0:                          # one near lamp at grazing height
        p = d * (0.62 - 0.22 * uneven) + [0, 0, 0.62 - 0.28 * uneven]
        obs.append(studio.area_light(sc, "near", 5.0 * uneven, 0.2, p, d * 0.15))
    studio.set_world(sc, rng, world, strength, rotate=rng.uniform(0, 2 * math.pi))
    return obs


class Screen:
    """The backdrop plane, with the albedo or emission to render against."""

    def __init__(self):
        n = studio.Nodes("screen")
        self.diffuse = n.add("BsdfDiffuse")
        self.mat = n.done(self.diffuse.outputs[0])
        e = studio.Nodes("backlight")
        em = e.add("Emission")
        self.emit = e.done(em.outputs[0])
        v = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float) * 1.5
        self.ob = studio.mesh_object("screen", v, [[0, 1, 2, 3]], material=self.mat, smooth=False)

    def paint(self, albedo):
        self.diffuse.inputs["Color"].default_value = tuple(albedo) + (1.0,)


def shoot(desc, photo, args, out):
    """Render one photo and its ground truth; returns its manifest record."""
    rng = bottle.seeded("photo", args.seed, desc["library_seed"], desc["index"], photo)
    began = time.process_time(), time.time()
    shape = bottle.shape(desc, args.cache)
    parts = bottle.build(desc, shape, solid=args.wall == "solid", detail=1)
    sc = studio.new_scene(args.threads, args.spp, not args.no_denoise)
    sc.cycles.use_adaptive_sampling = False
    sc.render.use_persistent_data = True
    colour = args.screen
    if colour == "auto":                    # the key colour must not be in the object
        colour = "green" if desc["colour"] == "blue" or (desc["colour"] != "green" and (desc["index"] + photo) % 2 == 0) else "blue"
    light = args.light if args.light != "auto" else LIGHTS[(desc["index"] + photo * 2 + int(rng.integers(0, 2))) % 4]
    matrix = lay(parts, photo, rng.normal(0, math.radians(6)))
    lamps = light_rig(sc, rng, light, args.uneven)
    screen = Screen()
    obs = studio.add_bottle(desc, parts, args.wall == "solid", bottle.seeded("label", desc["library_seed"], desc["index"]), matrix)

    verts = [p.verts @ matrix[:3, :3].T + matrix[:3, 3] for p in parts]
    allv = np.concatenate(verts)
    size = np.ptp(allv, axis=0)
    w = args.width
    margin = 0.09 * size[0]
    scale = w / (size[0] + 2 * margin)
    h = int(round(w * max(0.36, (size[1] + 2 * margin) / (size[0] + 2 * margin)) / 2)) * 2
    dist = rng.uniform(0.85, 1.1)
    cam = studio.look_at_camera(w, h, scale * dist, (rng.normal(0, 0.006), rng.normal(0, 0.006), dist), (0, 0, 0))
    studio.set_camera(sc, cam)

    # ---- truth that needs no rendering
    cover = raster.coverage(allv, raster.triangles_of(parts), cam, w, h)
    uv, _ = raster.project(allv, cam)
    hull = raster.convex_hull(uv)

    # ---- renders
    white, key = (WHITE,) * 3, SCREENS[colour]
    seed = int(rng.integers(1, 1 << 30))
    if args.albedo_jitter:
        key = tuple(float(np.clip(k * math.exp(rng.normal(0, args.albedo_jitter)), 0.01, 0.9)) for k in key)
    for ob in obs:
        ob.hide_render = True
    screen.paint(white)
    pw = -(-w // 8)                         # the empty screen is smooth: render it small
    ph = int(math.ceil(h * pw / w)) + 2
    plate = enlarge(studio.render(sc, pw, ph, samples=256, seed=seed), w, h)
    sc.cycles.samples = args.spp
    for ob in obs:
        ob.hide_render = False
    screen.paint(key)
    photo_lin = studio.render(sc, w, h, seed=seed + 1)

    key_plate = plate * (np.array(key) / WHITE)
    target = float(rng.uniform(0.32, 0.46)) * args.exposure
    gain = target / float(np.median(key_plate.max(-1)))
    vig_s = float(rng.uniform(0.02, 0.08))
    vig = studio.vignette_map(h, w, vig_s)[..., None]
    noise = dict(shot=0.006 * args.noise, read=0.002 * args.noise)
    shot = studio.develop(photo_lin, rng, exposure=gain, vignette=vig_s, blur=args.blur, **noise)

    name = f"b{desc['index']:04d}_{photo}"
    files = dict(photo_png=f"{name}.png", mask=f"{name}_mask.png")
    pixels.write_png(os.path.join(out, files["photo_png"]), pixels.to_u8(pixels.srgb_encode(shot)))
    pixels.write_png(os.path.join(out, files["mask"]), pixels.to_u8(cover))
    ppm = float(cam["K"][0, 0] / dist)
    rec = dict(
        name=name, instance=desc["index"], photo=photo, files=files, width=w, height=h,
        class_id=desc["class_id"], class_name=desc["class_name"],
        size_m=dict(length=round(float(size[0]), 5), width=round(float(size[1]), 5), thickness=round(float(size[2]), 5)),
        px_per_metre=dict(screen_plane=round(ppm, 3),
                          mid_bottle=round(float(cam["K"][0, 0] / (dist - size[2] / 2)), 3)),
        bbox_px=[round(float(q), 2) for q in (*uv.min(0), *uv.max(0))],
        hull_px=[[round(float(a), 2), round(float(b), 2)] for a, b in simplify(hull, 0.02)],
        mask_area_px=round(float(cover.sum()), 1),
        screen=dict(colour=colour, albedo_linear=[round(float(k), 5) for k in key],
                    mean_linear=[round(float(q), 5) for q in (key_plate * gain * vig).mean((0, 1))]),
        light=light, uneven=args.uneven, camera=studio.camera_json(cam),
        sensor=dict(exposure=round(gain, 6), vignette=round(vig_s, 5), saturates_at=4.0, blur_px=args.blur, **noise),
        wall=args.wall, spp=args.spp)
    rec["cost"] = dict(cpu_s=round(time.process_time() - began[0], 1), wall_s=round(time.time() - began[1], 1))
    return rec


def enlarge(small, w, h):
    """Catmull-Rom enlargement of a picture of the same view, centred, scaled by width."""
    sh, sw = small.shape[:2]
    k = sw / w

    def axis(n, full, size):
        c = (np.arange(full) + 0.5 - full / 2) * k + n / 2 - 0.5
        i = np.floor(c).astype(int)
        t = (c - i)[:, None]
        wt = np.concatenate([-0.5 * t + t * t - 0.5 * t ** 3, 1 - 2.5 * t * t + 1.5 * t ** 3,
                             0.5 * t + 2 * t * t - 1.5 * t ** 3, -0.5 * t * t + 0.5 * t ** 3], 1)
        m = np.zeros((full, n))
        for j in range(4):
            np.add.at(m, (np.arange(full), np.clip(i - 1 + j, 0, n - 1)), wt[:, j])
        return m
    return np.einsum("yi,xj,ijc->yxc", axis(sh, h, sh), axis(sw, w, sw), small, optimize=True)


def simplify(poly, tol):
    """Drop hull points closer than tol pixels to the line of their neighbours."""
    pts = [np.asarray(p, float) for p in poly]
    changed = True
    while changed and len(pts) > 4:
        changed = False
        for i in range(len(pts)):
            a, b, c = pts[i - 1], pts[i], pts[(i + 1) % len(pts)]
            d = c - a
            area = abs(d[0] * (b - a)[1] - d[1] * (b - a)[0])
            if area / (np.hypot(*d) + 1e-12) < tol:
                pts.pop(i)
                changed = True
                break
    return pts


def run(args):
    out = os.path.join(args.out, "bottles")
    os.makedirs(out, exist_ok=True)
    force = {k: v for k, v in dict(colour=args.colour, style=args.style, litres=args.litres,
                                   flatness=args.flatness).items() if v is not None}
    if args.bottle_class is not None:
        force["class"] = args.bottle_class
    for i in range(args.first, args.first + args.count):
        desc = bottle.describe(args.library_seed, i, force)
        path = os.path.join(out, f"b{i:04d}.json")
        photos = []
        for p in range(args.photos):
            rec = shoot(desc, p, args, out)
            photos.append(rec)
            print(f"{rec['name']}: {desc['colour']} {desc['litres']} L {desc['class_name']} on {rec['screen']['colour']}, "
                  f"{rec['width']}x{rec['height']}, {rec['cost']['cpu_s']} CPU s, {rec['cost']['wall_s']} s", flush=True)
        costs = [r.pop("cost") for r in photos]
        pixels.write_json(path, dict(instance=desc, photos=photos))
        log_cost(args, "bottles", costs)


def log_cost(args, what, costs):
    if args.cost_log:
        with open(args.cost_log, "a") as f:
            for c in costs:
                f.write(json.dumps(dict(what=what, **c)) + "\n")
