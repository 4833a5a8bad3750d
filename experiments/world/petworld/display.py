"""A bottle on a luminous display, in a room: what it shows of every picture that the display can show.

Light adds up. One rendering follows every path once and keeps apart what comes from the room and what comes from each
picture on the display (Cycles' light groups): the display is a stack of sheets, each a picture that shines and lets the
others' light pass, on glass that reflects a few per cent. A photo is the room's part plus one picture's.
"""

import json
import math
import os
import time

import bpy
import cv2
import numpy as np

from . import bottle, exr, photos, pixels, raster, studio

SIZE_PX = (1280, 800)                       # of the display's pictures
PITCH = 0.001                               # metres between its pixels: 1.28 x 0.80 m
VIEW_PX = (400, 200)                        # of a photo of the whole place, a pixel for a millimetre
SHEET_GAP = 5e-6                            # metres between two sheets: 0.1 mm for all
GLASS_IOR = 1.5                             # reflects 4 % straight on
WHITE_LIGHT = 2.0                           # of the display, in the light of white paper in the room
WHITE_LEVEL = 0.8                           # of the white display in a photo
FINE, COARSE = 16, 160                      # periods of stripes, pixels of the display
BACKGROUNDS = ("checker", "text", "noise", "bottle", "plain")
PLACES = ("soft", "window")                 # their lights
STRIPED = ("soft",)                         # places whose stripes are kept
PAINTS = ("green", "blue")
CAMERA_HEIGHT = 1.0                         # metres over the display
MARGIN = 16                                 # pixels around a bottle
PAINT_MARGIN = 64                           # more of a painted screen, on every side


# ---------------------------------------------------------------- pictures

def encode(light):
    """What 8 bits of a display can show of some light."""
    code = pixels.to_u8(pixels.srgb_encode(light)).astype(float) / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def stripes(axis, period, shift):
    """Four shifts by a quarter of a period of light that swings along x (0) or y (1)."""
    at = np.arange(SIZE_PX[axis]) + 0.5
    light = 0.5 + 0.5 * np.cos(2 * math.pi * at / period + 0.5 * math.pi * shift)
    light = light[None, :] if axis == 0 else light[:, None]
    return np.broadcast_to(light[..., None], (SIZE_PX[1], SIZE_PX[0], 3))


def checker():
    y, x = np.mgrid[0:SIZE_PX[1], 0:SIZE_PX[0]]
    odd = ((x // 20 + y // 20) % 2).astype(bool)[..., None]
    return np.where(odd, (0.75, 0.72, 0.66), (0.05, 0.06, 0.08))


def text(rng):
    words = "refraction glass paper bottle screen light water shadow plate camera measure 0 1 2 3 5 8 13 21".split()
    page = np.full((SIZE_PX[1], SIZE_PX[0], 3), 235, np.uint8)
    for k, y in enumerate(range(14, SIZE_PX[1], 15)):
        line = " ".join(rng.choice(words, 40))
        colour = ((20, 20, 24), (150, 30, 30), (20, 60, 150))[k % 3]
        cv2.putText(page, line, (int(rng.integers(0, 20)), y), cv2.FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv2.LINE_AA)
    return (page / 255.0) ** 2.2


def noise(rng):
    total = np.zeros((SIZE_PX[1], SIZE_PX[0], 3))
    for scale in (6, 14, 40, 120):
        small = rng.standard_normal((SIZE_PX[1] // scale + 2, SIZE_PX[0] // scale + 2, 3))
        total += cv2.resize(small, SIZE_PX, interpolation=cv2.INTER_CUBIC)
    return np.clip(0.32 + 0.13 * total, 0.01, 0.95)


def tiled(photo):
    """A photo of the view, repeated over the display around its middle."""
    h, w = photo.shape[:2]
    y = (np.arange(SIZE_PX[1]) - SIZE_PX[1] // 2 + h // 2) % h
    x = (np.arange(SIZE_PX[0]) - SIZE_PX[0] // 2 + w // 2) % w
    return photo[y][:, x]


def pictures(photo):
    """Everything that the display shows, by name, scene-linear; black shows nothing."""
    rng = bottle.seeded("display pictures")
    shown = {"white": np.ones((SIZE_PX[1], SIZE_PX[0], 3))}
    for period, kind in ((COARSE, "coarse"), (FINE, "fine")):
        for axis in (0, 1):
            for shift in range(4):
                shown[f"stripes_{'xy'[axis]}_{kind}_{shift + 1}"] = stripes(axis, period, shift)
    shown["checker"], shown["text"], shown["noise"] = checker(), text(rng), noise(rng)
    shown["bottle"] = tiled(photo)
    shown["plain"] = np.broadcast_to((0.42, 0.38, 0.31), shown["white"].shape)
    return {name: encode(light) for name, light in shown.items()}


# ------------------------------------------------------------------- scene

def sheet(k, name, light):
    """A picture that shines upwards and lets all other light pass."""
    n = studio.Nodes(name)
    tex = n.add("TexImage")
    tex.image = studio.image_from_array(name, light, srgb=False)
    tex.extension = "CLIP"
    geo = n.add("NewGeometry")
    em = n.add("Emission")
    n.link(tex.outputs["Color"], em.inputs["Color"])
    n.put(em.inputs["Strength"], n.math("SUBTRACT", 1.0, geo.outputs["Backfacing"]))
    add = n.add("AddShader")
    n.link(em.outputs[0], add.inputs[0])
    n.link(n.bsdf("Transparent"), add.inputs[1])
    mat = n.done(add.outputs[0])
    mat.cycles.emission_sampling = "NONE"
    w, h = SIZE_PX[0] * PITCH / 2, SIZE_PX[1] * PITCH / 2
    v = np.array([[-w, -h, 0], [w, -h, 0], [w, h, 0], [-w, h, 0]]) - (0, 0, (k + 1) * SHEET_GAP)
    ob = studio.mesh_object(name, v, [[0, 1, 2, 3]], uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=mat, smooth=False)
    ob.visible_shadow = False
    ob.lightgroup = name
    return ob


def glass(count):
    n = studio.Nodes("glass")
    fres = n.add("Fresnel")
    n.put(fres.inputs["IOR"], GLASS_IOR)
    mat = n.done(n.mix_shader(fres.outputs[0], n.bsdf("Diffuse", Color=(0.004, 0.004, 0.004)),
                              n.bsdf("Glossy", Color=(1, 1, 1), Roughness=0.04)))
    v = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 1.5 - (0, 0, (count + 2) * SHEET_GAP)
    return studio.mesh_object("glass", v, [[0, 1, 2, 3]], material=mat, smooth=False)


class Place:
    """A room with a display in it and a camera over it."""

    def __init__(self, index, threads, samples):
        rng = bottle.seeded("display place", index)
        self.samples = samples
        self.sc = sc = studio.new_scene(threads, samples, False)
        sc.cycles.use_adaptive_sampling = False
        sc.cycles.transparent_max_bounces = 400
        sc.cycles.transmission_bounces = sc.cycles.max_bounces = 12
        sc.render.use_persistent_data = True
        bpy.context.view_layer.lightgroups.add(name="room")
        for lamp in photos.light_rig(sc, rng, PLACES[index], 0.0):
            lamp.lightgroup = "room"
        sc.world.lightgroup = "room"
        self.sheets, self.names = [], []
        self.glass = glass(64)
        self.paper = photos.Screen()
        at = (rng.normal(0, 0.006), rng.normal(0, 0.006), CAMERA_HEIGHT)
        self.camera = studio.look_at_camera(*VIEW_PX, CAMERA_HEIGHT / PITCH, at, (0, 0, 0))
        wide = studio.look_at_camera(*around(VIEW_PX, PAINT_MARGIN), CAMERA_HEIGHT / PITCH, at, (0, 0, 0))
        self.cameras = {margin: studio.set_camera(sc, one) for margin, one in ((PAINT_MARGIN, wide), (0, self.camera))}

    def add_pictures(self, shown):
        self.names = list(shown)
        for k, (name, light) in enumerate(shown.items()):
            bpy.context.view_layer.lightgroups.add(name=name)
            self.sheets.append(sheet(k, name, light))

    def seen(self, crop, seed):
        """What each picture on the display adds to a photo of a part of the view."""
        self.floor(sheets=True, glass=True, paper=False)
        light = render_passes(self.sc, crop, self.samples, seed, denoise=False)
        return {name: light[f"Combined_{name}"] for name in self.names}

    def dark(self, crop, seed):
        """A photo's light with the display switched off."""
        self.floor(sheets=False, glass=True, paper=False)
        return render_passes(self.sc, crop, self.samples, seed, denoise=True)["Combined"]

    def painted(self, albedo, crop, seed, margin=0):
        """A photo's light with a painted screen instead of the display, and of some pixels more on every side."""
        self.floor(sheets=False, glass=False, paper=True)
        self.paper.paint(albedo)
        self.sc.camera = self.cameras[margin]
        wide = (*crop[:2], *around(crop[2:], margin))
        light = render_passes(self.sc, wide, self.samples, seed, denoise=True, view=around(VIEW_PX, margin))
        self.sc.camera = self.cameras[0]
        return light["Combined"]

    def floor(self, sheets, glass, paper):
        for ob in self.sheets:
            ob.hide_render = not sheets
        self.glass.hide_render = not glass
        self.paper.ob.hide_render = not paper


def around(size, margin):
    """With a margin on both sides."""
    return tuple(side + 2 * margin for side in size)


def homography(camera):
    """Display pixels from photo pixels."""
    k, r, t = camera["K"], camera["R"], camera["t"]
    photo_from_plane = k @ np.stack([r[:, 0], r[:, 1], t], 1)
    display_from_plane = np.array([[1 / PITCH, 0, SIZE_PX[0] / 2], [0, -1 / PITCH, SIZE_PX[1] / 2], [0, 0, 1]])
    m = display_from_plane @ np.linalg.inv(photo_from_plane)
    return m / m[2, 2]


def render_passes(sc, crop, samples, seed, denoise, view=VIEW_PX):
    """Renders columns x0 to x1 and rows y0 to y1 of the view; returns the light of its passes by their names."""
    r = sc.render
    sc.cycles.samples, sc.cycles.seed, sc.cycles.use_denoising = samples, seed, denoise
    r.resolution_x, r.resolution_y = w, h = view
    r.resolution_percentage = 100
    r.use_border = r.use_crop_to_border = True
    x0, y0, x1, y1 = crop
    r.border_min_x, r.border_max_x = x0 / w, x1 / w
    r.border_min_y, r.border_max_y = 1 - y1 / h, 1 - y0 / h
    st = r.image_settings
    st.file_format, st.color_mode, st.color_depth, st.exr_codec = "OPEN_EXR_MULTILAYER", "RGB", "32", "NONE"
    r.filepath = path = os.path.join(bpy.app.tempdir, "passes.exr")
    studio.quiet(bpy.ops.render.render, write_still=True)
    channels = exr.read(path)
    os.remove(path)
    found = {}
    for name in {c.split(".")[1] for c in channels if c.count(".") == 2}:
        planes = [next((v for c, v in channels.items() if c.endswith(f".{name}.{k}")), None) for k in "RGB"]
        if all(p is not None for p in planes):
            found[name] = np.stack(planes, -1)
    return found


# ---------------------------------------------------------------- a set

WHOLE = (0, 0, *VIEW_PX)
WHITE_PAPER = 0.8                           # albedo


def run(args):
    """Renders what is not there yet, then writes the pictures."""
    cache = os.path.join(args.out, "light")
    os.makedirs(cache, exist_ok=True)
    for index in range(len(PLACES)):
        render_place(args, index, cache)
    for index in range(len(PLACES)):
        write_place(args, index, cache)


def render_place(args, index, cache):
    bottles = [i for i in range(args.first, args.first + args.count) if i % len(PLACES) == index]
    todo = [i for i in bottles if not os.path.exists(light_file(cache, f"b{i:04d}"))]
    empty = light_file(cache, f"place{index}")
    if not todo and os.path.exists(empty):
        return
    place = Place(index, args.threads, args.spp)
    place.add_pictures(pictures(other_photo(args, cache, place)))
    if not os.path.exists(empty):
        save(empty, empty_light(place))
    for i in todo:
        began = time.process_time()
        save(light_file(cache, f"b{i:04d}"), bottle_light(args, place, i))
        print(f"bottle {i}: {time.process_time() - began:.0f} CPU s", flush=True)


def light_file(cache, name):
    return os.path.join(cache, f"{name}.npz")


def save(path, light):
    np.savez(path + ".part.npz", **light)
    os.replace(path + ".part.npz", path)


def other_photo(args, cache, place):
    """A photo of a bottle that is not in the set, on a painted screen, display values 0 to 1."""
    path = light_file(cache, "other")
    if not os.path.exists(path):
        obs, _, _ = lay_bottle(args, args.first + args.count)
        save(path, {"photo": place.painted(photos.SCREENS["blue"], WHOLE, 1)})
        remove(obs)
    with np.load(path) as z:
        light = z["photo"]
    return np.clip(light / np.percentile(light, 98) * 0.8, 0, 1)


def empty_light(place):
    light = {f"seen_{k}": v for k, v in place.seen(WHOLE, 2).items()}
    light["dark"] = place.dark(WHOLE, 3)
    light["paper"] = place.painted((WHITE_PAPER,) * 3, WHOLE, 4)
    return light


def bottle_light(args, place, i):
    obs, size, crop = lay_bottle(args, i, place.camera)
    light = {f"seen_{k}": v.astype(np.float16) for k, v in place.seen(crop, 10 * i + 5).items()}
    light["dark"] = place.dark(crop, 10 * i + 6)
    for k, paint in enumerate(PAINTS):
        light[paint] = place.painted(photos.SCREENS[paint], crop, 10 * i + 7 + k, PAINT_MARGIN)
    cover = obs.pop()
    remove(obs)
    return {**light, "cover": cover[crop[1]:crop[3], crop[0]:crop[2]], "crop": np.array(crop), "size": size}


def lay_bottle(args, i, camera=None):
    """Puts a bottle in the room; returns its objects (and its coverage of the view last), size and crop."""
    desc = bottle.describe(args.library_seed, i, {})
    parts = bottle.build(desc, bottle.shape(desc, args.cache), solid=True, detail=1)
    rng = bottle.seeded("display bottle", args.library_seed, i)
    matrix = photos.lay(parts, 0, rng.normal(0, math.radians(8)))
    obs = studio.add_bottle(desc, parts, True, bottle.seeded("label", desc["library_seed"], i), matrix)
    points = np.concatenate([p.verts @ matrix[:3, :3].T + matrix[:3, 3] for p in parts])
    if camera is None:
        return obs, None, None
    w, h = VIEW_PX
    cover = raster.coverage(points, raster.triangles_of(parts), camera, w, h)
    uv, _ = raster.project(points, camera)
    (x0, y0), (x1, y1) = np.floor(uv.min(0)).astype(int) - MARGIN, np.ceil(uv.max(0)).astype(int) + MARGIN
    crop = (max(x0, 0), max(y0, 0), min(x1, w), min(y1, h))
    return [*obs, cover], np.ptp(points, axis=0), crop


def remove(obs):
    for ob in obs:
        bpy.data.objects.remove(ob, do_unlink=True)


# ----------------------------------------------------------- photographs

SENSOR = dict(shot=0.006, read=0.002, blur=0.35, vignette=0.0)
PAINT_LEVEL = 0.4                           # of the brightest channel of a painted screen
CAPTURE_QUALITY = 92                        # JPEG, as phones write it
STRIPES = [f"stripes_{axis}_{kind}_{k}" for kind in ("coarse", "fine") for axis in "xy" for k in (1, 2, 3, 4)]


class Developer:
    """Turns light into photos of one exposure."""

    def __init__(self, place):
        """From the light of a place without a bottle."""
        paper = float(np.median(place["paper"]))
        white = float(np.median(place["seen_white"]))
        self.display = WHITE_LIGHT * paper / white           # of the display, in the units of the room's light
        dark = float(np.median(place["dark"]))
        self.gain = WHITE_LEVEL / (dark + self.display * white)
        self.paint_gain = {p: PAINT_LEVEL * WHITE_PAPER / (paper * max(photos.SCREENS[p])) for p in PAINTS}

    def shown(self, light, name):
        """A photo's light while the display shows a picture; none where it is off."""
        own = self.display * light[f"seen_{name}"].astype(float) if name else 0.0
        return self.gain * (light["dark"] + own)

    def photo(self, linear, rng):
        seen = studio.develop(np.asarray(linear, float), rng, **SENSOR)
        return pixels.to_u8(pixels.srgb_encode(seen))


def write_place(args, index, cache):
    place = load(light_file(cache, f"place{index}"))
    developer = Developer(place)
    name = f"{PLACES[index]}"
    folder = os.path.join(args.out, name)
    os.makedirs(folder, exist_ok=True)
    rng = bottle.seeded("display empty", index)
    for frame in ("black", "white"):
        light = developer.shown(place, None if frame == "black" else frame)
        write_jpeg(os.path.join(folder, f"empty_{frame}.jpg"), developer.photo(light, rng))
    for k in BACKGROUNDS:
        write_truth(os.path.join(folder, f"empty_{k}.png"), developer.shown(place, k))
    bottles = [i for i in range(args.first, args.first + args.count) if i % len(PLACES) == index]
    camera = Place(index, args.threads, args.spp).camera
    display_from_photo = homography(camera)
    records = [write_bottle(developer, display_from_photo, args, folder, cache, i) for i in bottles]
    pixels.write_json(os.path.join(folder, "place.json"), dict(
        light=name, view_px=list(VIEW_PX), display_px=list(SIZE_PX), display_m=[s * PITCH for s in SIZE_PX],
        display_from_photo=[[float(v) for v in row] for row in display_from_photo],
        paint_margin_px=PAINT_MARGIN, camera=studio.camera_json(camera), gain={"display": developer.gain, **developer.paint_gain},
        sensor=SENSOR, spp=args.spp, bottles=records))


def write_bottle(developer, display_from_photo, args, folder, cache, i):
    light = load(light_file(cache, f"b{i:04d}"))
    name = f"b{i:02d}"
    write_painted(developer, folder, name, light, bottle.seeded("painted photos", i))
    rng = bottle.seeded("display photos", i)
    with_stripes = os.path.basename(folder) in STRIPED
    for frame in ("black", "white", *(STRIPES if with_stripes else ())):
        shown = developer.shown(light, None if frame == "black" else frame)
        write_jpeg(path_of(folder, name, frame), developer.photo(shown, rng))
    near = cv2.dilate((light["cover"] > 0).astype(np.uint8), np.ones((7, 7)))[..., None]
    for k in BACKGROUNDS:
        write_truth(os.path.join(folder, f"{name}_over_{k}.png"), near * developer.shown(light, k))
    if with_stripes:
        flow = near * displacement(light, display_from_photo)
        write_small_png(os.path.join(folder, f"{name}_flow.png"), flow.astype(np.uint8))
    pixels.write_png(os.path.join(folder, f"{name}_mask.png"), pixels.to_u8(light["cover"]))
    desc = bottle.describe(args.library_seed, i, {})
    return dict(name=name, crop_px=[int(v) for v in light["crop"]], thickness=round(float(light["size"][2]), 5),
                with_stripes=with_stripes, colour=desc["colour"], litres=desc["litres"], class_name=desc["class_name"])


def write_painted(developer, folder, name, light, rng):
    for paint in PAINTS:
        write_jpeg(path_of(folder, name, paint), developer.photo(developer.paint_gain[paint] * light[paint], rng))


def write_truth(path, light):
    """Through the same lens as the photos, without a sensor's noise, on 8 bits."""
    seen = studio.develop(np.asarray(light, float), np.random.default_rng(0), **{**SENSOR, "shot": 0.0, "read": 0.0})
    write_small_png(path, pixels.to_u8(pixels.srgb_encode(seen)))


def write_small_png(path, codes):
    cv2.imwrite(path, codes[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, 1])


def displacement(light, display_from_photo):
    """How far on the display each pixel's line of sight is displaced, by the coarse stripes without noise.

    Red and green are to the right and down, 128 is none and 4 codes are a display pixel; blue is the stripes' contrast,
    255 is that of the display alone.
    """
    white = float(np.median(light["seen_white"][:4, :4].astype(float)))
    x0, y0, x1, y1 = light["crop"]
    y, x = np.mgrid[y0:y1, x0:x1] + 0.5
    straight = np.einsum("ij,jyx->iyx", display_from_photo, np.stack([x, y, np.ones_like(x)]))
    straight = straight[:2] / straight[2]
    ends = [axis_ends(light, axis, straight[axis], white) for axis in (0, 1)]
    moved = [128 + 4 * (ends[axis][0] - straight[axis]) for axis in (0, 1)]
    contrast = 255 * np.minimum(ends[0][1], ends[1][1])
    return np.clip(np.round(np.stack([*moved, contrast], -1)), 0, 255)


def axis_ends(light, axis, straight, white):
    """Where lines of sight end along an axis, and the contrast of the stripes."""
    a, b, c, d = (light[f"seen_stripes_{'xy'[axis]}_coarse_{k}"].astype(float).mean(-1) for k in (1, 2, 3, 4))
    phase = np.arctan2(d - b, a - c) / (2 * math.pi)
    ends = COARSE * (phase + np.round(straight / COARSE - phase))
    return ends, np.clip(np.hypot(d - b, a - c) / white, 0, 1)


def path_of(folder, bottle_name, frame):
    return os.path.join(folder, f"{bottle_name}_{frame}.jpg")


def write_jpeg(path, codes, quality=CAPTURE_QUALITY):
    cv2.imwrite(path, codes[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])


def load(path):
    with np.load(path) as z:
        return {k: z[k] for k in z.files}
