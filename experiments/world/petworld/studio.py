"""Blender side: scene, camera, lights, materials, rendering to NumPy.

Uses only the parts of bpy that are the same in Blender 3.4 and 4.5.
"""

import math
import os
import tempfile

import bpy
import numpy as np

IOR = 1.57          # PET


def new_scene(threads, samples, denoise=True):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sc = bpy.context.scene
    sc.render.engine = "CYCLES"
    sc.cycles.device = "CPU"
    sc.render.threads_mode = "FIXED"
    sc.render.threads = threads
    sc.cycles.samples = samples
    sc.cycles.seed = 1
    sc.cycles.use_adaptive_sampling = True
    sc.cycles.adaptive_threshold = 0.01
    sc.cycles.adaptive_min_samples = min(samples, 16)
    c = sc.cycles
    c.max_bounces, c.diffuse_bounces, c.glossy_bounces, c.transmission_bounces = 18, 2, 5, 16
    if hasattr(c, "use_light_tree"):
        c.use_light_tree = False             # few lamps: plain light sampling is faster
    c.transparent_max_bounces = 64
    c.volume_bounces = 0
    c.caustics_reflective = False
    c.caustics_refractive = True
    c.sample_clamp_indirect = 6.0
    c.blur_glossy = 0.0
    sc.render.use_persistent_data = False
    sc.render.film_transparent = False
    sc.view_settings.view_transform = "Standard"
    c.use_denoising = bool(denoise and has_denoiser())
    if c.use_denoising:
        c.denoiser = "OPENIMAGEDENOISE"
        c.denoising_prefilter = "ACCURATE"
    return sc


_DENOISER = None


def has_denoiser():
    """Whether this build can denoise (Debian's Blender 3.4 cannot)."""
    global _DENOISER
    if _DENOISER is None:
        try:
            bpy.context.scene.cycles.denoiser = "OPENIMAGEDENOISE"
            _DENOISER = True
        except TypeError:
            _DENOISER = False
    return _DENOISER


def quiet(fn, *a, **k):
    """Run fn with the renderer's progress lines sent to nowhere."""
    import sys
    sys.stdout.flush()
    saved = os.dup(1)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        return fn(*a, **k)
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)
        os.close(null)


def render(sc, width, height, samples=None, denoise=None, seed=None):
    """Render the scene and return linear RGB (height, width, 3), row 0 on top."""
    sc.render.resolution_x, sc.render.resolution_y = width, height
    sc.render.resolution_percentage = 100
    if samples is not None:
        sc.cycles.samples = samples
    if seed is not None:
        sc.cycles.seed = seed
    if denoise is not None:
        sc.cycles.use_denoising = bool(denoise and has_denoiser())
    st = sc.render.image_settings
    st.file_format = "OPEN_EXR"
    st.color_mode = "RGB"
    st.color_depth = "32"
    st.exr_codec = "NONE"
    with tempfile.TemporaryDirectory() as d:
        path = os.path.join(d, "r.exr")
        sc.render.filepath = path
        quiet(bpy.ops.render.render, write_still=True)
        img = bpy.data.images.load(path)
        try:
            img.colorspace_settings.name = "Non-Color"
            buf = np.empty(width * height * img.channels, np.float32)
            img.pixels.foreach_get(buf)
            buf = buf.reshape(height, width, img.channels)[::-1, :, :3].copy()
        finally:
            bpy.data.images.remove(img)
    return buf


# ----------------------------------------------------------------- objects

def mesh_object(name, verts, faces, tris=None, uv=None, attrs=None, material=None, smooth=True):
    """A mesh object from arrays; faces (n, 4) and tris (m, 3)."""
    faces = np.zeros((0, 4), np.int64) if faces is None else np.asarray(faces)
    tris = np.zeros((0, 3), np.int64) if tris is None else np.asarray(tris)
    me = bpy.data.meshes.new(name)
    me.vertices.add(len(verts))
    me.vertices.foreach_set("co", np.asarray(verts, np.float32).reshape(-1))
    loops = np.concatenate([faces.reshape(-1), tris.reshape(-1)]).astype(np.int32)
    me.loops.add(len(loops))
    me.loops.foreach_set("vertex_index", loops)
    n4, n3 = len(faces), len(tris)
    start = np.concatenate([np.arange(n4) * 4, n4 * 4 + np.arange(n3) * 3]).astype(np.int32)
    me.polygons.add(n4 + n3)
    me.polygons.foreach_set("loop_start", start)
    try:
        me.polygons.foreach_set("loop_total", np.concatenate([np.full(n4, 4), np.full(n3, 3)]).astype(np.int32))
    except (AttributeError, RuntimeError, TypeError):
        pass                              # derived from loop_start in newer versions
    me.polygons.foreach_set("use_smooth", np.full(n4 + n3, smooth))
    if uv is not None:
        layer = me.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", np.asarray(uv, np.float32).reshape(-1))
    for key, val in (attrs or {}).items():
        at = me.attributes.new(key, "FLOAT", "POINT")
        at.data.foreach_set("value", np.asarray(val, np.float32))
    me.update(calc_edges=True)
    me.validate()
    ob = bpy.data.objects.new(name, me)
    bpy.context.scene.collection.objects.link(ob)
    if material is not None:
        me.materials.append(material)
    return ob


def box(name, size, centre, material, bevel=0.0):
    """An axis-aligned box; bevel rounds its edges [m]."""
    s = np.array(size, float) / 2
    v = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float) * s
    f = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    ob = mesh_object(name, v, f, material=material, smooth=False)
    ob.location = centre
    if bevel > 0:
        m = ob.modifiers.new("bevel", "BEVEL")
        m.width, m.segments = bevel, 3
    return ob


def tube(name, a, b, radius, material, cols=32, radius_b=None):
    """A capped cylinder or cone frustum from point a to point b."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    rb = radius if radius_b is None else radius_b
    d = b - a
    ln = np.linalg.norm(d)
    d /= ln
    u = np.cross(d, [0, 0, 1.0] if abs(d[2]) < 0.9 else [1.0, 0, 0])
    u /= np.linalg.norm(u)
    w = np.cross(d, u)
    t = np.arange(cols) * 2 * math.pi / cols
    ring = np.cos(t)[:, None] * u + np.sin(t)[:, None] * w
    e = min(0.08 * ln, 0.12 * radius)
    rows = [a + ring * (radius - e), a + d * e + ring * radius, b - d * e + ring * rb, b + ring * (rb - min(e, 0.5 * rb))]
    v = np.concatenate(rows + [a[None], b[None]])
    idx = np.arange(4 * cols).reshape(4, cols)
    n = np.roll(idx, -1, 1)
    f = np.stack([idx[:-1], n[:-1], n[1:], idx[1:]], -1).reshape(-1, 4)
    tr = np.concatenate([np.stack([np.full(cols, 4 * cols), n[0], idx[0]], -1),
                         np.stack([np.full(cols, 4 * cols + 1), idx[3], n[3]], -1)])
    return mesh_object(name, v, f, tris=tr, material=material)


def area_light(sc, name, power, size, location, target, colour=(1, 1, 1), size_y=None, visible=True):
    li = bpy.data.lights.new(name, "AREA")
    li.energy = power
    li.color = colour
    li.size = size
    if size_y:
        li.shape = "RECTANGLE"
        li.size_y = size_y
    ob = bpy.data.objects.new(name, li)
    sc.collection.objects.link(ob)
    aim(ob, location, target)
    ob.visible_camera = visible
    return ob


def aim(ob, location, target, up=(0.0, 1.0, 0.0)):
    """Point -z of an object at target."""
    import mathutils
    p, t = np.asarray(location, float), np.asarray(target, float)
    z = p - t
    z /= np.linalg.norm(z)
    up = np.asarray(up, float)
    if abs(z @ up) > 0.99:
        up = np.array([1.0, 0.0, 0.0])
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, y, z, p
    ob.matrix_world = mathutils.Matrix(m.tolist())


# ------------------------------------------------------------------ camera

def look_at_camera(width, height, focal_px, position, target, roll=0.0, up=(0.0, 1.0, 0.0)):
    """A pinhole camera in OpenCV axes: K, R, t with x right, y down, z forward."""
    p, t = np.asarray(position, float), np.asarray(target, float)
    z = t - p
    z /= np.linalg.norm(z)
    up = np.asarray(up, float)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    c, s = math.cos(roll), math.sin(roll)
    x, y = c * x + s * y, -s * x + c * y
    rot = np.stack([x, y, z])
    K = np.array([[focal_px, 0, width / 2], [0, focal_px, height / 2], [0, 0, 1.0]])
    return dict(K=K, R=rot, t=-rot @ p, width=width, height=height, position=p)


def set_camera(sc, cam, sensor=36.0):
    import mathutils
    data = bpy.data.cameras.new("camera")
    ob = bpy.data.objects.new("camera", data)
    sc.collection.objects.link(ob)
    w = cam["width"]
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = sensor
    data.lens = float(cam["K"][0, 0]) * sensor / w
    data.shift_x = -(float(cam["K"][0, 2]) - w / 2) / w
    data.shift_y = (float(cam["K"][1, 2]) - cam["height"] / 2) / w
    data.clip_start, data.clip_end = 0.01, 100.0
    m = np.eye(4)
    m[:3, :3] = cam["R"].T @ np.diag([1.0, -1.0, -1.0])
    m[:3, 3] = cam["position"]
    ob.matrix_world = mathutils.Matrix(m.tolist())
    sc.camera = ob
    return ob


def camera_json(cam):
    return dict(model="pinhole, x right, y down, z forward, pixel centres at +0.5",
                width=int(cam["width"]), height=int(cam["height"]),
                fx=float(cam["K"][0, 0]), fy=float(cam["K"][1, 1]), cx=float(cam["K"][0, 2]), cy=float(cam["K"][1, 2]),
                world_to_camera_R=[[round(float(v), 9) for v in r] for r in cam["R"]],
                world_to_camera_t=[round(float(v), 9) for v in cam["t"]],
                position=[round(float(v), 6) for v in cam["position"]])


# -------------------------------------------------------------- materials

class Nodes:
    """A small helper for building node trees."""

    def __init__(self, name):
        self.mat = bpy.data.materials.new(name)
        self.mat.use_nodes = True
        self.tree = self.mat.node_tree
        self.tree.nodes.clear()
        self.out = self.add("OutputMaterial")

    def add(self, kind, **props):
        n = self.tree.nodes.new("ShaderNode" + kind)
        for k, v in props.items():
            setattr(n, k, v)
        return n

    def link(self, a, b):
        self.tree.links.new(a, b)

    def put(self, socket, value):
        """Set a socket to a constant or link it to an output."""
        if isinstance(value, bpy.types.NodeSocket):
            self.link(value, socket)
        else:
            if hasattr(socket.default_value, "__len__") and len(socket.default_value) == 4 and len(value) == 3:
                value = tuple(value) + (1.0,)
            socket.default_value = value

    def math(self, op, a, b=0.0, clamp=False):
        n = self.add("Math", operation=op, use_clamp=clamp)
        self.put(n.inputs[0], a)
        self.put(n.inputs[1], b)
        return n.outputs[0]

    def bsdf(self, kind, **inputs):
        n = self.add("Bsdf" + kind)
        for k, v in inputs.items():
            self.put(n.inputs[k.replace("_", " ")], v)
        return n.outputs[0]

    def mix_shader(self, fac, a, b):
        n = self.add("MixShader")
        self.put(n.inputs[0], fac)
        self.link(a, n.inputs[1])
        self.link(b, n.inputs[2])
        return n.outputs[0]

    def mix_colour(self, fac, a, b, blend="MIX"):
        n = self.add("Mix", data_type="RGBA", blend_type=blend)
        self.put(n.inputs[0], fac)
        self.put(n.inputs[6], a)
        self.put(n.inputs[7], b)
        return n.outputs[2]

    def ramp(self, fac, stops):
        n = self.add("ValToRGB")
        e = n.color_ramp.elements
        while len(e) < len(stops):
            e.new(0.5)
        for el, (pos, col) in zip(e, stops):
            el.position, el.color = pos, tuple(col) + ((1.0,) if len(col) == 3 else ())
        self.put(n.inputs[0], fac)
        return n.outputs[0]

    def done(self, shader):
        self.link(shader, self.out.inputs[0])
        return self.mat


def pet_material(desc, solid, thickness=1.0):
    """Clear or tinted PET, as camera, mirror and refracted rays see it.

    solid: a refracting surface (two per wall); otherwise one thin-walled
    surface.  Shadow and diffuse rays do not see it: they meet the simple
    shade of shade_material, which keeps shadows soft and noise low.
    """
    n = Nodes("pet")
    geo = n.add("NewGeometry")
    strength = (0.5 if solid else 1.0) * thickness
    if min(desc["tint"]) > 0.93:
        tint = tuple(float(c) ** (1.15 * strength) for c in desc["tint"])
    else:                                    # longer way through a slanted wall
        dot = n.add("VectorMath", operation="DOT_PRODUCT")
        n.link(geo.outputs["Normal"], dot.inputs[0])
        n.link(geo.outputs["Incoming"], dot.inputs[1])
        cos_i = n.math("ABSOLUTE", dot.outputs["Value"])
        sin2 = n.math("SUBTRACT", 1.0, n.math("MULTIPLY", cos_i, cos_i))
        cos_t = n.math("SQRT", n.math("SUBTRACT", 1.0, n.math("DIVIDE", sin2, IOR * IOR)))
        path = n.math("DIVIDE", strength, cos_t)
        comb = n.add("CombineXYZ")
        for i in range(3):
            n.put(comb.inputs[i], n.math("POWER", float(desc["tint"][i]), path))
        tint = comb.outputs[0]
    if solid:                                # mirror-smooth: cheaper and crisper
        wall = n.bsdf("Glass", Color=tint, Roughness=0.0, IOR=IOR)
    else:
        # A thin wall is met at the outside angle from both sides, so the node's
        # own inversion for back faces is undone.
        fres = n.add("Fresnel")
        n.put(fres.inputs["IOR"], n.math("ADD", n.math("MULTIPLY", geo.outputs["Backfacing"], 1 / IOR - IOR), IOR))
        f = fres.outputs[0]
        ft = n.math("DIVIDE", n.math("MULTIPLY", f, 2.0), n.math("ADD", f, 1.0))
        wall = n.mix_shader(ft, n.bsdf("Transparent", Color=tint), n.bsdf("Glossy", Color=(1, 1, 1), Roughness=desc["roughness"]))
    crease = n.add("Attribute", attribute_name="wear")
    wear = n.math("MULTIPLY", crease.outputs["Fac"], desc["whitening"] * (0.35 if solid else 0.6), clamp=True)
    haze = n.mix_shader(0.5, n.bsdf("Diffuse", Color=(0.86, 0.87, 0.88)), n.bsdf("Translucent", Color=(0.86, 0.87, 0.88)))
    return n.done(n.mix_shader(wear, wall, haze))


def shade_material(desc):
    """What one wall does to light on its way to and from diffuse surfaces."""
    n = Nodes("shade")
    # Light lost at slanted walls mostly lands close by, so the loss is the one
    # at moderate angles everywhere.
    pass_ = (1 - 1.25 * ((IOR - 1) / (IOR + 1)) ** 2) ** 2
    return n.done(n.bsdf("Transparent", Color=tuple(pass_ * float(c) ** 1.15 for c in desc["tint"])))


def plastic_material(name, colour, roughness=0.32, noise=0.0, scale=60.0):
    n = Nodes(name)
    col = tuple(float(c) for c in colour)
    if noise > 0:
        t = n.add("TexNoise")
        t.inputs["Scale"].default_value = scale
        t.inputs["Detail"].default_value = 6.0
        col = n.mix_colour(n.math("MULTIPLY", t.outputs["Fac"], noise), col + (1.0,), tuple(0.35 * c for c in col) + (1.0,))
    p = n.add("BsdfPrincipled")
    n.put(p.inputs["Base Color"], col)
    p.inputs["Roughness"].default_value = roughness
    return n.done(p.outputs[0])


def metal_material(name, colour, roughness=0.35):
    n = Nodes(name)
    p = n.add("BsdfPrincipled")
    n.put(p.inputs["Base Color"], tuple(colour))
    p.inputs["Metallic"].default_value = 1.0
    p.inputs["Roughness"].default_value = roughness
    return n.done(p.outputs[0])


def image_from_array(name, a, srgb=True):
    """A Blender image from float (h, w, 3), row 0 on top."""
    h, w = a.shape[:2]
    img = bpy.data.images.new(name, w, h, float_buffer=not srgb)
    img.colorspace_settings.name = "sRGB" if srgb else "Non-Color"
    buf = np.ones((h, w, 4), np.float32)
    buf[..., :3] = a[::-1]
    img.pixels.foreach_set(buf.reshape(-1))
    img.pack()
    return img


def label_material(desc, art):
    n = Nodes("label")
    tex = n.add("TexImage")
    tex.image = image_from_array("label", art)
    geo = n.add("NewGeometry")
    back = n.mix_colour(0.88, tex.outputs["Color"], (0.78, 0.78, 0.76, 1.0))
    col = n.mix_colour(geo.outputs["Backfacing"], tex.outputs["Color"], back)
    p = n.add("BsdfPrincipled")
    n.link(col, p.inputs["Base Color"])
    p.inputs["Roughness"].default_value = 0.22 if desc["label_kind"] == "film" else 0.55
    return n.done(p.outputs[0])


def add_bottle(desc, parts, solid, art_rng, matrix=None):
    """Put a bottle's parts in the scene; returns the objects."""
    from . import art, bottle
    pet = pet_material(desc, solid)
    neck = pet_material(desc, solid, thickness=3.0)
    cap = plastic_material("cap", bottle.CAP_COLOURS[desc["cap_colour"]], 0.34)
    obs = []
    for p in parts:
        if p.name == "body":
            mat = pet
        elif p.name == "neck":
            mat = neck
        elif p.name == "label":
            mat = label_material(desc, art.label(art_rng))
        else:
            mat = cap
        crease = p.crease if p.crease is not None else np.zeros(len(p.verts), np.float32)
        ob = mesh_object(p.name, p.verts, p.faces, tris=p.tris, uv=p.uv, attrs={"wear": crease}, material=mat)
        if matrix is not None:
            import mathutils
            ob.matrix_world = mathutils.Matrix(np.asarray(matrix).tolist())
        obs.append(ob)
        if p.shade is not None:
            ob.visible_shadow = ob.visible_diffuse = False
            sh = mesh_object("shade", p.shade[0], p.shade[1], material=shade_material(desc))
            sh.matrix_world = ob.matrix_world
            sh.visible_camera = sh.visible_glossy = sh.visible_transmission = False
            obs.append(sh)
    return obs


# ------------------------------------------------------------- environment

def room_picture(rng, kind, height=128):
    """An equirectangular picture of a room: ceiling lights, a window, walls.

    Row 0 is straight up.  Returns linear radiance (height, 2 height, 3).
    """
    h, w = height, 2 * height
    el = (0.5 - (np.arange(h)[:, None] + 0.5) / h) * math.pi
    az = ((np.arange(w)[None] + 0.5) / w - 0.5) * 2 * math.pi
    d = np.stack([np.cos(el) * np.sin(az), np.cos(el) * np.cos(az), np.sin(el) + 0 * az], -1)
    img = np.empty((h, w, 3))
    wall = np.array([0.34, 0.33, 0.31]) * rng.uniform(0.7, 1.2)
    ceiling = np.array([0.50, 0.50, 0.49])
    floor = np.array([0.12, 0.11, 0.10])
    up = np.clip((d[..., 2] - 0.42) / 0.06, 0, 1)[..., None]
    dn = np.clip((-d[..., 2] - 0.15) / 0.1, 0, 1)[..., None]
    shade = (0.75 + 0.35 * np.sin(az * 2 + rng.uniform(0, 6)))[..., None] * np.ones((h, 1, 1))
    img[:] = wall * shade
    img = img * (1 - up) + ceiling * up
    img = img * (1 - dn) + floor * dn
    # dark furniture and a person-like silhouette along the horizon
    for _ in range(6):
        a0, wd, top = rng.uniform(-math.pi, math.pi), rng.uniform(0.1, 0.5), rng.uniform(0.05, 0.5)
        da = np.abs((az - a0 + math.pi) % (2 * math.pi) - math.pi)
        m = ((da < wd) & (el < top) & (el > -0.6))[..., None]
        img = np.where(m, img * rng.uniform(0.15, 0.6), img)
    pz = np.maximum(d[..., 2], 1e-3)
    cx, cy = d[..., 0] / pz, d[..., 1] / pz      # ceiling plane at unit height
    on_ceiling = d[..., 2] > 0.25
    if kind in ("panels", "bright", "mixed"):
        oy = rng.uniform(-0.5, 0.5)
        ox = rng.uniform(-0.6, 0.6)
        for k in (-1, 0, 1):
            m = on_ceiling & (np.abs(cx - ox - 1.1 * k) < 0.11) & (np.abs(cy - oy) < 0.85)
            m |= on_ceiling & (np.abs(cx - ox - 1.1 * k) < 0.11) & (np.abs(cy - oy - 2.2) < 0.85)
            img[m] = np.array([1.0, 0.98, 0.93]) * (9.0 if kind != "mixed" else 4.5)
    if kind in ("window", "mixed", "ambient"):
        a0 = rng.uniform(-math.pi, math.pi)
        da = (az - a0 + math.pi) % (2 * math.pi) - math.pi
        hh = (np.abs(da) < 0.55) & (el > 0.08) & (el < 0.72)
        bars = (np.abs(da) < 0.025) | (np.abs(el - 0.42) < 0.02)
        img[hh & ~bars] = np.array([0.86, 0.95, 1.10]) * (7.0 if kind != "ambient" else 4.0)
    return img.astype(np.float32)


def set_world(sc, rng, kind, strength, rotate=0.0):
    world = bpy.data.worlds.new("room")
    sc.world = world
    world.use_nodes = True
    t = world.node_tree
    t.nodes.clear()
    out = t.nodes.new("ShaderNodeOutputWorld")
    bg = t.nodes.new("ShaderNodeBackground")
    tex = t.nodes.new("ShaderNodeTexEnvironment")
    co = t.nodes.new("ShaderNodeTexCoord")
    mp = t.nodes.new("ShaderNodeMapping")
    tex.image = image_from_array("room", room_picture(rng, kind), srgb=False)
    mp.inputs["Rotation"].default_value[2] = rotate
    bg.inputs["Strength"].default_value = strength
    t.links.new(co.outputs["Generated"], mp.inputs[0])
    t.links.new(mp.outputs[0], tex.inputs[0])
    t.links.new(tex.outputs[0], bg.inputs[0])
    t.links.new(bg.outputs[0], out.inputs[0])
    try:
        world.cycles.sampling_method = "MANUAL"
        world.cycles.sample_map_resolution = 256
    except (AttributeError, TypeError):
        pass
    return world


# ------------------------------------------------------------------ sensor

def develop(linear, rng, exposure=1.0, shot=0.004, read=0.0015, vignette=0.12, blur=0.0, white=(1, 1, 1)):
    """A simple sensor: optical blur, vignetting, white balance, shot and read noise.

    Returns linear values that saturate at 4.0 (two stops above display white).
    """
    h, w = linear.shape[:2]
    x = linear * exposure * np.asarray(white)
    if blur > 0:
        r = max(1, int(math.ceil(2.5 * blur)))
        k = np.exp(-0.5 * (np.arange(-r, r + 1) / blur) ** 2)
        k /= k.sum()
        for ax in (0, 1):
            pad = [(0, 0)] * 3
            pad[ax] = (r, r)
            p = np.pad(x, pad, mode="edge")
            x = sum(k[i] * np.take(p, np.arange(i, i + x.shape[ax]), axis=ax) for i in range(2 * r + 1))
    x = x * vignette_map(h, w, vignette)[..., None]
    sigma = np.sqrt(shot ** 2 * np.maximum(x, 0) + read ** 2)
    x = x + sigma * rng.standard_normal(x.shape)
    return np.clip(x, 0.0, 4.0).astype(np.float32)


def vignette_map(h, w, strength):
    """Relative illumination of a lens: 1 in the centre, 1 - strength in the corners."""
    yy, xx = np.mgrid[0:h, 0:w] + 0.5
    r2 = ((xx - w / 2) ** 2 + (yy - h / 2) ** 2) / ((w / 2) ** 2 + (h / 2) ** 2)
    return 1.0 - strength * r2
