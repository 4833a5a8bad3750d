#!/usr/bin/env python3
"""Reference renderer: planar bottle cut-outs over a photographic plate, in Blender.

The script reads one JSON scene file, builds the scene in Blender, optionally
drops the bottles with Blender's rigid-body simulation, renders it with Cycles
on the CPU and composes the result over the background photograph (the plate).
It runs unchanged in Blender 3.4 and with the ``bpy`` 4.5 module:

    blender -b --factory-startup --python-use-system-env -P scene_reference.py -- SCENE.json --out DIR
    python3 scene_reference.py SCENE.json --out DIR          # needs the bpy module
    python3 scene_reference.py SCENE.json --check            # validate only, no bpy

Conventions
-----------
* Metres, Watts, scene-linear Rec.709 radiance, row 0 of an image is its top.
* World frame: right-handed, +Z up.  The rectangle (tray) is the plane z = 0,
  centred on the origin, ``tray.size = [along x, along y]``.
* A quad lies in the z = 0 plane of its own frame, ``size = [width, height]``
  centred on its origin.  Texture column runs along local +x, texture row 0 is
  at local +y.  ``pose`` is the 4x4 local-to-world matrix (row major), rigid.
* Camera, pinhole form: ``K`` (3x3), ``R`` (3x3) and ``t`` (3) map world points
  to the OpenCV camera frame (x right, y down, z forward).  Pixel (i, j) covers
  [i, i+1) x [j, j+1), its centre is (i+0.5, j+0.5).  Set ``pixel_center`` to 0
  when K was calibrated with integer pixel centres (OpenCV's habit).
* Area light: emits along local -z on one side only, with the radiance
  power * colour / (pi * area).  Blender 4.0 and later define the power of an
  area light this way; for 3.x the script scales it by 4 / pi to match.
* Textures: linear EXR with premultiplied alpha, or 8-bit PNG with straight
  alpha and sRGB encoding.

Scene file (JSON object; keys marked * are required)
----------------------------------------------------
render        width*, height*, samples (128), seed (0), threads (0 = all),
              max_bounces (4), diffuse_bounces (= max_bounces),
              transparent_max_bounces (64), filter_width (1.5),
              adaptive_threshold (0 = off), light_threshold (0),
              clamp_indirect (0), factory_defaults (false: when true the
              integrator settings a fresh Blender file has are kept; only
              samples, threads and size are applied and denoising is off).
camera*       either K*, R*, t*, resolution ([width, height] K belongs to,
              default the render size), pixel_center (0.5), or
              blender: {matrix_world*, lens* (mm), sensor_width (36),
              shift_x (0), shift_y (0)}.  Optional clip: [near, far];
              k1: OpenCV's first coefficient of radial distortion (0), for
              square pixels and the principal point in the middle, both to
              OFF_AXIS_PX, and no aperture;
              aperture: {diameter* (m), focus* (m)} of a thin lens.
tray*         size*.
plate         path*, encoding ("linear" | "srgb", default by file type).
quads*        list of {id* (1..65535), size*, pose (needed unless simulated),
              texture* (path), alpha ("premultiplied" | "straight"),
              encoding ("linear" | "srgb"), hue_shift (degrees, 0),
              saturation (1), value (1), opacity (1), thickness (0.01 m),
              mass (0.03 kg), film (path of an RGB EXR of opacity per channel,
              1 - view transmittance; the texture's colour is then what the
              film adds and its alpha is not used), back ({texture*, film}:
              what the other side shows, right way round as seen from there)}.
lights        list of {shape ("rectangle" | "square" | "disk" | "ellipse"),
              size* ([u, v] or number), power*, color ([1, 1, 1]) and either
              pose (4x4) or position* and target ([0, 0, 0])}.
environment   {path, strength (1), rotation_z (degrees, 0)} for an
              equirectangular map, or {color*, strength (1)}.
ground        mode ("catcher" | "projected"), extent ([x, y], default three
              times the tray), albedo (0.8; catcher only), gain (1; projected
              only: plate colour is multiplied by it to form the albedo).
material      model ("mix" | "principled"; default "mix"), specular (0.5),
              roughness (0.5), filter ("linear" | "closest" | "cubic"),
              extension ("clip" | "extend").
physics       frames (250), fps (24), substeps (10), iterations (10),
              gravity (9.81), friction (0.5), restitution (0.0),
              linear_damping (0.04), angular_damping (0.1),
              wall_height (2.0), wall_thickness (0.1), gap (0.02),
              drop_height (0.05), max_tilt (degrees, 10), margin (0.0),
              randomise (true), seed (0), rest_speed (0 = run all frames).

Output in DIR
-------------
beauty.exr    RGBA float32, linear, composed over the plate, alpha 1.
matte.exr     RGBA float32, quads only: premultiplied radiance and coverage.
shadow.exr    RGB float32, factor the plate is multiplied with (catcher mode).
id.exr        float32, id of the top-most opaque-enough quad at the pixel
              centre, 0 where there is none (see --id-alpha).
depth.exr     float32, depth along the optical axis of the same surface (m),
              about 1e10 where there is none.
position.exr  RGB float32, world position of the same surface (m).
beauty.png    8-bit sRGB preview of beauty.exr (--preview).
poses.json    final poses, with --simulate.
report.json   resolved scene, version, wall and processor time of each step.
Single-valued images repeat their value in R, G and B, with A = 1.
"""

import argparse
import json
import math
import os
import sys
import time

T_START = time.perf_counter()


# How far off the middle a principal point may be where a lens bends lines, and how far pixels
# that are not square may move the picture's side: Cycles' bent lenses have neither.
OFF_AXIS_PX = 0.05


class SceneError(Exception):
    """A scene file or command line that cannot be used."""


# --------------------------------------------------------------------------
# Scene file: reading and checking (no bpy needed)
# --------------------------------------------------------------------------

def _fail(where, what):
    raise SceneError("%s: %s" % (where, what))


def _number(value, where, low=None, high=None, integer=False):
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        _fail(where, "expected a number, got %r" % (value,))
    if integer and int(value) != value:
        _fail(where, "expected a whole number, got %r" % (value,))
    if not math.isfinite(value):
        _fail(where, "must be finite")
    if low is not None and value < low:
        _fail(where, "must be at least %g, got %g" % (low, value))
    if high is not None and value > high:
        _fail(where, "must be at most %g, got %g" % (high, value))
    return int(value) if integer else float(value)


def _vector(value, length, where, low=None, high=None):
    if not isinstance(value, (list, tuple)) or len(value) != length:
        _fail(where, "expected a list of %d numbers" % length)
    return [_number(v, "%s[%d]" % (where, i), low, high) for i, v in enumerate(value)]


def _matrix(value, rows, cols, where):
    if not isinstance(value, (list, tuple)) or len(value) != rows:
        _fail(where, "expected a %dx%d matrix as nested lists" % (rows, cols))
    return [_vector(r, cols, "%s[%d]" % (where, i)) for i, r in enumerate(value)]


def _choice(value, options, where):
    if value not in options:
        _fail(where, "must be one of %s, got %r" % (", ".join(options), value))
    return value


def _rigid(matrix, where, tol=1e-4):
    """Check that the upper 3x3 block of a matrix is a rotation."""
    r = [row[:3] for row in matrix[:3]]
    for i in range(3):
        for j in range(3):
            d = sum(r[k][i] * r[k][j] for k in range(3)) - (1.0 if i == j else 0.0)
            if abs(d) > tol:
                _fail(where, "rotation part is not orthonormal (error %.2g)" % d)
    det = (r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1])
           - r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0])
           + r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]))
    if det < 0.0:
        _fail(where, "rotation part mirrors (determinant %.3f)" % det)
    return matrix


def _keys(obj, allowed, where):
    if not isinstance(obj, dict):
        _fail(where, "expected an object")
    unknown = sorted(set(obj) - set(allowed))
    if unknown:
        _fail(where, "unknown key(s): %s" % ", ".join(unknown))
    return obj


def _encoding(entry, path, where):
    default = "linear" if path.lower().endswith((".exr", ".hdr")) else "srgb"
    return _choice(entry.get("encoding", default), ("linear", "srgb"), where + ".encoding")


def _path(value, base, where):
    if not isinstance(value, str) or not value:
        _fail(where, "expected a file path")
    full = value if os.path.isabs(value) else os.path.join(base, value)
    if not os.path.isfile(full):
        _fail(where, "file not found: %s" % value)
    return os.path.abspath(full)


def look_at(position, target):
    """Local-to-world matrix whose -z axis points from position to target."""
    z = [p - t for p, t in zip(position, target)]
    n = math.sqrt(sum(v * v for v in z))
    if n < 1e-9:
        raise SceneError("light position and target coincide")
    z = [v / n for v in z]
    up = [0.0, 1.0, 0.0] if abs(z[1]) < 0.999 else [1.0, 0.0, 0.0]
    x = [up[1] * z[2] - up[2] * z[1], up[2] * z[0] - up[0] * z[2], up[0] * z[1] - up[1] * z[0]]
    n = math.sqrt(sum(v * v for v in x))
    x = [v / n for v in x]
    y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
    return [[x[0], y[0], z[0], position[0]],
            [x[1], y[1], z[1], position[1]],
            [x[2], y[2], z[2], position[2]],
            [0.0, 0.0, 0.0, 1.0]]


def load_scene(path, needs_pose):
    """Read a scene file; return a new dict with every default filled in."""
    try:
        with open(path, "r", encoding="utf-8") as handle:
            raw = json.load(handle)
    except OSError as err:
        raise SceneError("cannot read %s: %s" % (path, err.strerror))
    except ValueError as err:
        raise SceneError("%s is not valid JSON: %s" % (path, err))
    base = os.path.dirname(os.path.abspath(path))
    _keys(raw, ("version", "render", "camera", "tray", "plate", "quads", "lights",
                "environment", "ground", "material", "physics", "comment"), "scene")
    for key in ("render", "camera", "tray", "quads"):
        if key not in raw:
            _fail("scene", "missing key: %s" % key)
    out = {"version": 1}

    r = _keys(raw["render"], ("width", "height", "samples", "seed", "threads", "max_bounces",
                              "diffuse_bounces", "transparent_max_bounces", "filter_width",
                              "adaptive_threshold", "light_threshold", "clamp_indirect",
                              "factory_defaults"), "render")
    for key in ("width", "height"):
        if key not in r:
            _fail("render", "missing key: %s" % key)
    bounces = _number(r.get("max_bounces", 4), "render.max_bounces", 0, 1024, True)
    out["render"] = {
        "width": _number(r["width"], "render.width", 4, 65536, True),
        "height": _number(r["height"], "render.height", 4, 65536, True),
        "samples": _number(r.get("samples", 128), "render.samples", 1, 1 << 24, True),
        "seed": _number(r.get("seed", 0), "render.seed", 0, 2 ** 31 - 1, True),
        "threads": _number(r.get("threads", 0), "render.threads", 0, 1024, True),
        "max_bounces": bounces,
        "diffuse_bounces": _number(r.get("diffuse_bounces", bounces),
                                   "render.diffuse_bounces", 0, 1024, True),
        "transparent_max_bounces": _number(r.get("transparent_max_bounces", 64),
                                           "render.transparent_max_bounces", 0, 1024, True),
        "filter_width": _number(r.get("filter_width", 1.5), "render.filter_width", 0.01, 10.0),
        "adaptive_threshold": _number(r.get("adaptive_threshold", 0.0),
                                      "render.adaptive_threshold", 0.0, 1.0),
        "light_threshold": _number(r.get("light_threshold", 0.0),
                                   "render.light_threshold", 0.0, 1.0),
        "clamp_indirect": _number(r.get("clamp_indirect", 0.0), "render.clamp_indirect", 0.0),
        "factory_defaults": bool(r.get("factory_defaults", False)),
    }

    c = _keys(raw["camera"], ("K", "R", "t", "resolution", "pixel_center", "blender", "clip",
                              "k1", "aperture"), "camera")
    cam = {"clip": _vector(c.get("clip", [0.01, 100.0]), 2, "camera.clip", 1e-6),
           "k1": _number(c.get("k1", 0.0), "camera.k1")}
    if "aperture" in c:
        a = _keys(c["aperture"], ("diameter", "focus"), "camera.aperture")
        for key in ("diameter", "focus"):
            if key not in a:
                _fail("camera.aperture", "missing key: %s" % key)
        cam["aperture"] = {key: _number(a[key], "camera.aperture." + key, 1e-9)
                           for key in ("diameter", "focus")}
    if "blender" in c:
        b = _keys(c["blender"], ("matrix_world", "lens", "sensor_width", "shift_x", "shift_y"),
                  "camera.blender")
        if "matrix_world" not in b or "lens" not in b:
            _fail("camera.blender", "needs matrix_world and lens")
        cam["blender"] = {
            "matrix_world": _rigid(_matrix(b["matrix_world"], 4, 4, "camera.blender.matrix_world"),
                                   "camera.blender.matrix_world"),
            "lens": _number(b["lens"], "camera.blender.lens", 1e-3),
            "sensor_width": _number(b.get("sensor_width", 36.0), "camera.blender.sensor_width", 1e-3),
            "shift_x": _number(b.get("shift_x", 0.0), "camera.blender.shift_x"),
            "shift_y": _number(b.get("shift_y", 0.0), "camera.blender.shift_y"),
        }
    else:
        for key in ("K", "R", "t"):
            if key not in c:
                _fail("camera", "missing key: %s (or give camera.blender)" % key)
        k = _matrix(c["K"], 3, 3, "camera.K")
        if k[0][0] <= 0 or k[1][1] <= 0:
            _fail("camera.K", "focal lengths must be positive")
        if abs(k[0][1]) > 1e-9 * k[0][0] or any(abs(v) > 1e-12 for v in k[2][:2] + [k[1][0]]) \
                or abs(k[2][2] - 1.0) > 1e-12:
            _fail("camera.K", "must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] without skew")
        cam["K"] = k
        cam["R"] = _rigid(_matrix(c["R"], 3, 3, "camera.R"), "camera.R")
        cam["t"] = _vector(c["t"], 3, "camera.t")
        cam["resolution"] = _vector(c.get("resolution", [out["render"]["width"],
                                                         out["render"]["height"]]),
                                    2, "camera.resolution", 1)
        cam["pixel_center"] = _number(c.get("pixel_center", 0.5), "camera.pixel_center", 0.0, 0.5)
        if cam["pixel_center"] not in (0.0, 0.5):
            _fail("camera.pixel_center", "must be 0 or 0.5")
    out["camera"] = cam

    t = _keys(raw["tray"], ("size",), "tray")
    if "size" not in t:
        _fail("tray", "missing key: size")
    out["tray"] = {"size": _vector(t["size"], 2, "tray.size", 1e-9)}

    if "plate" in raw:
        p = _keys(raw["plate"], ("path", "encoding"), "plate")
        full = _path(p.get("path"), base, "plate.path")
        out["plate"] = {"path": full, "encoding": _encoding(p, full, "plate")}

    if not isinstance(raw["quads"], list):
        _fail("quads", "expected a list")
    out["quads"] = []
    seen = set()
    for n, q in enumerate(raw["quads"]):
        where = "quads[%d]" % n
        _keys(q, ("id", "size", "pose", "texture", "alpha", "encoding", "hue_shift", "saturation",
                  "value", "opacity", "thickness", "mass", "film", "back"), where)
        for key in ("id", "size", "texture"):
            if key not in q:
                _fail(where, "missing key: %s" % key)
        ident = _number(q["id"], where + ".id", 1, 65535, True)
        if ident in seen:
            _fail(where + ".id", "id %d is used twice" % ident)
        seen.add(ident)
        full = _path(q["texture"], base, where + ".texture")
        default_alpha = "premultiplied" if full.lower().endswith(".exr") else "straight"
        quad = {
            "id": ident,
            "size": _vector(q["size"], 2, where + ".size", 1e-9),
            "texture": full,
            "alpha": _choice(q.get("alpha", default_alpha), ("premultiplied", "straight"),
                             where + ".alpha"),
            "encoding": _encoding(q, full, where),
            "hue_shift": _number(q.get("hue_shift", 0.0), where + ".hue_shift", -360.0, 360.0),
            "saturation": _number(q.get("saturation", 1.0), where + ".saturation", 0.0, 100.0),
            "value": _number(q.get("value", 1.0), where + ".value", 0.0, 100.0),
            "opacity": _number(q.get("opacity", 1.0), where + ".opacity", 0.0, 1.0),
            "thickness": _number(q.get("thickness", 0.01), where + ".thickness", 1e-5),
            "mass": _number(q.get("mass", 0.03), where + ".mass", 1e-6),
        }
        if "film" in q:
            quad["film"] = _path(q["film"], base, where + ".film")
        if "back" in q:
            b = _keys(q["back"], ("texture", "film"), where + ".back")
            back = _path(b.get("texture"), base, where + ".back.texture")
            quad["back"] = {"texture": back, "encoding": quad["encoding"],
                            "alpha": "premultiplied" if back.lower().endswith(".exr") else "straight"}
            if "film" in b:
                quad["back"]["film"] = _path(b["film"], base, where + ".back.film")
        if "pose" in q:
            quad["pose"] = _rigid(_matrix(q["pose"], 4, 4, where + ".pose"), where + ".pose")
        elif needs_pose:
            _fail(where, "missing key: pose (or use --simulate)")
        out["quads"].append(quad)

    out["lights"] = []
    for n, q in enumerate(raw.get("lights", [])):
        where = "lights[%d]" % n
        _keys(q, ("shape", "size", "power", "color", "pose", "position", "target"), where)
        for key in ("size", "power"):
            if key not in q:
                _fail(where, "missing key: %s" % key)
        shape = _choice(q.get("shape", "rectangle"), ("rectangle", "square", "disk", "ellipse"),
                        where + ".shape")
        size = q["size"]
        size = [size, size] if isinstance(size, (int, float)) else size
        light = {
            "shape": shape,
            "size": _vector(size, 2, where + ".size", 1e-5),
            "power": _number(q["power"], where + ".power", 0.0),
            "color": _vector(q.get("color", [1.0, 1.0, 1.0]), 3, where + ".color", 0.0),
        }
        if shape in ("square", "disk") and light["size"][0] != light["size"][1]:
            _fail(where + ".size", "a %s has one size" % shape)
        if "pose" in q:
            light["pose"] = _rigid(_matrix(q["pose"], 4, 4, where + ".pose"), where + ".pose")
        elif "position" in q:
            light["pose"] = look_at(_vector(q["position"], 3, where + ".position"),
                                    _vector(q.get("target", [0.0, 0.0, 0.0]), 3, where + ".target"))
        else:
            _fail(where, "needs pose or position")
        out["lights"].append(light)

    if "environment" in raw:
        e = _keys(raw["environment"], ("path", "strength", "rotation_z", "color"), "environment")
        env = {"strength": _number(e.get("strength", 1.0), "environment.strength", 0.0),
               "rotation_z": _number(e.get("rotation_z", 0.0), "environment.rotation_z")}
        if "path" in e:
            env["path"] = _path(e["path"], base, "environment.path")
        elif "color" in e:
            env["color"] = _vector(e["color"], 3, "environment.color", 0.0)
        else:
            _fail("environment", "needs path or color")
        out["environment"] = env

    g = _keys(raw.get("ground", {}), ("mode", "extent", "albedo", "gain"), "ground")
    out["ground"] = {
        "mode": _choice(g.get("mode", "catcher"), ("catcher", "projected"), "ground.mode"),
        "extent": _vector(g.get("extent", [3.0 * v for v in out["tray"]["size"]]), 2,
                          "ground.extent", 1e-9),
        "albedo": _number(g.get("albedo", 0.8), "ground.albedo", 0.001, 1.0),
        "gain": _number(g.get("gain", 1.0), "ground.gain", 0.0),
    }
    if out["ground"]["mode"] == "projected" and "plate" not in out:
        _fail("ground.mode", "projected needs a plate")

    m = _keys(raw.get("material", {}), ("model", "specular", "roughness", "filter", "extension"),
              "material")
    out["material"] = {
        "model": _choice(m.get("model", "mix"), ("mix", "principled"), "material.model"),
        "specular": _number(m.get("specular", 0.5), "material.specular", 0.0, 1.0),
        "roughness": _number(m.get("roughness", 0.5), "material.roughness", 0.0, 1.0),
        "filter": _choice(m.get("filter", "linear"), ("linear", "closest", "cubic"),
                          "material.filter"),
        "extension": _choice(m.get("extension", "clip"), ("clip", "extend"),
                             "material.extension"),
    }

    if out["material"]["model"] != "mix" and any(has_film(q) for q in out["quads"]):
        _fail("material.model", "film needs mix")

    p = _keys(raw.get("physics", {}), ("frames", "fps", "substeps", "iterations", "gravity",
                                       "friction", "restitution", "linear_damping",
                                       "angular_damping", "wall_height", "wall_thickness", "gap",
                                       "drop_height", "max_tilt", "margin", "randomise", "seed",
                                       "rest_speed"), "physics")
    out["physics"] = {
        "frames": _number(p.get("frames", 250), "physics.frames", 2, 100000, True),
        "fps": _number(p.get("fps", 24), "physics.fps", 1, 1000, True),
        "substeps": _number(p.get("substeps", 10), "physics.substeps", 1, 1000, True),
        "iterations": _number(p.get("iterations", 10), "physics.iterations", 1, 1000, True),
        "gravity": _number(p.get("gravity", 9.81), "physics.gravity"),
        "friction": _number(p.get("friction", 0.5), "physics.friction", 0.0),
        "restitution": _number(p.get("restitution", 0.0), "physics.restitution", 0.0, 1.0),
        "linear_damping": _number(p.get("linear_damping", 0.04), "physics.linear_damping", 0.0, 1.0),
        "angular_damping": _number(p.get("angular_damping", 0.1), "physics.angular_damping", 0.0, 1.0),
        "wall_height": _number(p.get("wall_height", 2.0), "physics.wall_height", 1e-3),
        "wall_thickness": _number(p.get("wall_thickness", 0.1), "physics.wall_thickness", 1e-3),
        "gap": _number(p.get("gap", 0.02), "physics.gap", 0.0),
        "drop_height": _number(p.get("drop_height", 0.05), "physics.drop_height", 0.0),
        "max_tilt": _number(p.get("max_tilt", 10.0), "physics.max_tilt", 0.0, 90.0),
        "margin": _number(p.get("margin", 0.0), "physics.margin", 0.0),
        "randomise": bool(p.get("randomise", True)),
        "seed": _number(p.get("seed", 0), "physics.seed", 0, 2 ** 31 - 1, True),
        "rest_speed": _number(p.get("rest_speed", 0.0), "physics.rest_speed", 0.0),
    }
    return out


def has_film(quad):
    """Either side of a quad lets each channel pass differently."""
    return "film" in quad or "film" in quad.get("back", {})


def load_poses(path, spec):
    """Replace the poses of all quads by those of a file written by --simulate."""
    try:
        with open(path, "r", encoding="utf-8") as handle:
            entries = json.load(handle)["quads"]
        table = {e["id"]: e["pose"] for e in entries}
    except OSError as err:
        raise SceneError("cannot read %s: %s" % (path, err.strerror))
    except (ValueError, KeyError, TypeError):
        raise SceneError("%s is not a pose file" % path)
    for q in spec["quads"]:
        if q["id"] not in table:
            raise SceneError("%s has no pose for quad %d" % (path, q["id"]))
        where = "%s: quad %d" % (path, q["id"])
        q["pose"] = _rigid(_matrix(table[q["id"]], 4, 4, where), where)


def parse_args(argv):
    parser = argparse.ArgumentParser(
        prog="scene_reference.py",
        description="Render a bottle scene with Blender Cycles over a background plate.",
        epilog="Under the blender executable, put these arguments after '--'.")
    parser.add_argument("scene", help="scene JSON file")
    parser.add_argument("--out", metavar="DIR", help="output folder (created if missing)")
    parser.add_argument("--check", action="store_true", help="validate the scene file and stop")
    parser.add_argument("--samples", type=int, help="override render.samples")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"),
                        help="override render.width and render.height (K is rescaled)")
    parser.add_argument("--threads", type=int, help="override render.threads")
    parser.add_argument("--seed", type=int, help="override render.seed")
    parser.add_argument("--simulate", action="store_true",
                        help="drop the quads with rigid-body physics before rendering")
    parser.add_argument("--poses", metavar="FILE",
                        help="with --simulate: write the final poses there "
                             "(default DIR/poses.json)")
    parser.add_argument("--load-poses", metavar="FILE",
                        help="take the poses of the quads from such a file, matched by id")
    parser.add_argument("--no-beauty", action="store_true", help="skip the beauty render")
    parser.add_argument("--aux", action="store_true", help="also render id, depth and position")
    parser.add_argument("--id-alpha", type=float, default=0.05, metavar="A",
                        help="texture alpha above which a quad owns a pixel (default 0.05; "
                             "negative: the whole rectangle)")
    parser.add_argument("--preview", action="store_true", help="also write beauty.png (8-bit sRGB)")
    parser.add_argument("--golden", metavar="FILE",
                        help="also write beauty.exr as a small half-float RGB EXR")
    args = parser.parse_args(argv)
    if not args.check and not args.out:
        parser.error("--out is required")
    if args.samples is not None and args.samples < 1:
        parser.error("--samples must be at least 1")
    if args.size is not None and min(args.size) < 4:
        parser.error("--size must be at least 4 x 4")
    if args.threads is not None and args.threads < 0:
        parser.error("--threads must not be negative")
    if args.seed is not None and args.seed < 0:
        parser.error("--seed must not be negative")
    if args.load_poses and args.simulate:
        parser.error("--load-poses and --simulate exclude each other")
    if args.poses and not args.simulate:
        parser.error("--poses needs --simulate")
    if args.id_alpha >= 1.0:
        parser.error("--id-alpha must be below 1")
    return args


# --------------------------------------------------------------------------
# Blender part
# --------------------------------------------------------------------------

class Clock:
    """Wall-clock and processor time (all threads) of named steps."""

    def __init__(self):
        self.steps = {}
        self.cpu = {}
        self.last = (time.perf_counter(), time.process_time())

    def mark(self, name):
        now = (time.perf_counter(), time.process_time())
        self.steps[name] = round(self.steps.get(name, 0.0) + now[0] - self.last[0], 4)
        self.cpu[name] = round(self.cpu.get(name, 0.0) + now[1] - self.last[1], 4)
        self.last = now


def read_pixels(bpy, path):
    """Read an image as float32 H x W x 4, row 0 on top, values as stored."""
    import numpy as np
    image = bpy.data.images.load(path, check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    w, h = image.size
    if w == 0 or h == 0:
        raise SceneError("cannot decode image %s" % path)
    buf = np.empty(w * h * 4, dtype=np.float32)
    image.pixels.foreach_get(buf)
    bpy.data.images.remove(image)
    return np.ascontiguousarray(buf.reshape(h, w, 4)[::-1])


def write_pixels(bpy, scene, path, rgba, kind="EXR"):
    """Write float32 H x W x 4 (row 0 on top) as 32-bit EXR, half RGB EXR or 8-bit PNG, untouched."""
    import numpy as np
    h, w = rgba.shape[:2]
    image = bpy.data.images.new("out", w, h, alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(np.ascontiguousarray(rgba[::-1], dtype=np.float32).ravel())
    settings = scene.render.image_settings
    if kind == "EXR":
        settings.file_format = "OPEN_EXR"
        settings.color_mode = "RGBA"
        settings.color_depth = "32"
        settings.exr_codec = "ZIP"
    elif kind == "HALF":
        settings.file_format = "OPEN_EXR"
        settings.color_mode = "RGB"
        settings.color_depth = "16"
        settings.exr_codec = "ZIP"
    else:
        settings.file_format = "PNG"
        settings.color_mode = "RGB"
        settings.color_depth = "8"
    image.save_render(path, scene=scene)
    bpy.data.images.remove(image)


def srgb_to_linear(v):
    import numpy as np
    return np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.0) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(v):
    import numpy as np
    v = np.clip(v, 0.0, 1.0)
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** (1.0 / 2.4) - 0.055)


def resample_area(img, width, height):
    """Area-average (box) resampling to width x height; exact for any ratio."""
    import numpy as np

    def along(a, n):
        m = a.shape[0]
        if m == n:
            return a
        edges = np.linspace(0.0, m, n + 1)
        cum = np.concatenate([np.zeros((1,) + a.shape[1:]), np.cumsum(a, axis=0, dtype=np.float64)])
        lo = np.minimum(edges.astype(int), m - 1)
        frac = (edges - lo).reshape((-1,) + (1,) * (a.ndim - 1))
        at = cum[lo] + frac * a[lo]
        return (np.diff(at, axis=0) * (n / float(m)))

    out = along(img, height)
    out = along(out.swapaxes(0, 1), width).swapaxes(0, 1)
    return out.astype(np.float32)


def camera_to_blender(cam, width, height):
    """matrix_world (rows), lens, sensor_width, shift_x, shift_y, aspect_x, aspect_y."""
    if "blender" in cam:
        b = cam["blender"]
        return (b["matrix_world"], b["lens"], b["sensor_width"], b["shift_x"], b["shift_y"], 1.0, 1.0)
    sx = width / cam["resolution"][0]
    sy = height / cam["resolution"][1]
    off = 0.5 - cam["pixel_center"]
    k = cam["K"]
    fx, fy = k[0][0] * sx, k[1][1] * sy
    cx, cy = (k[0][2] + off) * sx, (k[1][2] + off) * sy
    r, t = cam["R"], cam["t"]
    centre = [-sum(r[k2][i] * t[k2] for k2 in range(3)) for i in range(3)]
    # Blender camera axes: x right, y up, z backward.
    rows = [[r[0][i], -r[1][i], -r[2][i], centre[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
    ratio = fx / fy                       # = pixel_aspect_y / pixel_aspect_x
    aspect_x, aspect_y = (1.0, ratio) if ratio >= 1.0 else (1.0 / ratio, 1.0)
    sensor = 36.0
    lens = fx * sensor / width
    shift_x = (0.5 * width - cx) / width
    shift_y = (cy - 0.5 * height) * ratio / width
    return rows, lens, sensor, shift_x, shift_y, aspect_x, aspect_y


def check_distortion(spec):
    """Refuse a k1 that Cycles cannot render."""
    cam, r = spec["camera"], spec["render"]
    if not cam["k1"]:
        return
    _, _, _, shift_x, shift_y, ax, ay = camera_to_blender(cam, r["width"], r["height"])
    # In the camera's own pixels: the lens is the same at any --size.
    own_width = cam["resolution"][0] if "resolution" in cam else r["width"]
    if max(abs(v) for v in (shift_x, shift_y, ax - ay)) * own_width > OFF_AXIS_PX:
        _fail("camera.k1", "needs square pixels and the principal point in the middle")
    if "aperture" in cam:
        _fail("camera.k1", "cannot be had together with camera.aperture")


def lens_polynomial(k1, focal_mm, reach_mm):
    """Coefficients of Cycles' "Fisheye Lens Polynomial" that make OpenCV's k1, and its largest error in mm.

    That camera sends the ray of a point r millimetres from the middle of the sensor out at an angle
    -(c0 + c1 r + c2 r^2 + c3 r^3 + c4 r^4) from its axis; a pinhole with k1 at atan(u), where
    u (1 + k1 u^2) = r / focal.  The fit is by least squares over all radii of the picture.
    """
    import numpy as np
    r = np.linspace(0.0, reach_mm, 4001)
    u = r / focal_mm
    for _ in range(60):
        u = u - (u * (1.0 + k1 * u * u) - r / focal_mm) / (1.0 + 3.0 * k1 * u * u)
    powers = np.stack([(r / reach_mm) ** n for n in range(1, 5)], axis=1)
    scaled, *_ = np.linalg.lstsq(powers, np.arctan(u), rcond=None)
    error = np.abs(powers @ scaled - np.arctan(u)) * focal_mm * (1.0 + u * u) * (1.0 + 3.0 * k1 * u * u)
    return [0.0] + [-float(c) / reach_mm ** n for n, c in enumerate(scaled, 1)], float(error.max())


class Builder:
    """Builds the Blender scene for one scene dict."""

    def __init__(self, bpy, spec):
        from mathutils import Matrix
        self.bpy = bpy
        self.spec = spec
        self.Matrix = Matrix
        self.quads = []
        self.ground = None
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene

    # ---- settings -------------------------------------------------------

    def settings(self):
        s, r = self.scene, self.spec["render"]
        s.render.engine = "CYCLES"
        c = s.cycles
        c.device = "CPU"
        c.use_denoising = False
        c.samples = r["samples"]
        c.seed = r["seed"]
        if r["threads"]:
            s.render.threads_mode = "FIXED"
            s.render.threads = r["threads"]
        if not r["factory_defaults"]:
            c.max_bounces = r["max_bounces"]
            c.diffuse_bounces = r["diffuse_bounces"]
            c.glossy_bounces = r["max_bounces"]
            c.transmission_bounces = 0
            c.volume_bounces = 0
            c.transparent_max_bounces = r["transparent_max_bounces"]
            # Random termination of transparent paths biases the coverage Cycles
            # stores in front of a shadow catcher, so it must stay off.
            c.min_transparent_bounces = min(r["transparent_max_bounces"], 1024)
            c.min_light_bounces = min(r["max_bounces"], 1024)
            c.sample_clamp_direct = 0.0
            c.sample_clamp_indirect = r["clamp_indirect"]
            c.light_sampling_threshold = r["light_threshold"]
            c.blur_glossy = 0.0
            c.use_adaptive_sampling = r["adaptive_threshold"] > 0.0
            if r["adaptive_threshold"] > 0.0:
                c.adaptive_threshold = r["adaptive_threshold"]
            c.pixel_filter_type = "BLACKMAN_HARRIS"
            c.filter_width = r["filter_width"]
        s.render.resolution_x = r["width"]
        s.render.resolution_y = r["height"]
        s.render.resolution_percentage = 100
        s.render.film_transparent = True
        s.render.dither_intensity = 0.0
        s.render.use_persistent_data = False
        s.view_settings.view_transform = "Raw"
        s.view_settings.look = "None"
        s.view_settings.exposure = 0.0
        s.view_settings.gamma = 1.0

    # ---- objects --------------------------------------------------------

    def link(self, name, data, rows):
        obj = self.bpy.data.objects.new(name, data)
        obj.matrix_world = self.Matrix(rows)
        self.scene.collection.objects.link(obj)
        return obj

    def rectangle(self, name, sx, sy):
        hx, hy = 0.5 * sx, 0.5 * sy
        mesh = self.bpy.data.meshes.new(name)
        mesh.from_pydata([(-hx, -hy, 0.0), (hx, -hy, 0.0), (hx, hy, 0.0), (-hx, hy, 0.0)],
                         [], [(0, 1, 2, 3)])
        layer = mesh.uv_layers.new(name="UVMap")
        for loop, uv in zip(layer.data, ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))):
            loop.uv = uv
        return mesh

    def box(self, name, sx, sy, sz):
        hx, hy, hz = 0.5 * sx, 0.5 * sy, 0.5 * sz
        mesh = self.bpy.data.meshes.new(name)
        mesh.from_pydata(
            [(x, y, z) for z in (-hz, hz) for y in (-hy, hy) for x in (-hx, hx)], [],
            [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
        return mesh

    def image(self, path, alpha, encoding):
        img = self.bpy.data.images.load(path, check_existing=True)
        names = self.bpy.types.ColorManagedInputColorspaceSettings.bl_rna.properties["name"].enum_items.keys()
        if encoding == "srgb":
            img.colorspace_settings.name = "sRGB"
        else:
            img.colorspace_settings.name = "Linear" if "Linear" in names else "Linear Rec.709"
        img.alpha_mode = {"premultiplied": "PREMUL", "packed": "CHANNEL_PACKED"}.get(alpha, "STRAIGHT")
        return img

    def quad_material(self, q):
        mat = self.bpy.data.materials.new("quad_%d" % q["id"])
        mat.use_nodes = True
        nt = mat.node_tree
        nt.nodes.clear()
        out = nt.nodes.new("ShaderNodeOutputMaterial")
        surface = self.side(nt, q, q, "texture")
        if "back" in q:
            # Seen from behind, the texture of the back is the right way round: u runs the other way.
            uv = nt.nodes.new("ShaderNodeUVMap")
            turn = nt.nodes.new("ShaderNodeMapping")
            turn.inputs["Location"].default_value = (1.0, 0.0, 0.0)
            turn.inputs["Scale"].default_value = (-1.0, 1.0, 1.0)
            nt.links.new(uv.outputs[0], turn.inputs["Vector"])
            back = self.side(nt, q, q["back"], "back_texture", turn.outputs[0])
            seen = nt.nodes.new("ShaderNodeNewGeometry")
            either = nt.nodes.new("ShaderNodeMixShader")
            nt.links.new(seen.outputs["Backfacing"], either.inputs[0])
            nt.links.new(surface, either.inputs[1])
            nt.links.new(back, either.inputs[2])
            surface = either.outputs[0]
        nt.links.new(surface, out.inputs["Surface"])
        return mat

    def texture(self, nt, path, alpha, encoding, vector):
        m = self.spec["material"]
        tex = nt.nodes.new("ShaderNodeTexImage")
        tex.image = self.image(path, alpha, encoding)
        tex.interpolation = {"linear": "Linear", "closest": "Closest", "cubic": "Cubic"}[m["filter"]]
        tex.extension = m["extension"].upper()
        if vector is not None:
            nt.links.new(vector, tex.inputs["Vector"])
        return tex

    def side(self, nt, q, look, name, vector=None):
        """What one side of a quad shows; `look` holds its texture and, for a film, its opacity."""
        new, link = nt.nodes.new, nt.links.new
        m = self.spec["material"]
        # The colour of a film is what it adds, whatever its alpha says: it must not be divided by it.
        alpha_mode = "packed" if "film" in look else look["alpha"]
        tex = self.texture(nt, look["texture"], alpha_mode, look["encoding"], vector)
        tex.name = name
        color = tex.outputs["Color"]
        if q["hue_shift"] or q["saturation"] != 1.0 or q["value"] != 1.0:
            hsv = new("ShaderNodeHueSaturation")
            hsv.inputs["Hue"].default_value = (0.5 + q["hue_shift"] / 360.0) % 1.0
            hsv.inputs["Saturation"].default_value = q["saturation"]
            hsv.inputs["Value"].default_value = q["value"]
            hsv.inputs["Fac"].default_value = 1.0
            link(color, hsv.inputs["Color"])
            color = hsv.outputs["Color"]
        if "film" in look:
            return self.film(nt, q, color, look["film"], vector)
        alpha = tex.outputs["Alpha"]
        if q["opacity"] != 1.0:
            mul = new("ShaderNodeMath")
            mul.operation = "MULTIPLY"
            mul.inputs[1].default_value = q["opacity"]
            link(alpha, mul.inputs[0])
            alpha = mul.outputs[0]
        if m["model"] == "principled":
            bsdf = new("ShaderNodeBsdfPrincipled")
            link(color, bsdf.inputs["Base Color"])
            link(alpha, bsdf.inputs["Alpha"])
            specular = "Specular" if "Specular" in bsdf.inputs else "Specular IOR Level"
            bsdf.inputs[specular].default_value = m["specular"]
            bsdf.inputs["Roughness"].default_value = m["roughness"]
            return bsdf.outputs[0]
        diffuse = new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Roughness"].default_value = 0.0
        clear = new("ShaderNodeBsdfTransparent")
        mix = new("ShaderNodeMixShader")
        link(color, diffuse.inputs["Color"])
        link(alpha, mix.inputs[0])
        link(clear.outputs[0], mix.inputs[1])
        link(diffuse.outputs[0], mix.inputs[2])
        return mix.outputs[0]

    def film(self, nt, q, color, path, vector):
        """Adds what the film reflects to what it lets pass, channel by channel."""
        new, link = nt.nodes.new, nt.links.new
        opacity = self.texture(nt, path, "packed", "linear", vector)
        passes = new("ShaderNodeVectorMath")
        passes.operation = "SUBTRACT"
        passes.inputs[0].default_value = (1.0, 1.0, 1.0)
        link(opacity.outputs["Color"], passes.inputs[1])
        through = passes.outputs[0]
        if q["hue_shift"] or q["saturation"] != 1.0:
            # A film that is tinted otherwise tints otherwise what is seen through it; value is of what it adds alone.
            hsv = new("ShaderNodeHueSaturation")
            hsv.inputs["Hue"].default_value = (0.5 + q["hue_shift"] / 360.0) % 1.0
            hsv.inputs["Saturation"].default_value = q["saturation"]
            hsv.inputs["Fac"].default_value = 1.0
            link(through, hsv.inputs["Color"])
            through = hsv.outputs["Color"]
        clear = new("ShaderNodeBsdfTransparent")
        link(through, clear.inputs["Color"])
        diffuse = new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Roughness"].default_value = 0.0
        link(color, diffuse.inputs["Color"])
        both = new("ShaderNodeAddShader")
        link(diffuse.outputs[0], both.inputs[0])
        link(clear.outputs[0], both.inputs[1])
        return both.outputs[0]

    def add_quads(self):
        for q in self.spec["quads"]:
            rows = q.get("pose") or [[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]
            obj = self.link("quad_%d" % q["id"], self.rectangle("quad", *q["size"]), rows)
            obj.pass_index = q["id"]
            obj.data.materials.append(self.quad_material(q))
            self.quads.append(obj)

    def add_ground(self):
        g = self.spec["ground"]
        ex, ey = g["extent"]
        obj = self.link("ground", self.rectangle("ground", ex, ey),
                        [[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]])
        mat = self.bpy.data.materials.new("ground")
        mat.use_nodes = True
        nt = mat.node_tree
        nt.nodes.clear()
        out = nt.nodes.new("ShaderNodeOutputMaterial")
        diffuse = nt.nodes.new("ShaderNodeBsdfDiffuse")
        nt.links.new(diffuse.outputs[0], out.inputs["Surface"])
        if g["mode"] == "catcher":
            a = g["albedo"]
            diffuse.inputs["Color"].default_value = (a, a, a, 1.0)
            obj.is_shadow_catcher = True
        else:
            plate = self.spec["plate"]
            coords = nt.nodes.new("ShaderNodeTexCoord")
            tex = nt.nodes.new("ShaderNodeTexImage")
            tex.image = self.image(plate["path"], "straight", plate["encoding"])
            tex.image.alpha_mode = "NONE"
            tex.extension = "EXTEND"
            gain = nt.nodes.new("ShaderNodeMixRGB")
            gain.blend_type = "MULTIPLY"
            gain.inputs[0].default_value = 1.0
            gain.inputs[2].default_value = (g["gain"], g["gain"], g["gain"], 1.0)
            nt.links.new(coords.outputs["Window"], tex.inputs["Vector"])
            nt.links.new(tex.outputs["Color"], gain.inputs[1])
            nt.links.new(gain.outputs[0], diffuse.inputs["Color"])
        obj.data.materials.append(mat)
        self.ground = obj

    def add_camera(self):
        r = self.spec["render"]
        rows, lens, sensor, shift_x, shift_y, ax, ay = camera_to_blender(
            self.spec["camera"], r["width"], r["height"])
        data = self.bpy.data.cameras.new("camera")
        data.sensor_fit = "HORIZONTAL"
        data.sensor_width = sensor
        data.lens = lens
        data.shift_x = shift_x
        data.shift_y = shift_y
        data.clip_start, data.clip_end = self.spec["camera"]["clip"]
        cam = self.spec["camera"]
        if cam["k1"]:
            self.add_distortion(data, cam["k1"])
        if "aperture" in cam:
            data.dof.use_dof = True
            data.dof.focus_distance = cam["aperture"]["focus"]
            data.dof.aperture_fstop = 1e-3 * lens / cam["aperture"]["diameter"]
            data.dof.aperture_blades = 0
        self.scene.render.pixel_aspect_x = ax
        self.scene.render.pixel_aspect_y = ay
        self.scene.camera = self.link("camera", data, rows)

    def add_distortion(self, data, k1):
        r = self.spec["render"]
        height = data.sensor_width * r["height"] / r["width"]
        # Cycles takes the height of a panoramic sensor as it stands.
        data.sensor_height = height
        coefficients, error = lens_polynomial(k1, data.lens, 0.5 * math.hypot(data.sensor_width, height))
        print("lens polynomial: at most %.5f px off" % (error * r["width"] / data.sensor_width))
        data.type = "PANO"
        data.cycles.panorama_type = "FISHEYE_LENS_POLYNOMIAL"
        data.cycles.fisheye_fov = math.pi
        for n, value in enumerate(coefficients):
            setattr(data.cycles, "fisheye_polynomial_k%d" % n, value)

    def add_lights(self):
        for n, spec in enumerate(self.spec["lights"]):
            data = self.bpy.data.lights.new("light_%d" % n, "AREA")
            data.shape = spec["shape"].upper()
            data.size, data.size_y = spec["size"]
            # Blender 3.x emits power / (4 area); 4.0 and later power / (pi area).
            fix = 4.0 / math.pi if self.bpy.app.version < (4, 0, 0) else 1.0
            data.energy = spec["power"] * fix
            data.color = spec["color"]
            obj = self.link("light_%d" % n, data, spec["pose"])
            obj.visible_camera = False

    def add_world(self):
        world = self.bpy.data.worlds.new("world")
        self.scene.world = world
        world.use_nodes = True
        nt = world.node_tree
        nt.nodes.clear()
        out = nt.nodes.new("ShaderNodeOutputWorld")
        back = nt.nodes.new("ShaderNodeBackground")
        nt.links.new(back.outputs[0], out.inputs["Surface"])
        env = self.spec.get("environment")
        if env is None:
            back.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
            return
        back.inputs["Strength"].default_value = env["strength"]
        if "path" in env:
            coords = nt.nodes.new("ShaderNodeTexCoord")
            mapping = nt.nodes.new("ShaderNodeMapping")
            mapping.inputs["Rotation"].default_value[2] = math.radians(env["rotation_z"])
            tex = nt.nodes.new("ShaderNodeTexEnvironment")
            tex.image = self.image(env["path"], "straight",
                                   "linear" if env["path"].lower().endswith((".exr", ".hdr"))
                                   else "srgb")
            nt.links.new(coords.outputs["Generated"], mapping.inputs["Vector"])
            nt.links.new(mapping.outputs[0], tex.inputs["Vector"])
            nt.links.new(tex.outputs["Color"], back.inputs["Color"])
        else:
            back.inputs["Color"].default_value = tuple(env["color"]) + (1.0,)

    # ---- physics --------------------------------------------------------

    def initial_poses(self):
        """Vertical stack without overlap, as random as physics.randomise asks for."""
        import random
        p = self.spec["physics"]
        rng = random.Random(p["seed"])
        tx, ty = self.spec["tray"]["size"]
        z = p["drop_height"]
        poses = []
        for q in self.spec["quads"]:
            if not p["randomise"] and "pose" in q:
                poses.append(self.Matrix(q["pose"]))
                continue
            w, h = q["size"]
            yaw = rng.uniform(-math.pi, math.pi)
            tilt = math.radians(rng.uniform(0.0, p["max_tilt"]))
            axis = rng.uniform(-math.pi, math.pi)
            rot = (self.Matrix.Rotation(tilt, 4, (math.cos(axis), math.sin(axis), 0.0))
                   @ self.Matrix.Rotation(yaw, 4, "Z"))
            half = [0.5 * (abs(rot[i][0]) * w + abs(rot[i][1]) * h
                           + abs(rot[i][2]) * q["thickness"]) for i in range(3)]
            room_x = max(0.0, 0.5 * tx - p["margin"] - half[0])
            room_y = max(0.0, 0.5 * ty - p["margin"] - half[1])
            z += half[2]
            poses.append(self.Matrix.Translation((rng.uniform(-room_x, room_x),
                                                  rng.uniform(-room_y, room_y), z)) @ rot)
            z += half[2] + p["gap"]
        return poses

    def rigid_body(self, obj, kind, mass=1.0):
        bpy, p = self.bpy, self.spec["physics"]
        bpy.context.view_layer.objects.active = obj
        bpy.ops.rigidbody.object_add(type=kind)
        rb = obj.rigid_body
        rb.collision_shape = "BOX"
        rb.friction = p["friction"]
        rb.restitution = p["restitution"]
        rb.use_margin = True
        rb.collision_margin = 0.0
        if kind == "ACTIVE":
            rb.mass = mass
            rb.linear_damping = p["linear_damping"]
            rb.angular_damping = p["angular_damping"]

    def simulate(self):
        """Drop the quads into the constraint box; returns frames run and poses."""
        bpy, s, p = self.bpy, self.scene, self.spec["physics"]
        tx, ty = self.spec["tray"]["size"]
        wt = p["wall_thickness"]
        starts = self.initial_poses()
        top = max([m.translation.z for m in starts] + [0.0])
        wh = max(p["wall_height"], top + max(max(q["size"]) for q in self.spec["quads"]))
        s.render.fps = p["fps"]
        s.frame_start, s.frame_end = 1, p["frames"]
        s.use_gravity = True
        s.gravity = (0.0, 0.0, -p["gravity"])
        bpy.ops.rigidbody.world_add()
        world = s.rigidbody_world
        world.substeps_per_frame = p["substeps"]
        world.solver_iterations = p["iterations"]
        world.point_cache.frame_start = 1
        world.point_cache.frame_end = p["frames"]

        helpers = []
        eye = self.Matrix.Identity(4)
        for name, size, at in (
                ("floor", (tx + 2 * wt, ty + 2 * wt, wt), (0.0, 0.0, -0.5 * wt)),
                ("wall_x0", (wt, ty + 2 * wt, wh), (-0.5 * (tx + wt), 0.0, 0.5 * wh)),
                ("wall_x1", (wt, ty + 2 * wt, wh), (0.5 * (tx + wt), 0.0, 0.5 * wh)),
                ("wall_y0", (tx + 2 * wt, wt, wh), (0.0, -0.5 * (ty + wt), 0.5 * wh)),
                ("wall_y1", (tx + 2 * wt, wt, wh), (0.0, 0.5 * (ty + wt), 0.5 * wh))):
            obj = self.link(name, self.box(name, *size), eye)
            obj.location = at
            obj.hide_render = True
            helpers.append(obj)
            self.rigid_body(obj, "PASSIVE")
        bodies = []
        for q, start in zip(self.spec["quads"], starts):
            obj = self.link("body_%d" % q["id"],
                            self.box("body", q["size"][0], q["size"][1], q["thickness"]), start)
            obj.hide_render = True
            obj.rotation_mode = "QUATERNION"
            obj.matrix_world = start
            helpers.append(obj)
            bodies.append(obj)
            self.rigid_body(obj, "ACTIVE", q["mass"])

        last = None
        frame = 1
        for frame in range(1, p["frames"] + 1):
            s.frame_set(frame)
            if p["rest_speed"] > 0.0 and frame % 4 == 0:
                graph = bpy.context.evaluated_depsgraph_get()
                now = [b.evaluated_get(graph).matrix_world.copy() for b in bodies]
                if last is not None and frame > p["fps"]:
                    # fastest corner of any body since the last look
                    worst = 0.0
                    for a, b, q in zip(last, now, self.spec["quads"]):
                        for cx in (-0.5, 0.5):
                            for cy in (-0.5, 0.5):
                                v = self.vector(cx * q["size"][0], cy * q["size"][1], 0.0)
                                worst = max(worst, ((a @ v) - (b @ v)).length)
                    if worst * p["fps"] / 4.0 < p["rest_speed"]:
                        break
                last = now
        graph = bpy.context.evaluated_depsgraph_get()
        final = [b.evaluated_get(graph).matrix_world.copy() for b in bodies]
        for obj in helpers:
            bpy.data.objects.remove(obj, do_unlink=True)
        bpy.ops.rigidbody.world_remove()
        for obj, q, m in zip(self.quads, self.spec["quads"], final):
            # rigid part only: drop the rounding the simulation leaves in the axes
            loc, rot, _ = m.decompose()
            m = self.Matrix.Translation(loc) @ rot.to_matrix().to_4x4()
            obj.matrix_world = m
            q["pose"] = [[float(v) for v in row] for row in m]
        return frame

    def vector(self, x, y, z):
        from mathutils import Vector
        return Vector((x, y, z))

    # ---- rendering ------------------------------------------------------

    def passes_to_files(self, folder, wanted):
        """Compositor graph writing each wanted pass as its own float EXR."""
        s = self.scene
        s.use_nodes = True
        nt = s.node_tree
        nt.nodes.clear()
        layers = nt.nodes.new("CompositorNodeRLayers")
        layers.scene = s
        out = nt.nodes.new("CompositorNodeOutputFile")
        out.base_path = folder
        out.format.file_format = "OPEN_EXR"
        out.format.color_depth = "32"
        out.format.color_mode = "RGBA"
        out.format.exr_codec = "ZIP"
        out.file_slots.clear()
        for socket, name in wanted:
            out.file_slots.new(name + "_")
            nt.links.new(layers.outputs[socket], out.inputs[len(out.file_slots) - 1])
        # Blender insists on a composite output.
        comp = nt.nodes.new("CompositorNodeComposite")
        nt.links.new(layers.outputs["Image"], comp.inputs[0])

    def render_passes(self, folder, wanted):
        bpy, s = self.bpy, self.scene
        self.passes_to_files(folder, wanted)
        s.frame_set(1)
        bpy.ops.render.render(write_still=False)
        result = {}
        for _, name in wanted:
            path = os.path.join(folder, "%s_%04d.exr" % (name, s.frame_current))
            result[name] = read_pixels(bpy, path)
            os.remove(path)
        s.use_nodes = False
        return result

    def beauty(self, folder):
        layer = self.scene.view_layers[0]
        wanted = [("Image", "combined")]
        if self.spec["ground"]["mode"] == "catcher":
            layer.cycles.use_pass_shadow_catcher = True
            wanted.append(("Shadow Catcher", "catcher"))
        return self.render_passes(folder, wanted)

    def passing(self, folder):
        """What all quads together let pass, per channel: seen against a white world, without any light on them.

        Changes the scene for good; comes last.
        """
        s = self.scene
        for obj in self.quads:
            nt = obj.data.materials[0].node_tree
            for node in nt.nodes:
                if node.bl_idname == "ShaderNodeBsdfDiffuse":
                    for wire in list(node.inputs["Color"].links):
                        nt.links.remove(wire)
                    node.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        self.ground.hide_render = True
        self.ground.is_shadow_catcher = False
        for obj in self.bpy.data.objects:
            if obj.type == "LIGHT":
                obj.hide_render = True
        nt = s.world.node_tree
        nt.nodes.clear()
        out = nt.nodes.new("ShaderNodeOutputWorld")
        back = nt.nodes.new("ShaderNodeBackground")
        back.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        nt.links.new(back.outputs[0], out.inputs["Surface"])
        s.render.film_transparent = False
        s.view_layers[0].cycles.use_pass_shadow_catcher = False
        return self.render_passes(folder, [("Image", "passing")])["passing"]

    def aux(self, folder, id_alpha):
        """id, depth and position at pixel centres: one sample, binary alpha."""
        s = self.scene
        c = s.cycles
        saved = (c.samples, c.pixel_filter_type, c.filter_width, c.use_adaptive_sampling,
                 c.max_bounces, c.transparent_max_bounces)
        c.samples = 1
        c.pixel_filter_type = "BOX"
        c.filter_width = 0.01
        c.use_adaptive_sampling = False
        c.max_bounces = 0
        c.transparent_max_bounces = 256
        catcher = self.ground.is_shadow_catcher
        self.ground.is_shadow_catcher = False
        originals = []
        for obj in self.quads:
            mat = obj.data.materials[0]
            originals.append((obj, mat))
            cut = mat.copy()
            nt = cut.node_tree
            tex = nt.nodes["texture"]
            out = next(n for n in nt.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
            glow = nt.nodes.new("ShaderNodeEmission")
            clear = nt.nodes.new("ShaderNodeBsdfTransparent")
            mix = nt.nodes.new("ShaderNodeMixShader")
            gate = nt.nodes.new("ShaderNodeMath")
            gate.operation = "GREATER_THAN"
            gate.inputs[1].default_value = id_alpha
            nt.links.new(tex.outputs["Alpha"], gate.inputs[0])
            nt.links.new(gate.outputs[0], mix.inputs[0])
            nt.links.new(clear.outputs[0], mix.inputs[1])
            nt.links.new(glow.outputs[0], mix.inputs[2])
            nt.links.new(mix.outputs[0], out.inputs["Surface"])
            obj.data.materials[0] = cut
        layer = s.view_layers[0]
        layer.use_pass_object_index = True
        layer.use_pass_z = True
        layer.use_pass_position = True
        layer.pass_alpha_threshold = 0.5
        layer.cycles.use_pass_shadow_catcher = False
        result = self.render_passes(folder, [("IndexOB", "id"), ("Depth", "depth"),
                                             ("Position", "position")])
        for obj, mat in originals:
            cut = obj.data.materials[0]
            obj.data.materials[0] = mat
            self.bpy.data.materials.remove(cut)
        (c.samples, c.pixel_filter_type, c.filter_width, c.use_adaptive_sampling,
         c.max_bounces, c.transparent_max_bounces) = saved
        self.ground.is_shadow_catcher = catcher
        return result


def compose(passes, plate, mode):
    """Beauty, matte and shadow factor from the raw passes.

    With the Shadow Catcher pass requested, Combined holds the quads alone:
    premultiplied radiance M and coverage a, both pixel filtered.  (Without that
    pass Blender folds a grey version of the shadow into the alpha instead.)
    beauty = M + passing * S * plate, S being the Shadow Catcher pass and passing
    1 - a, or a colour of its own where there is film.
    """
    import numpy as np
    comb = passes["combined"].astype(np.float64)
    radiance = comb[..., :3]
    # Film lets each channel pass differently; Blender's alpha is the mean of them.
    passing = passes.get("passing", 1.0 - comb[..., 3:])[..., :3]
    shadow = (passes["catcher"][..., :3].astype(np.float64) if mode == "catcher"
              else np.ones_like(radiance))
    through = np.clip(1.0 - comb[..., 3], 0.0, 1.0)
    beauty = radiance.copy()
    if plate is not None:
        beauty += plate[..., :3] * shadow * np.clip(passing, 0.0, 1.0)
    one = np.ones(comb.shape[:2] + (1,))
    pack = lambda a: np.concatenate(a, axis=2).astype(np.float32)
    return (pack([beauty, one]), pack([radiance, 1.0 - through[..., None]]), pack([shadow, one]))


def run(args, spec):
    clock = Clock()
    clock.steps["interpreter"] = round(clock.last[0] - T_START, 4)
    import bpy
    try:
        import numpy as np
    except ImportError:
        raise SceneError("this Python has no numpy (Debian: install the package python3-numpy)")
    if not (3, 0, 0) <= bpy.app.version < (5, 0, 0):
        raise SceneError("needs Blender 3.x or 4.x, this is %s" % bpy.app.version_string)
    clock.mark("import_bpy")
    os.makedirs(args.out, exist_ok=True)
    out_dir = os.path.abspath(args.out)
    build = Builder(bpy, spec)
    build.settings()
    build.add_camera()
    build.add_lights()
    build.add_world()
    build.add_quads()
    build.add_ground()
    clock.mark("build_scene")

    report = {}
    if args.simulate:
        report["physics_frames"] = build.simulate()
        poses = [{"id": q["id"], "pose": q["pose"]} for q in spec["quads"]]
        path = args.poses or os.path.join(out_dir, "poses.json")
        with open(path, "w", encoding="utf-8") as handle:
            json.dump({"version": 1, "quads": poses}, handle, indent=1)
            handle.write("\n")
        clock.mark("physics")

    plate = None
    r = spec["render"]
    if "plate" in spec:
        plate = read_pixels(bpy, spec["plate"]["path"])
        if spec["plate"]["encoding"] == "srgb":
            plate = srgb_to_linear(plate)
        if plate.shape[:2] != (r["height"], r["width"]):
            plate = resample_area(plate, r["width"], r["height"])
        clock.mark("load_plate")

    passes = {}
    if not args.no_beauty:
        passes = build.beauty(out_dir)
        clock.mark("render_beauty")
    if args.aux:
        aux = build.aux(out_dir, args.id_alpha)
        for name, img in aux.items():
            write_pixels(bpy, build.scene, os.path.join(out_dir, name + ".exr"), img)
        clock.mark("aux")
    if not args.no_beauty:
        if any(has_film(q) for q in spec["quads"]):
            passes["passing"] = build.passing(out_dir)
            clock.mark("render_passing")
        beauty, matte, shadow = compose(passes, plate, spec["ground"]["mode"])
        write_pixels(bpy, build.scene, os.path.join(out_dir, "beauty.exr"), beauty)
        write_pixels(bpy, build.scene, os.path.join(out_dir, "matte.exr"), matte)
        if spec["ground"]["mode"] == "catcher":
            write_pixels(bpy, build.scene, os.path.join(out_dir, "shadow.exr"), shadow)
        if args.golden:
            write_pixels(bpy, build.scene, args.golden, beauty, "HALF")
        if args.preview:
            write_pixels(bpy, build.scene, os.path.join(out_dir, "beauty.png"),
                         linear_to_srgb(beauty).astype(np.float32), "PNG")
        clock.mark("compose_and_save")

    try:
        import resource
        report["peak_memory_mib"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, 1)
    except ImportError:                      # not available on every platform
        pass
    report["blender"] = bpy.app.version_string
    report["seconds"] = clock.steps
    report["cpu_seconds"] = clock.cpu
    report["seconds_total_in_script"] = round(time.perf_counter() - T_START, 4)
    report["scene"] = spec
    with open(os.path.join(out_dir, "report.json"), "w", encoding="utf-8") as handle:
        json.dump(report, handle, indent=1)
        handle.write("\n")
    print("done: %s" % json.dumps(clock.steps))


def main():
    argv = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    args = parse_args(argv)
    given = args.simulate or args.check or args.load_poses
    spec = load_scene(args.scene, needs_pose=not given)
    if args.load_poses:
        load_poses(args.load_poses, spec)
    if args.samples is not None:
        spec["render"]["samples"] = args.samples
    if args.size is not None:
        spec["render"]["width"], spec["render"]["height"] = args.size
    if args.threads is not None:
        spec["render"]["threads"] = args.threads
    if args.seed is not None:
        spec["render"]["seed"] = args.seed
    check_distortion(spec)
    if args.check:
        print("scene file is valid: %d quads, %d lights" % (len(spec["quads"]), len(spec["lights"])))
        return 0
    run(args, spec)
    return 0


if __name__ == "__main__":
    try:
        code = main()
    except SceneError as err:
        print("error: %s" % err, file=sys.stderr)
        code = 2
    sys.stdout.flush()
    if code or "bpy" not in sys.modules:
        sys.exit(code)
