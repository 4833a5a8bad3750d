#!/usr/bin/env python3
"""Settles the same heaps in Bullet and in petcomp, side by side.

    petcomp report settle --peers heaps.json
    python3 -m venv venv && venv/bin/pip install pybullet numpy
    taskset -c 0 venv/bin/python tests/benches/peers/settle.py heaps.json

Both run on one thread. Bullet gets the same boxes, masses, friction, walls and starts, in three settings: its own
defaults; petcomp's step and the scale that is recommended for small bodies (lengths times ten, gravity too); and that
with a larger solver effort. It stops as petcomp does: all bodies slower than 1 cm/s and 0.5 rad/s for 0.5 s, or after
30 s. Overlap is measured for both by the separating-axis test below, in double precision.
"""
import json
import statistics
import sys
import time

import numpy as np
import pybullet as p

RUNS = 5
SLOW, SLOW_TURN, STILL, LIMIT = 0.01, 0.5, 0.5, 30.0
WALL = 0.5
SETTINGS = {
    "bullet 1/240 s": dict(step=1 / 240, iterations=50, scale=1.0),
    "bullet 1/480 s, x10": dict(step=1 / 480, iterations=50, scale=10.0),
    "bullet 1/960 s, x10, 200": dict(step=1 / 960, iterations=200, scale=10.0),
}


def start(obj):
    drop = obj["placement"]["drop"]
    return [*drop["above"], drop["height"]], drop["rotation"]


def rest(obj):
    at = obj["placement"]["at"]
    return at["translation"], at["rotation"]


def world(case, step, iterations, scale):
    scene = case["scene"]
    p.resetSimulation()
    p.setGravity(0, 0, -9.81 * scale)
    p.setPhysicsEngineParameter(fixedTimeStep=step, numSolverIterations=iterations, deterministicOverlappingPairs=1)
    touch = dict(lateralFriction=np.sqrt(scene["surface"].get("friction", 0.5)), restitution=0.0)  # Bullet multiplies the two.
    x, y = (side / 2 * scale for side in scene["surface"]["size"])
    high, wide, thick = 5 * scale, max(x, y) + 2 * WALL * scale, WALL * scale
    slabs = [((0, 0, -thick), (wide, wide, thick)), ((x + thick, 0, high), (thick, wide, high)), ((-x - thick, 0, high), (thick, wide, high)),
             ((0, y + thick, high), (wide, thick, high)), ((0, -y - thick, high), (wide, thick, high))]
    for at, half in slabs:
        body = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=half), basePosition=at)
        p.changeDynamics(body, -1, **touch)
    bodies = []
    for obj, size in zip(scene["objects"], case["boxes"]):
        position, rotation = start(obj)
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[side / 2 * scale for side in size])
        body = p.createMultiBody(obj["mass"], shape, basePosition=[v * scale for v in position], baseOrientation=rotation)
        # Bullet's margin is inside a box; its default of 4 cm is cut to the box's size by itself.
        p.changeDynamics(body, -1, linearDamping=0.1, angularDamping=0.5, **touch)
        bodies.append(body)
    return bodies


def fall(case, step, iterations, scale):
    """Poses at the end in metres, seconds simulated (none where it did not rest), seconds it took, those of the steps alone."""
    before = time.perf_counter()
    bodies = world(case, step, iterations, scale)
    still, steps, rested, stepping = 0.0, 0, False, 0.0
    while steps * step < LIMIT and not rested:
        a = time.perf_counter()
        p.stepSimulation()
        stepping += time.perf_counter() - a
        steps += 1
        speeds = [p.getBaseVelocity(body) for body in bodies]
        slow = all(np.dot(v, v) < (SLOW * scale) ** 2 and np.dot(w, w) < SLOW_TURN**2 for v, w in speeds)
        still = still + step if slow else 0.0
        rested = still >= STILL
    poses = [p.getBasePositionAndOrientation(body) for body in bodies]
    poses = [([v / scale for v in position], rotation) for position, rotation in poses]
    return poses, steps * step if rested else None, time.perf_counter() - before, stepping


def axes(rotation):
    x, y, z, w = rotation
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]).T


def depth(a, b):
    (ca, ra, ha), (cb, rb, hb) = a, b
    directions = [*ra, *rb] + [np.cross(e, f) for e in ra for f in rb]
    least = np.inf
    for d in directions:
        length = np.linalg.norm(d)
        if length > 1e-6:
            d = d / length
            least = min(least, np.abs(ra @ d) @ ha + np.abs(rb @ d) @ hb - abs((cb - ca) @ d))
    return max(least, 0.0)


def judge(poses, case):
    """Deepest overlap with another body, the floor or a wall, metres; number of bodies outside."""
    solids = [(np.array(t), axes(q), np.array(size) / 2) for (t, q), size in zip(poses, case["boxes"])]
    room = np.array(case["scene"]["surface"]["size"]) / 2
    outside = sum(bool(np.any(np.abs(c[:2]) > room) or c[2] < 0) for c, _, _ in solids)
    deepest = 0.0
    for i, (c, r, h) in enumerate(solids):
        extent = np.abs(r.T) @ h
        deepest = max(deepest, extent[2] - c[2], *(np.abs(c[:2]) + extent[:2] - room))
        for other in solids[:i]:
            if np.linalg.norm(c - other[0]) < np.linalg.norm(h) + np.linalg.norm(other[2]):
                deepest = max(deepest, depth(solids[i], other))
    return deepest, outside


def main():
    cases = json.load(open(sys.argv[1]))
    p.connect(p.DIRECT)
    print("| heap | program | rests after s | overlap mm | outside | time ms (median of 5) | steps alone ms |\n|" + " --- |" * 7)
    for case in cases:
        overlap, outside = judge([rest(obj) for obj in case["settled"]["objects"]], case)
        ms = statistics.median(case["wall_ms"])
        print(f"| {case['name']} | petcomp | yes | {overlap * 1e3:.3f} | {outside} | {ms:.1f} | |")
        for name, setting in SETTINGS.items():
            runs = [fall(case, **setting) for _ in range(RUNS)]
            overlap, outside = judge(runs[0][0], case)
            ms, steps = (statistics.median(run[k] for run in runs) * 1e3 for k in (2, 3))
            seconds = "no" if runs[0][1] is None else f"{runs[0][1]:.2f}"
            print(f"| {case['name']} | {name} | {seconds} | {overlap * 1e3:.3f} | {outside} | {ms:.1f} | {steps:.1f} |", flush=True)


if __name__ == "__main__":
    main()
