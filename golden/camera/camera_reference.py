# Reference cameras for the rectangle solver, made by Blender.
#
#   blender -b --factory-startup -noaudio -P golden/camera/camera_reference.py -- --per-case 16 --seed 1 --out golden/camera
#
# Places cameras in front of a rectangle of known size and projects its corners twice: in double precision by the
# formulas of our conventions, and by Blender itself (32 bits). The script fails when the two disagree, so a reference is
# also a check of the conventions. Writes <out>/<category>/reference.json, one folder per kind of view.
#
#   --render-check   also renders five small pictures with Cycles and compares the centroid of the rendered rectangle with
#                    the predicted one: this pins the pixel centres, and the sign and the unit of the lens shift.
#
# Conventions: picture origin at the top-left CORNER of the top-left pixel, y down. Rectangle centred on the origin, X
# along its width, Z out of the surface, corners TL TR BR BL. R, t: P_cam = R P + t with x right, y down, z forward.

import argparse
import json
import math
import os
import random
import sys

import bpy
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector


# ------------------------------------------------------------------ algebra
def mul(A, B):
    return [[sum(a * b for a, b in zip(r, c)) for c in zip(*B)] for r in A]


def mv(A, v):
    return [sum(a * b for a, b in zip(r, v)) for r in A]


def tr(A):
    return [list(r) for r in zip(*A)]


def rot(axis, ang):
    """Rodrigues, axis of unit length."""
    x, y, z = axis
    c, s, d = math.cos(ang), math.sin(ang), 1.0 - math.cos(ang)
    return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s],
            [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d]]


FLIP = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]


# ------------------------------------------------------- camera conversions
def intrinsics_from_blender(lens, fit, sensor_w, sensor_h, shift_x, shift_y,
                            rx, ry, aspect_x=1.0, aspect_y=1.0):
    """Blender camera data -> fx, fy, cx, cy in our picture convention."""
    if fit == 'AUTO':
        horizontal = rx * aspect_x >= ry * aspect_y
        sensor = sensor_w
    else:
        horizontal = fit == 'HORIZONTAL'
        sensor = sensor_w if horizontal else sensor_h
    pix = aspect_y / aspect_x
    view = rx if horizontal else pix * ry          # the fitted side, in pixels
    fx = lens / sensor * view
    fy = fx / pix
    cx = 0.5 * rx - shift_x * view
    cy = 0.5 * ry + shift_y * view / pix
    return fx, fy, cx, cy


def matrix_world_from_rt(R, t):
    """OpenCV R,t (world -> camera) -> Blender camera matrix_world."""
    Rt = tr(R)
    C = [-v for v in mv(Rt, t)]
    B = mul(Rt, FLIP)
    return [B[0] + [C[0]], B[1] + [C[1]], B[2] + [C[2]], [0.0, 0.0, 0.0, 1.0]]


def project(K, R, t, P):
    fx, fy, cx, cy = K
    X = [a + b for a, b in zip(mv(R, P), t)]
    return [cx + fx * X[0] / X[2], cy + fy * X[1] / X[2]], X[2]


def corners3(w, h):
    return [[-w / 2, h / 2, 0.0], [w / 2, h / 2, 0.0], [w / 2, -h / 2, 0.0], [-w / 2, -h / 2, 0.0]]


# ---------------------------------------------------------------- the cases
CATEGORIES = ['general', 'steep', 'near_fronto', 'fronto', 'one_vp', 'small', 'tele', 'wide', 'shifted',
              'fit_vertical', 'portrait', 'tiny_world', 'huge_world']



def sample(rng, cat):
    rx, ry = rng.choice([(4000, 3000), (1920, 1080), (640, 480), (4032, 3024), (1000, 1000), (6000, 4000)])
    if cat == 'portrait':
        rx, ry = min(rx, ry), max(rx, ry)
    w = rng.uniform(0.2, 2.0)
    h = w * rng.choice([1.0, 0.99, 0.75, 2.0 / 3.0, 0.5, 0.25, 1.4])
    if cat == 'tiny_world':
        w, h = w * 0.01, h * 0.01
    if cat == 'huge_world':
        w, h = w * 500.0, h * 500.0
    frel = rng.uniform(0.6, 1.6)                    # focal / longest picture side
    if cat == 'tele':
        frel = rng.uniform(3.0, 8.0)
    if cat == 'wide':
        frel = rng.uniform(0.35, 0.5)
    tilt = math.radians(rng.uniform(8.0, 60.0))
    if cat == 'steep':
        tilt = math.radians(rng.uniform(60.0, 78.0))
    if cat == 'near_fronto':
        tilt = math.radians(rng.uniform(0.3, 5.0))
    if cat == 'fronto':
        tilt = 0.0
    az = rng.uniform(0.0, 2.0 * math.pi)
    if cat == 'one_vp':
        az = rng.choice([0.0, 0.5 * math.pi])       # tilt about a side: one pair of sides stays parallel
    roll = rng.uniform(0.0, 2.0 * math.pi)
    fill = 0.02 if cat == 'small' else rng.uniform(0.4, 0.85)
    shift = (rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2)) if cat == 'shifted' else (0.0, 0.0)
    fit = 'VERTICAL' if cat == 'fit_vertical' else rng.choice(['AUTO', 'AUTO', 'HORIZONTAL'])
    sensor_w, sensor_h = rng.choice([(36.0, 24.0), (6.4, 4.8), (23.5, 15.6)])
    view = {'AUTO': max(rx, ry), 'HORIZONTAL': rx, 'VERTICAL': ry}[fit]
    sensor = sensor_h if fit == 'VERTICAL' else sensor_w
    # Blender keeps these as 32-bit floats: round first, so that both sides use the same number
    f32 = Vector((frel * max(rx, ry) * sensor / view, shift[0], shift[1]))
    lens, shift = f32[0], (f32[1], f32[2])
    sensor_w, sensor_h = Vector((sensor_w, sensor_h))
    K = intrinsics_from_blender(lens, fit, sensor_w, sensor_h, shift[0], shift[1], rx, ry)
    f = K[0]
    R = mul(mul(rot((0.0, 0.0, 1.0), roll), FLIP), rot((math.cos(az), math.sin(az), 0.0), tilt))
    # distance: the larger of width/height extents fills the wanted part of the picture
    q = [mv(R, P) for P in corners3(w, h)]
    lo, hi = 1.05 * max(abs(v[2]) for v in q) + 1e-4 * w, 1e5 * w
    for _ in range(200):
        d = math.sqrt(lo * hi)
        xs = [f * v[0] / (v[2] + d) for v in q]
        ys = [f * v[1] / (v[2] + d) for v in q]
        if max((max(xs) - min(xs)) / rx, (max(ys) - min(ys)) / ry) > fill:
            lo = d
        else:
            hi = d
    d = hi
    xs = [f * v[0] / (v[2] + d) for v in q]
    ys = [f * v[1] / (v[2] + d) for v in q]
    # move the picture of the rectangle somewhere inside the frame, with the camera above the surface
    for _ in range(100):
        ox = rng.uniform(0.02 * rx - K[2] - min(xs), 0.98 * rx - K[2] - max(xs))
        oy = rng.uniform(0.02 * ry - K[3] - min(ys), 0.98 * ry - K[3] - max(ys))
        t = [ox * d / f, oy * d / f, d]
        if -sum(R[i][2] * t[i] for i in range(3)) > 0.05 * d:
            break
    else:
        ox, oy = 0.5 * rx - K[2] - 0.5 * (min(xs) + max(xs)), 0.5 * ry - K[3] - 0.5 * (min(ys) + max(ys))
        t = [ox * d / f, oy * d / f, d]
    return dict(rx=rx, ry=ry, w=w, h=h, R=R, t=t, K=K, lens=lens, shift=shift, fit=fit,
                sensor=(sensor_w, sensor_h), tilt=math.degrees(tilt))


def apply_to_blender(s, cam_obj, scene):
    cd = cam_obj.data
    cd.type = 'PERSP'
    cd.lens_unit = 'MILLIMETERS'
    cd.sensor_fit = s['fit']
    cd.sensor_width, cd.sensor_height = s['sensor']
    cd.lens = s['lens']
    cd.shift_x, cd.shift_y = s['shift']
    cd.clip_start, cd.clip_end = 1e-4 * s['t'][2], 100.0 * s['t'][2]
    r = scene.render
    r.resolution_x, r.resolution_y, r.resolution_percentage = s['rx'], s['ry'], 100
    r.pixel_aspect_x = r.pixel_aspect_y = 1.0
    r.use_border = False
    cam_obj.matrix_world = Matrix(matrix_world_from_rt(s['R'], s['t']))
    bpy.context.view_layer.update()


def case(rng, cat, cam_obj, scene):
    while True:
        s = sample(rng, cat)
        P = corners3(s['w'], s['h'])
        px = [project(s['K'], s['R'], s['t'], p)[0] for p in P]
        if min(math.dist(a, b) for i, a in enumerate(px) for b in px[:i]) > 3.0:
            break
    apply_to_blender(s, cam_obj, scene)
    bpx = []
    for p in P:
        v = world_to_camera_view(scene, cam_obj, Vector(p))
        bpx.append([round(v[0] * s['rx'], 4), round((1.0 - v[1]) * s['ry'], 4)])
    diff = max(math.dist(a, b) for a, b in zip(px, bpx))
    # points above the surface: 1/10 of the short side above five places
    checks = []
    for gx, gy in ((0, 0), (-0.4, 0.4), (0.4, 0.4), (0.4, -0.4), (-0.4, -0.4)):
        p = [gx * s['w'], gy * s['h'], 0.1 * min(s['w'], s['h'])]
        checks.append(dict(point=p, px=project(s['K'], s['R'], s['t'], p)[0]))
    fx, _, cx, cy = s['K']
    M = [[round(v, 9) if abs(v) < 100 else v for v in r] for r in cam_obj.matrix_world][:3]
    return diff / max(s['rx'], s['ry']), dict(
        image=[s['rx'], s['ry']], size=[s['w'], s['h']], corners_px=px, corners_px_blender=bpx, checks=checks,
        focal_px=fx, principal_px=[cx, cy], R=s['R'], t=s['t'], tilt_deg=s['tilt'],
        blender=dict(sensor_fit=s['fit'], sensor=list(s['sensor']), lens=s['lens'], shift=list(s['shift']), matrix_world=M))


# ------------------------------------------------------------- render check
def render_check(cam_obj, scene, out_dir, keep):
    """Rendered rectangle against the formulas; returns the worst centroid difference in pixels."""
    w, h = 0.6, 0.4
    me = bpy.data.meshes.new('rect')
    me.from_pydata(corners3(w, h), [], [(0, 3, 2, 1)])
    ob = bpy.data.objects.new('rect', me)
    scene.collection.objects.link(ob)
    mat = bpy.data.materials.new('glow')
    mat.use_nodes = True
    nt = mat.node_tree
    nt.nodes.clear()
    out = nt.nodes.new('ShaderNodeOutputMaterial')
    em = nt.nodes.new('ShaderNodeEmission')
    em.inputs[0].default_value = (1.0, 1.0, 1.0, 1.0)
    nt.links.new(em.outputs[0], out.inputs[0])
    me.materials.append(mat)
    world = bpy.data.worlds.new('black')
    world.use_nodes = True
    world.node_tree.nodes['Background'].inputs[0].default_value = (0.0, 0.0, 0.0, 1.0)
    scene.world = world
    scene.render.engine = 'CYCLES'
    scene.cycles.device = 'CPU'
    scene.cycles.samples = 128
    scene.cycles.use_denoising = False
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.pixel_filter_type = 'BOX'
    scene.view_settings.view_transform = 'Raw'
    scene.render.dither_intensity = 0.0
    st = scene.render.image_settings
    st.file_format, st.color_mode, st.color_depth = 'OPEN_EXR', 'RGB', '32'
    worst = 0.0
    setups = [(320, 240, 'AUTO', 0.0, 0.0), (320, 240, 'AUTO', 0.11, -0.07), (240, 320, 'AUTO', 0.03, 0.02),
              (320, 240, 'VERTICAL', 0.05, 0.09), (240, 320, 'HORIZONTAL', 0.1, 0.05)]
    R = mul(mul(rot((0.0, 0.0, 1.0), 0.3), FLIP), rot((math.cos(0.7), math.sin(0.7), 0.0), 0.45))
    for i, (rx, ry, fit, sx, sy) in enumerate(setups):
        lens = 20.0
        K = intrinsics_from_blender(lens, fit, 36.0, 24.0, sx, sy, rx, ry)
        s = dict(rx=rx, ry=ry, fit=fit, sensor=(36.0, 24.0), lens=lens, shift=(sx, sy), R=R, t=[0.02, 0.01, 1.1], K=K)
        apply_to_blender(s, cam_obj, scene)
        path = os.path.join(out_dir, 'camera_check_%d.exr' % i)
        scene.render.filepath = path
        bpy.ops.render.render(write_still=True)
        img = bpy.data.images.load(path)
        buf = list(img.pixels)
        ch = img.channels
        S = X = Y = 0.0
        for row in range(ry):                        # Blender keeps the bottom row first
            for col in range(rx):
                v = buf[(row * rx + col) * ch]
                S += v
                X += v * (col + 0.5)
                Y += v * (ry - row - 0.5)
        bpy.data.images.remove(img)
        if not keep:
            os.remove(path)
        q = [project(K, R, s['t'], p)[0] for p in corners3(w, h)]
        assert all(0 < x < rx and 0 < y < ry for x, y in q), 'rectangle leaves the picture'
        A = gx = gy = 0.0
        for (x0, y0), (x1, y1) in zip(q, q[1:] + q[:1]):
            c = x0 * y1 - x1 * y0
            A, gx, gy = A + c / 2, gx + (x0 + x1) * c / 6, gy + (y0 + y1) * c / 6
        e = math.hypot(X / S - gx / A, Y / S - gy / A)
        print('render check %d  %s %dx%d shift %.2f %.2f  centroid difference %.5f px' % (i, fit, rx, ry, sx, sy, e))
        worst = max(worst, e)
    return worst


def main():
    argv = sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else []
    ap = argparse.ArgumentParser()
    ap.add_argument('--per-case', type=int, default=16)
    ap.add_argument('--seed', type=int, default=1)
    ap.add_argument('--out', default='golden/camera')
    ap.add_argument('--render-check', action='store_true')
    a = ap.parse_args(argv)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    cam = bpy.data.objects.new('cam', bpy.data.cameras.new('cam'))
    scene.collection.objects.link(cam)
    scene.camera = cam
    worst = 0.0
    for cat in CATEGORIES:
        rng = random.Random('%d %s' % (a.seed, cat))
        diffs, cases = zip(*[case(rng, cat, cam, scene) for _ in range(a.per_case)])
        worst = max(worst, *diffs)
        os.makedirs(os.path.join(a.out, cat), exist_ok=True)
        with open(os.path.join(a.out, cat, 'reference.json'), 'w') as fh:
            head = dict(format='camera-golden', version=1, blender=bpy.app.version_string, seed=a.seed, category=cat)
            fh.write(json.dumps(head)[:-1] + ', "cases": [\n')
            fh.write(',\n'.join(json.dumps(c, separators=(',', ':')) for c in cases) + '\n]}\n')
    print('worst formula-vs-Blender difference, relative to the longest side:', worst)
    centroid_px = render_check(cam, scene, a.out, False) if a.render_check else 0.0
    # a 32-bit pipeline: a few units in the last place of the longest side
    if worst > 5e-6 or centroid_px > 0.01:
        print('FAILED: formulas and Blender disagree')
        sys.exit(1)


main()
