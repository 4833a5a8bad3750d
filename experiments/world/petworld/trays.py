"""The tray on its table: empty backgrounds and piles of bottles, with exact truth.

World frame: origin in the centre of the tray floor, x along its long side,
z up, the floor's upper surface is z = 0.
"""

import math
import os
import time

import bpy
import numpy as np

from . import art, bottle, photos, pixels, raster, studio

WALL_HEIGHT = 0.075
WALL_SLOPE = math.tan(math.radians(8))
VIEWS = {"fronto": (0.5, 3.0), "above": (7.0, 17.0), "tilted": (22.0, 36.0), "extreme": (48.0, 60.0)}


# ------------------------------------------------------------------- scene

def rounded(hx, hy, r, n=6):
    pts = []
    for k, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        for i in range(n + 1):
            a = math.pi / 2 * (k + i / n)
            pts.append((sx * (hx - r) + r * math.cos(a), sy * (hy - r) + r * math.sin(a)))
    return np.array(pts)


def tray_mesh(length, width, material):
    hx, hy, h, s = length / 2, width / 2, WALL_HEIGHT, WALL_SLOPE
    f = 0.0025
    rings = [(0, -f, 0.004, 0.0), (0, 0, 0.005, f * 0.35), (0, f * s, 0.006, f)]
    rings += [(0, s * z, 0.006 + 0.02 * z / h, z) for z in np.linspace(0.012, h - 0.003, 5)]
    t = s * h
    rings += [(0, t + 0.001, 0.027, h - 0.0008), (0, t + 0.003, 0.029, h), (0, t + 0.014, 0.038, h),
              (0, t + 0.0155, 0.039, h - 0.0015), (0, t + 0.0155, 0.039, h - 0.010), (0, t + 0.0135, 0.037, h - 0.010),
              (0, t + 0.0035, 0.03, h - 0.006), (0, 0.0035, 0.012, -0.004)]
    verts = [np.c_[rounded(hx + o, hy + o, r), np.full(28, z)] for _, o, r, z in rings]
    v = np.concatenate(verts + [np.array([[0, 0, 0.0]])])
    n = 28
    idx = np.arange(len(rings) * n).reshape(len(rings), n)
    nx = np.roll(idx, -1, 1)
    q = np.stack([idx[:-1], idx[1:], nx[1:], nx[:-1]], -1).reshape(-1, 4)[:, ::-1]
    t3 = np.stack([np.full(n, len(v) - 1), idx[0], nx[0]], -1)
    return studio.mesh_object("tray", v, q, tris=t3, material=material, smooth=False)


def wood(rng):
    n = studio.Nodes("wood")
    co = n.add("TexCoord")
    mp = n.add("Mapping")
    mp.inputs["Location"].default_value = tuple(rng.uniform(-5, 5, 3))
    turn = rng.random() < 0.5
    mp.inputs["Scale"].default_value = (1.6, 17.0, 1.0) if turn else (17.0, 1.6, 1.0)
    n.link(co.outputs["Object"], mp.inputs[0])
    a = n.add("TexNoise")
    n.link(mp.outputs[0], a.inputs["Vector"])
    a.inputs["Scale"].default_value, a.inputs["Detail"].default_value = 3.4, 12.0
    a.inputs["Distortion"].default_value = 0.9
    sep = n.add("SeparateXYZ")
    n.link(co.outputs["Object"], sep.inputs[0])
    across = n.math("DIVIDE", sep.outputs[1 if turn else 0], float(rng.uniform(0.09, 0.16)))
    plank = n.math("FLOOR", across)
    wn = n.add("TexWhiteNoise", noise_dimensions="1D")
    n.put(wn.inputs["W"], n.math("ADD", plank, float(rng.uniform(0, 50))))
    dark = np.array([0.16, 0.075, 0.032]) * rng.uniform(0.6, 1.8)
    light = dark * rng.uniform(2.0, 2.8) + 0.04
    base = n.ramp(a.outputs["Fac"], [(0.30, dark), (0.50, (dark + light) / 2), (0.68, light)])
    base = n.mix_colour(n.math("MULTIPLY", wn.outputs["Value"], 0.45), base, tuple(dark * 0.8) + (1.0,))
    gap = n.math("LESS_THAN", n.math("FRACT", across), 0.018)
    base = n.mix_colour(gap, base, tuple(dark * 0.15) + (1.0,))
    p = n.add("BsdfPrincipled")
    n.link(base, p.inputs["Base Color"])
    p.inputs["Roughness"].default_value = float(rng.uniform(0.35, 0.6))
    return n.done(p.outputs[0])


def brushed(rng):
    n = studio.Nodes("metal")
    co = n.add("TexCoord")
    mp = n.add("Mapping")
    mp.inputs["Scale"].default_value = (2.0, 260.0, 1.0)
    n.link(co.outputs["Object"], mp.inputs[0])
    a = n.add("TexNoise")
    n.link(mp.outputs[0], a.inputs["Vector"])
    a.inputs["Scale"].default_value, a.inputs["Detail"].default_value = 1.5, 5.0
    grey = rng.uniform(0.42, 0.58)
    col = n.ramp(a.outputs["Fac"], [(0.3, (grey * 0.8,) * 3), (0.7, (grey * 1.15,) * 3)])
    p = n.add("BsdfPrincipled")
    n.link(col, p.inputs["Base Color"])
    p.inputs["Metallic"].default_value = 1.0
    n.put(p.inputs["Roughness"], n.math("ADD", n.math("MULTIPLY", a.outputs["Fac"], 0.25), 0.27))
    return n.done(p.outputs[0])


def robot_arm(rng, base, towards):
    """A jointed arm bolted to the table, folded beside the tray."""
    body = studio.plastic_material("arm", (0.62, 0.63, 0.64), 0.35)
    joint = studio.plastic_material("joint", [(0.03, 0.16, 0.36), (0.55, 0.14, 0.02), (0.06, 0.06, 0.065)][int(rng.integers(3))], 0.4)
    steel = studio.metal_material("steel", (0.5, 0.5, 0.52), 0.3)
    dark = studio.plastic_material("dark", (0.03, 0.03, 0.032), 0.5)
    b = np.array([base[0], base[1], -0.006])
    d = np.array([towards[0] - base[0], towards[1] - base[1], 0.0])
    d /= np.linalg.norm(d)
    a = -math.copysign(rng.uniform(-0.30, 0.30), base[0])     # along the tray's short side
    d = np.array([d[0] * math.cos(a) - d[1] * math.sin(a), d[0] * math.sin(a) + d[1] * math.cos(a), 0])
    side = np.array([-d[1], d[0], 0])
    up = np.array([0, 0, 1.0])
    studio.tube("plate", b, b + up * 0.012, 0.105, steel)
    for k in range(6):
        q = b + 0.09 * (math.cos(k * math.pi / 3) * d + math.sin(k * math.pi / 3) * side) + up * 0.012
        studio.tube("bolt", q, q + up * 0.006, 0.007, dark, cols=6)
    studio.tube("base", b + up * 0.012, b + up * 0.13, 0.075, body, radius_b=0.066)
    s = b + up * 0.17
    studio.tube("shoulder", s - side * 0.075, s + side * 0.085, 0.062, body)
    studio.tube("shoulder cap", s + side * 0.085, s + side * 0.105, 0.058, joint)
    studio.tube("shoulder cap", s - side * 0.095, s - side * 0.075, 0.058, joint)
    lift = rng.uniform(0.9, 1.25)
    e = s + 0.36 * (math.cos(lift) * d + math.sin(lift) * up)
    off = side * 0.07
    studio.tube("upper arm", s + off, e + off, 0.048, body, radius_b=0.043)
    studio.tube("elbow", e - side * 0.05, e + side * 0.12, 0.052, body)
    studio.tube("elbow cap", e + side * 0.12, e + side * 0.138, 0.048, joint)
    swing = rng.uniform(-0.5, 0.15)
    f = e + 0.30 * (math.cos(swing) * d + math.sin(swing) * up)
    studio.tube("forearm", e - side * 0.03, f - side * 0.03, 0.040, body, radius_b=0.034)
    studio.tube("wrist", f - side * 0.075, f + side * 0.045, 0.037, body)
    studio.tube("wrist cap", f + side * 0.045, f + side * 0.058, 0.034, joint)
    w = f - side * 0.02
    studio.tube("wrist 2", w, w - up * 0.085, 0.034, body)
    g = w - up * 0.085
    studio.tube("flange", g, g - up * 0.02, 0.030, steel)
    studio.box("gripper", (0.09, 0.045, 0.05), tuple(g - up * 0.045), dark, bevel=0.004)
    for sgn in (-1, 1):
        studio.box("finger", (0.012, 0.022, 0.06), tuple(g - up * 0.095 + np.array([sgn * 0.032, 0, 0])), steel, bevel=0.002)
    return [b, s, e, f, g]


def cable(points, radius, material):
    """A tube through points on a Catmull-Rom curve."""
    p = np.asarray(points, float)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    cs = []
    for i in range(1, len(p) - 2):
        for t in np.linspace(0, 1, 14, endpoint=False):
            cs.append(0.5 * (2 * p[i] + (p[i + 1] - p[i - 1]) * t + (2 * p[i - 1] - 5 * p[i] + 4 * p[i + 1] - p[i + 2]) * t * t
                             + (3 * p[i] - p[i - 1] - 3 * p[i + 1] + p[i + 2]) * t ** 3))
    c = np.array(cs)
    d = np.gradient(c, axis=0)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    u = np.cross(d, [0, 0, 1.0])
    u /= np.linalg.norm(u, axis=1, keepdims=True) + 1e-9
    w = np.cross(d, u)
    t = np.arange(10) * 2 * math.pi / 10
    v = c[:, None] + radius * (np.cos(t)[None, :, None] * u[:, None] + np.sin(t)[None, :, None] * w[:, None])
    return studio.mesh_object("cable", v.reshape(-1, 3), bottle.quads(len(c), 10), material=material)


# Share of light that a sheet of paper reflects.
PAPER = 0.8
TRAY_COLOURS = [(0.30, 0.31, 0.32), (0.62, 0.62, 0.60), (0.045, 0.13, 0.33), (0.06, 0.06, 0.065), (0.50, 0.46, 0.38)]


def build_room(room_seed, tray):
    """Table, tray, arm and clutter of one room; returns what the truth needs."""
    rng = bottle.seeded("room", room_seed)
    length, width = tray
    tray_mat = studio.plastic_material("tray", TRAY_COLOURS[int(rng.integers(len(TRAY_COLOURS)))], float(rng.uniform(0.4, 0.6)), noise=0.20, scale=35.0)
    tray_mesh(length, width, tray_mat)
    top = wood(rng) if rng.random() < 0.65 else brushed(rng)
    z = -0.0045
    tx, ty = rng.uniform(-0.1, 0.1), rng.uniform(-0.05, 0.05)
    studio.box("table", (2.0, 1.3, 0.03), (tx, ty, z - 0.015), top, bevel=0.003)
    ground = studio.plastic_material("ground", (0.22, 0.215, 0.21), 0.7, noise=0.5, scale=9.0)
    studio.mesh_object("ground", np.array([[-4, -4, -0.75], [4, -4, -0.75], [4, 4, -0.75], [-4, 4, -0.75]], float),
                       [[0, 1, 2, 3]], material=ground, smooth=False)
    sx = rng.choice([-1, 1])
    base = (sx * (length / 2 + rng.uniform(0.17, 0.21)), rng.uniform(-0.20, 0.05))
    joints = robot_arm(rng, base, (sx * (length / 2 + 0.14), 0.9))
    black = studio.plastic_material("black", (0.02, 0.02, 0.022), 0.5)
    b = joints[0]
    cable([b + [0.02, 0.08, 0.03], b + [sx * 0.06, 0.2, 0.004], b + [sx * -0.02, 0.34, 0.004], b + [sx * 0.1, 0.6, 0.004]], 0.005, black)
    # small things on the table around the tray
    paints = [(0.5, 0.03, 0.03), (0.05, 0.2, 0.5), (0.65, 0.45, 0.03), (0.05, 0.3, 0.1), (0.6, 0.6, 0.58), (0.04, 0.04, 0.04)]
    for _ in range(int(rng.integers(5, 10))):
        for _ in range(40):
            p = np.array([rng.uniform(-0.62, 0.62), rng.uniform(-0.46, 0.46)])
            away = abs(p[0]) > length / 2 + 0.08 or abs(p[1]) > width / 2 + 0.07
            if away and np.hypot(*(p - b[:2])) > 0.17:
                break
        ang = rng.uniform(0, math.pi)
        dirv = np.array([math.cos(ang), math.sin(ang), 0])
        q = np.array([p[0], p[1], z])
        paint = studio.plastic_material("thing", paints[int(rng.integers(len(paints)))], float(rng.uniform(0.25, 0.6)))
        kind = rng.choice(["pen", "box", "paper", "tape", "driver", "cup"])
        if kind == "pen":
            studio.tube("pen", q + [0, 0, 0.006] - dirv * 0.06, q + [0, 0, 0.006] + dirv * 0.055, 0.0055, paint, cols=16)
            studio.tube("nib", q + [0, 0, 0.006] + dirv * 0.055, q + [0, 0, 0.006] + dirv * 0.072, 0.005, black, cols=16, radius_b=0.001)
        elif kind == "box":
            ob = studio.box("box", (rng.uniform(0.03, 0.09), rng.uniform(0.03, 0.06), 0.03), (0, 0, 0), paint, bevel=0.002)
            ob.location = tuple(q + [0, 0, 0.015])
            ob.rotation_euler = (0, 0, ang)
        elif kind == "paper":
            page = np.ones((240, 170, 3)) * 0.92
            for r in range(14, 226, 9):
                words = "".join(rng.choice(list("ABCDEFGHIKLMNOPRSTUVWX   ")) for _ in range(int(rng.integers(12, 24))))
                art.stamp(page, art.text_mask(words, 7, 0.7)[:, :146], r, 12, (0.1, 0.1, 0.12))
            flat_picture("paper", page, q + [0, 0, 0.0006], 0.10, 0.141, ang)
        elif kind == "tape":
            studio.tube("tape", q, q + [0, 0, 0.02], 0.045, paint, cols=48)
            studio.tube("hole", q + [0, 0, 0.0195], q + [0, 0, 0.0206], 0.036, black, cols=48)
        elif kind == "driver":
            m = q + [0, 0, 0.013]
            studio.tube("handle", m, m + dirv * 0.09, 0.0125, paint, cols=20)
            studio.tube("shaft", m - dirv * 0.10, m, 0.003, studio.metal_material("shaft", (0.6, 0.6, 0.6), 0.25), cols=12)
        else:
            studio.tube("cup", q, q + [0, 0, 0.085], 0.033, paint, cols=40, radius_b=0.039)
            studio.tube("coffee", q + [0, 0, 0.0845], q + [0, 0, 0.0856], 0.034, black, cols=40)


def flat_picture(name, a, centre, w, h, angle, interpolate=True):
    """A printed sheet lying on a surface; the picture's top points to +y when angle is 0."""
    n = studio.Nodes(name)
    t = n.add("TexImage", interpolation="Linear" if interpolate else "Closest")
    t.image = studio.image_from_array(name, a)
    p = n.add("BsdfPrincipled")
    n.link(t.outputs["Color"], p.inputs["Base Color"])
    p.inputs["Roughness"].default_value = 0.6
    v = np.array([[-w / 2, -h / 2, 0], [w / 2, -h / 2, 0], [w / 2, h / 2, 0], [-w / 2, h / 2, 0]])
    ob = studio.mesh_object(name, v, [[0, 1, 2, 3]], uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]),
                            material=n.done(p.outputs[0]), smooth=False)
    ob.location = tuple(centre)
    ob.rotation_euler = (0, 0, angle)
    return ob


def light_room(sc, rng, kind):
    """Lamps of one of the three conditions; returns objects to remove later."""
    a = rng.uniform(0, 2 * math.pi)
    d = np.array([math.cos(a), math.sin(a), 0])
    if kind == "bright":
        obs = [studio.area_light(sc, "lamp", 30, 0.35, d * rng.uniform(0.5, 0.8) + [0, 0, rng.uniform(1.1, 1.4)], (0, 0, 0), colour=(1.0, 0.96, 0.9))]
        studio.set_world(sc, rng, "panels", 0.35, rotate=rng.uniform(0, 6.28))
    elif kind == "dim":
        obs = [studio.area_light(sc, "lamp", 3.0, 0.15, d * rng.uniform(0.7, 1.0) + [0, 0, rng.uniform(0.8, 1.1)], (0, 0, 0), colour=(1.0, 0.82, 0.60))]
        studio.set_world(sc, rng, "mixed", 0.035, rotate=rng.uniform(0, 6.28))
    else:
        obs = []
        studio.set_world(sc, rng, "ambient", 0.8, rotate=rng.uniform(0, 6.28))
    return obs


# Mean display level and colour cast that an automatic exposure leaves per condition.
EXPOSURE = {"bright": (0.30, (1.0, 1.0, 1.0), 1.0), "dim": (0.13, (1.06, 1.0, 0.88), 2.5), "ambient": (0.20, (0.96, 1.0, 1.06), 1.5)}


def expose(lin, rng, kind, args):
    """Sensor picture of a linear render, with the settings that were used."""
    level, cast, grain = EXPOSURE[kind]
    lum = lin @ np.array([0.2126, 0.7152, 0.0722])
    gain = level * rng.uniform(0.85, 1.2) * args.exposure / float(np.mean(np.minimum(lum, 4 * np.median(lum))) + 1e-9)
    vig = float(rng.uniform(0.06, 0.16))
    noise = dict(shot=0.008 * grain * args.noise, read=0.002 * grain * args.noise)
    img = studio.develop(lin, rng, exposure=gain, vignette=vig, blur=args.blur, white=cast, **noise)
    return img, dict(exposure=round(gain, 6), vignette=round(vig, 5), white=list(cast), blur_px=args.blur,
                     saturates_at=4.0, **{k: round(v, 6) for k, v in noise.items()})


def lay_paper():
    """A blank white sheet in the middle of the tray, beside which its colour can be measured; returns its corners."""
    w, h = 0.105, 0.148
    flat_picture("sheet", np.full((8, 8, 3), pixels.srgb_encode(PAPER)), (0, 0, 0.0006), w, h, 0.0)
    return np.array([[-w / 2, h / 2, 0], [w / 2, h / 2, 0], [w / 2, -h / 2, 0], [-w / 2, -h / 2, 0]])


def tray_camera(rng, view, args, azimuth=None):
    w, h = args.width, args.height
    lo, hi = VIEWS[view]
    tilt = math.radians(rng.uniform(lo, hi))
    az = rng.uniform(0, 2 * math.pi) if azimuth is None else azimuth
    focal = w * rng.uniform(1.05, 1.4)
    fill = rng.uniform(0.56, 0.68)
    dist = focal * max(args.tray[0] / (fill * w), args.tray[1] / (0.86 * fill * h)) * (1 + 0.10 * math.sin(tilt))
    target = np.array([rng.normal(0, 0.012), rng.normal(0, 0.012), 0.02])
    pos = target + dist * np.array([math.sin(tilt) * math.cos(az), math.sin(tilt) * math.sin(az), math.cos(tilt)])
    cam = studio.look_at_camera(w, h, focal, pos, target, roll=rng.normal(0, math.radians(3)))
    return cam, dict(view=view, tilt_deg=round(math.degrees(tilt), 3), azimuth_deg=round(math.degrees(az), 2), distance_m=round(dist, 4))


def tray_truth(args, cam):
    l, w = args.tray
    world = np.array([[-l / 2, w / 2, 0], [l / 2, w / 2, 0], [l / 2, -w / 2, 0], [-l / 2, -w / 2, 0]])
    uv, _ = raster.project(world, cam)
    dg = bpy.context.evaluated_depsgraph_get()
    seen = []
    for c in world:
        p = c * (1 - 0.006 / np.linalg.norm(c)) + [0, 0, 0.0005]
        d = p - cam["position"]
        ln = np.linalg.norm(d)
        hit, at, *_ = bpy.context.scene.ray_cast(dg, tuple(cam["position"]), tuple(d / ln))
        seen.append(bool(not hit or np.linalg.norm(np.array(at) - cam["position"]) > ln - 0.004))
    return dict(floor_m=[l, w], wall_height_m=WALL_HEIGHT,
                corners_m=[[round(float(v), 6) for v in q] for q in world],
                corners_px=[[round(float(v), 3) for v in q] for q in uv], corners_visible=seen)


def save_picture(path, img, fmt):
    u8 = pixels.to_u8(pixels.srgb_encode(img))
    if fmt == "png":
        pixels.write_png(path, u8)
        return
    sc = bpy.context.scene
    st = sc.render.image_settings
    pic = studio.image_from_array("out", u8 / 255.0)
    st.file_format = "JPEG"
    st.color_mode = "RGB"
    st.quality = 94
    try:
        pic.save_render(path, scene=sc)
    finally:
        bpy.data.images.remove(pic)


def run_backgrounds(args):
    out = os.path.join(args.out, "backgrounds")
    os.makedirs(out, exist_ok=True)
    costs = []
    for i in range(args.first, args.first + args.count):
        began = time.process_time(), time.time()
        rng = bottle.seeded("background", args.seed, args.room_seed, i)
        sc = studio.new_scene(args.threads, args.spp, not args.no_denoise)
        if sc.cycles.use_denoising:
            sc.cycles.denoising_prefilter = "FAST"      # nothing transparent here
        build_room(args.room_seed, args.tray)
        sheet = lay_paper() if args.paper else None
        view = args.views[i % len(args.views)]
        light = args.lights[(i + i // len(args.views)) % len(args.lights)]
        cam, where = tray_camera(rng, view, args)
        studio.set_camera(sc, cam)
        light_room(sc, rng, light)
        lin = studio.render(sc, args.width, args.height, seed=int(rng.integers(1, 1 << 30)))
        img, sensor = expose(lin, rng, light, args)
        name = f"bg{i:04d}"
        rec = dict(name=name, files=dict(picture=f"{name}.{args.format}"), room_seed=args.room_seed,
                   **where, light=light, tray=tray_truth(args, cam), camera=studio.camera_json(cam),
                   sensor=sensor, spp=args.spp)
        if args.paper:
            rec["paper_px"] = [[round(float(v), 3) for v in q] for q in raster.project(sheet, cam)[0]]
        save_picture(os.path.join(out, rec["files"]["picture"]), img, args.format)
        pixels.write_json(os.path.join(out, name + ".json"), rec)
        costs.append(dict(cpu_s=round(time.process_time() - began[0], 1), wall_s=round(time.time() - began[1], 1)))
        print(f"{name}: {view} {light}, {costs[-1]['cpu_s']} CPU s, {costs[-1]['wall_s']} s", flush=True)
    photos.log_cost(args, "backgrounds", costs)


# -------------------------------------------------------------------- piles

def drop(bottles, tray, rng, frames=110):
    """Let bottles fall into the tray one above the other; returns their poses (4, 4).

    The simulation runs ten times larger than life, where the solver behaves best.
    """
    import mathutils
    scale = 10.0
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sc = bpy.context.scene
    sc.gravity = (0, 0, -9.81 * scale)
    sc.frame_start, sc.frame_end = 1, frames
    bpy.ops.rigidbody.world_add()
    rw = sc.rigidbody_world
    rw.substeps_per_frame, rw.solver_iterations = 12, 20
    rw.point_cache.frame_start, rw.point_cache.frame_end = 1, frames

    def body(ob, kind, friction):
        bpy.context.view_layer.objects.active = ob
        bpy.ops.rigidbody.object_add(type=kind)
        r = ob.rigid_body
        r.collision_shape = "CONVEX_HULL"
        r.friction, r.restitution = friction, 0.02
        r.use_margin, r.collision_margin = True, 0.008
        r.linear_damping, r.angular_damping = 0.12, 0.25
        return r
    l, w = tray[0] / 2 * scale, tray[1] / 2 * scale
    h, s, t = WALL_HEIGHT * scale, WALL_SLOPE, 3.0

    def slab(name, pts, friction):
        v = np.array(pts, float)
        ob = studio.mesh_object(name, v, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], smooth=False)
        body(ob, "PASSIVE", friction)
    slab("floor", [[x, y, z] for x in (-3 * l, 3 * l) for y in (-3 * w, 3 * w) for z in (-3.0, 0.0)], 0.6)
    tall = 30.0
    for sgn in (-1, 1):
        e = s * h
        slab("x wall", [[sgn * q, y, z] for q, z in ((l, 0), (l + e, h), (l + t, 0), (l + t, h)) for y in (-4 * w, 4 * w)], 0.35)
        slab("y wall", [[x, sgn * q, z] for q, z in ((w, 0), (w + e, h), (w + t, 0), (w + t, h)) for x in (-4 * l, 4 * l)], 0.35)
        slab("x guard", [[sgn * q, y, z] for q, z in ((l + e + 0.3, h), (l + e + 0.3, tall), (l + t, h), (l + t, tall)) for y in (-4 * w, 4 * w)], 0.0)
        slab("y guard", [[x, sgn * q, z] for q, z in ((w + e + 0.3, h), (w + e + 0.3, tall), (w + t, h), (w + t, tall)) for x in (-4 * l, 4 * l)], 0.0)
    obs = []
    z = 0.4
    for k, parts in enumerate(bottles):
        pts = bottle.hull_points(parts, 120) * scale
        c = np.concatenate([p.verts for p in parts]).mean(0) * scale
        ob = bpy.data.objects.new(f"bottle{k}", bpy.data.meshes.new("hull"))
        ob.data.from_pydata((pts - c).tolist(), [], [])
        sc.collection.objects.link(ob)
        rots = bottle.rest_rotations(parts, tries=24)
        r = rots[int(rng.integers(0, min(3, len(rots))))]
        yaw, tip, axis = rng.uniform(0, 2 * math.pi), rng.normal(0, 0.22), rng.uniform(0, 2 * math.pi)
        q = mathutils.Quaternion((math.cos(axis), math.sin(axis), 0), tip) @ mathutils.Quaternion((0, 0, 1), yaw)
        rot = np.array(q.to_matrix()) @ r
        turned = (pts - c) @ rot.T
        lo, hi = turned.min(0), turned.max(0)
        room = np.maximum(np.array([l, w]) - (hi - lo)[:2] / 2 + 0.1, 0.05)
        xy = rng.uniform(-1, 1, 2) * room - (hi + lo)[:2] / 2
        z += -lo[2] + 0.15
        m = np.eye(4)
        m[:3, :3] = rot
        m[:3, 3] = [xy[0], xy[1], z]
        z += hi[2]
        ob.matrix_world = mathutils.Matrix(m.tolist())
        r_ = body(ob, "ACTIVE", 0.45)
        r_.mass = 0.03
        obs.append((ob, c))
    for f in range(1, frames + 1):
        sc.frame_set(f)
    dg = bpy.context.evaluated_depsgraph_get()
    poses = []
    for ob, c in obs:
        m = np.array(ob.evaluated_get(dg).matrix_world, float)
        u, _, vt = np.linalg.svd(m[:3, :3])
        p = np.eye(4)
        p[:3, :3] = u @ vt
        p[:3, 3] = (m[:3, 3] - p[:3, :3] @ c) / scale
        poses.append(p)
    return poses


def settled(poses, bottles, tray):
    """Indices of the bottles that ended inside the tray."""
    keep = []
    for k, (m, parts) in enumerate(zip(poses, bottles)):
        v = np.concatenate([p.verts for p in parts]) @ m[:3, :3].T + m[:3, 3]
        c = v.mean(0)
        if v[:, 2].min() > -0.02 and abs(c[0]) < tray[0] / 2 and abs(c[1]) < tray[1] / 2 and v[:, 2].min() < 0.4:
            keep.append(k)
    return keep


def scenery_triangles(skip):
    """World triangles of everything that is not a bottle."""
    dg = bpy.context.evaluated_depsgraph_get()
    vs, ts, base = [], [], 0
    for ob in bpy.context.scene.objects:
        if ob.type != "MESH" or ob in skip:
            continue
        ev = ob.evaluated_get(dg)
        me = ev.to_mesh()
        me.calc_loop_triangles()
        v = np.empty(len(me.vertices) * 3, np.float32)
        me.vertices.foreach_get("co", v)
        t = np.empty(len(me.loop_triangles) * 3, np.int32)
        me.loop_triangles.foreach_get("vertices", t)
        m = np.array(ob.matrix_world)
        vs.append(v.reshape(-1, 3) @ m[:3, :3].T + m[:3, 3])
        ts.append(t.reshape(-1, 3) + base)
        base += len(vs[-1])
        ev.to_mesh_clear()
    return np.concatenate(vs), np.concatenate(ts)


def detection_truth(world, cam, w, h, scenery, threshold):
    """Id mask and per-bottle records. world: list of (verts, tris) in world space."""
    back = raster.depth_map(scenery[0], scenery[1], cam, w, h)
    depths = [raster.depth_map(v, t, cam, w, h) for v, t in world]
    stack = np.stack(depths + [back])
    first = stack.argmin(0)
    ids = np.where((first < len(world)) & np.isfinite(stack.min(0)), first + 1, 0).astype(np.uint8)
    recs = []
    for k, d in enumerate(depths):
        am = np.isfinite(d)
        vis = ids == k + 1
        uv, _ = raster.project(world[k][0], cam)
        lo, hi = uv.min(0), uv.max(0)
        box = [float(np.clip(lo[0], 0, w)), float(np.clip(lo[1], 0, h)), float(np.clip(hi[0], 0, w)), float(np.clip(hi[1], 0, h))]
        n_am, n_vis = int(am.sum()), int(vis.sum())
        above = []
        for j, e in enumerate(depths):
            if j != k:
                n = int((am & (e < d)).sum())
                if n > 0:
                    above.append(dict(id=j + 1, px=n))
        vb = None
        if n_vis:
            ys, xs = np.nonzero(vis)
            vb = [int(xs.min()), int(ys.min()), int(xs.max()) + 1, int(ys.max()) + 1]
        frac = n_vis / n_am if n_am else 0.0
        free = frac >= threshold
        recs.append(dict(id=k + 1, amodal_box_px=[round(q, 2) for q in box], visible_box_px=vb, amodal_px=n_am, visible_px=n_vis,
                         visible_fraction=round(frac, 4), truncated=bool((lo < 0).any() or hi[0] > w or hi[1] > h),
                         covered_by=above, topmost=sum(a["px"] for a in above) <= (1 - threshold) * max(n_am, 1),
                         unobstructed=bool(free)))
    return ids, recs


def rig_cameras(args):
    """The four fixed camera positions of a room."""
    rng = bottle.seeded("rig", args.room_seed)
    first = rng.uniform(0, 2 * math.pi)
    return [("fronto", None), ("above", first), ("above", first + 2.2), ("tilted", first + 4.3)]


def run_piles(args):
    dirs = {k: os.path.join(args.out, "piles", k) for k in ("images", "labels", "masks", "truth")}
    for d in dirs.values():
        os.makedirs(d, exist_ok=True)
    lights = ("bright", "dim", "ambient")
    rig = rig_cameras(args)
    for i in range(args.first, args.first + args.count):
        costs = []
        began = time.process_time(), time.time()
        rng = bottle.seeded("pile", args.seed, args.room_seed, args.library_seed, i)
        n = int(rng.integers(args.bottles[0], args.bottles[1] + 1))
        picks = rng.choice(args.library_count, size=n, replace=False)
        descs = [bottle.describe(args.library_seed, int(k)) for k in picks]
        solid = args.wall == "solid"
        shapes = [bottle.shape(d, args.cache) for d in descs]
        # Simulation and truth always use the outer surface, so the wall model changes neither.
        parts = [bottle.build(d, s, solid=False, detail=0) for d, s in zip(descs, shapes)]
        poses = drop(parts, args.tray, rng)
        keep = settled(poses, parts, args.tray)
        descs, shapes, parts, poses = ([q[k] for k in keep] for q in (descs, shapes, parts, poses))
        sc = studio.new_scene(args.threads, args.spp, not args.no_denoise)
        sc.cycles.use_adaptive_sampling = False
        sc.render.use_persistent_data = True
        build_room(args.room_seed, args.tray)
        bpy.context.view_layer.update()
        scenery = scenery_triangles(set())
        groups = []
        for d, s, p, m in zip(descs, shapes, parts, poses):
            if solid:
                p = bottle.build(d, s, solid=True, detail=0)
            groups.append(studio.add_bottle(d, p, solid, bottle.seeded("label", d["library_seed"], d["index"]), m))
        world = []
        for p, m in zip(parts, poses):
            vs = np.concatenate([q.verts for q in p]) @ m[:3, :3].T + m[:3, 3]
            base, ts = 0, []
            for q in p:
                ts.append(q.triangles() + base)
                base += len(q.verts)
            world.append((vs, np.concatenate(ts)))
        setup = time.process_time() - began[0], time.time() - began[1]
        if args.mode == "test":
            shots = [(li, v, None) for li in lights for v in range(4)]
        elif args.mode == "cycle":
            k = i
            shots = [(lights[k % 3], k % 4, None)]
        else:
            shots = [("bright", 0, s) for s in range(min(args.steps, len(descs)))]
        present = list(range(len(descs)))
        lamps, last = [], None
        for li, v, step in shots:
            t0 = time.process_time(), time.time()
            if step:                        # take the topmost bottle away
                top = max(present, key=lambda k: world[k][0][:, 2].max())
                present.remove(top)
                for ob in groups[top]:
                    ob.hide_render = True
            view, az = rig[v]
            crng = bottle.seeded("rig camera", args.room_seed, v)
            cam, where = tray_camera(crng, view, args, azimuth=az)
            if sc.camera:
                bpy.data.objects.remove(sc.camera)
            studio.set_camera(sc, cam)
            if li != last:
                for ob in lamps:
                    bpy.data.objects.remove(ob)
                lamps = light_room(sc, bottle.seeded("pile light", args.seed, args.room_seed, i if args.mode != "real" else 0, li), li)
                last = li
            srng = bottle.seeded("pile shot", args.seed, i, li, v, step or 0)
            lin = studio.render(sc, args.width, args.height, seed=int(srng.integers(1, 1 << 30)))
            img, sensor = expose(lin, srng, li, args)
            ids, recs = detection_truth([world[k] for k in present], cam, args.width, args.height, scenery, args.visible)
            for r, k in zip(recs, present):
                d = descs[k]
                r.update(instance=d["index"], class_id=d["class_id"], class_name=d["class_name"], colour=d["colour"],
                         pose=[[round(float(q), 6) for q in row] for row in poses[k]])
            name = f"p{i:05d}_{li}_v{v}" + (f"_s{step:02d}" if step is not None else "")
            save_picture(os.path.join(dirs["images"], f"{name}.{args.format}"), img, args.format)
            pixels.write_png(os.path.join(dirs["masks"], name + ".png"), ids)
            with open(os.path.join(dirs["labels"], name + ".txt"), "w") as f:
                for r in recs:
                    if r["unobstructed"]:
                        x0, y0, x1, y1 = r["amodal_box_px"]
                        f.write(f"{r['class_id']} {(x0 + x1) / 2 / args.width:.6f} {(y0 + y1) / 2 / args.height:.6f} "
                                f"{(x1 - x0) / args.width:.6f} {(y1 - y0) / args.height:.6f}\n")
            rec = dict(name=name, image=f"images/{name}.{args.format}", mask=f"masks/{name}.png", label=f"labels/{name}.txt",
                       light=li, camera_position=v, **where, room_seed=args.room_seed, library_seed=args.library_seed,
                       tray=tray_truth(args, cam), camera=studio.camera_json(cam), sensor=sensor,
                       visible_threshold=args.visible, wall=args.wall, spp=args.spp, bottles=recs)
            pixels.write_json(os.path.join(dirs["truth"], name + ".json"), rec)
            costs.append(dict(cpu_s=round(time.process_time() - t0[0], 1), wall_s=round(time.time() - t0[1], 1)))
            print(f"{name}: {len(recs)} bottles, {sum(r['unobstructed'] for r in recs)} unobstructed, "
                  f"{costs[-1]['cpu_s']} CPU s, {costs[-1]['wall_s']} s", flush=True)
        photos.log_cost(args, "pile set-up", [dict(cpu_s=round(setup[0], 1), wall_s=round(setup[1], 1), bottles=len(descs))])
        photos.log_cost(args, "piles", costs)
