#!/usr/bin/env python3
"""Settles the same heaps in Bullet and in petcomp, side by side.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/settle.py [-o FOLDER]

`petcomp-report settle --peers` draws and settles three heaps each of 20 and of 5 cards (also of 60 with `--counts 20 5 60`,
which takes minutes per round). Bullet gets the same boxes, masses, friction, damping, walls and starts, in three settings:
its own defaults; petcomp's time step with the scale recommended for small bodies (lengths and gravity times ten); and the
same scale with a smaller step and more iterations. It stops like petcomp: when all bodies are slower than 1 cm/s and
0.5 rad/s for 0.1 s, or after 10 s. Seconds are those of one heap in memory: petcomp (library.rs) including its check of the
result, Bullet including calls from Python, two per body and step. Overlap, the deepest of three heaps, is measured for both
by the separating-axis test below, in double precision.
"""
import json

import numpy as np

from side_by_side import INSIDE, Comparison, arguments, here, library, library_seconds, pinned, seconds_of, told, version

TIMES = 3
# When petcomp calls a heap at rest or gives it up, and its damping (src/settle/world).
SLOW, SLOW_TURN, STILL, LIMIT = 0.01, 0.5, 0.1, 10.0
DAMPING = 0.5
WALL = 0.5
SETTINGS = {
    "1/240 s, its default": dict(step=1 / 240, iterations=50, scale=1.0),
    "1/360 s, x10": dict(step=1 / 360, iterations=50, scale=10.0),
    "1/960 s, x10, 200": dict(step=1 / 960, iterations=200, scale=10.0),
}


def start(obj):
    drop = obj["placement"]["drop"]
    return [*drop["above"], drop["height"]], drop["rotation"]


def rest(obj):
    at = obj["placement"]["at"]
    return at["translation"], at["rotation"]


def world(p, case, step, iterations, scale):
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
        p.changeDynamics(body, -1, linearDamping=DAMPING, angularDamping=DAMPING, **touch)
        bodies.append(body)
    return bodies


def fall(p, case, step, iterations, scale):
    """Return the final poses in metres, and whether the heap came to rest."""
    bodies = world(p, case, step, iterations, scale)
    still, steps, rested = 0.0, 0, False
    while steps * step < LIMIT and not rested:
        p.stepSimulation()
        steps += 1
        speeds = [p.getBaseVelocity(body) for body in bodies]
        slow = all(np.dot(v, v) < (SLOW * scale) ** 2 and np.dot(w, w) < SLOW_TURN**2 for v, w in speeds)
        still = still + step if slow else 0.0
        rested = still >= STILL
    poses = [p.getBasePositionAndOrientation(body) for body in bodies]
    return [([v / scale for v in position], rotation) for position, rotation in poses], rested


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
    """Return the deepest overlap with another body, the floor or a wall, metres, and the number of bodies outside."""
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


def judged(cases, ends):
    """Return the worst result of several heaps."""
    overlaps, outside = zip(*(judge(poses, case) for case, (poses, _) in zip(cases, ends)))
    return {"error": 1e3 * max(overlaps), "outside": sum(outside), "at_rest": sum(rested for _, rested in ends)}


def petcomps(comparison, args, heaps):
    program = library()
    for count, cases in heaps.items():
        scenes = []
        for k, case in enumerate(cases):
            scenes.append(args.output / "settle" / f"{count}_{k}.json")
            scenes[-1].write_text(json.dumps(case["scene"]))
        ends = [([rest(obj) for obj in case["settled"]["objects"]], True) for case in cases]
        setting = f"default, {count} cards"
        add(comparison, "petcomp", version([args.petcomp, "--version"]), setting, told(pinned(program, TIMES, "settle", *scenes)),
            lambda scenes=scenes: library_seconds(program, TIMES, "settle", *scenes) / len(scenes), cases, ends, setting)


def bullets(comparison, heaps):
    import importlib.metadata
    import pybullet as p
    p.connect(p.DIRECT)
    for count, cases in heaps.items():
        for name, setting in SETTINGS.items():
            ends = []
            def run(ends=ends, cases=cases, setting=setting):
                seconds, ends[:] = here(lambda: [fall(p, case, **setting) for case in cases])
                return seconds / len(cases)
            add(comparison, "Bullet", importlib.metadata.version("pybullet"), f"{name}, {count} cards", f"pybullet.stepSimulation() with {setting}",
                run, cases, ends, f"default, {count} cards")


def add(comparison, program, tells, setting, command, run, cases, ends, beside):
    comparison.add(program, tells, setting, command, run, lambda: judged(cases, ends)["error"], beside,
                   lambda: {key: judged(cases, ends)[key] for key in ("outside", "at_rest")})


def main():
    parser = arguments(__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=[20, 5], help="cards per heap: 5, 20 or 60")
    args = parser.parse_args()
    (args.output / "settle").mkdir(parents=True, exist_ok=True)
    drawn = args.output / "settle" / "heaps.json"
    seconds_of(pinned(args.report, "-q", "-j", 1, "settle", "--peers", drawn))
    cases = json.loads(drawn.read_text())
    heaps = {count: [case for case in cases if len(case["boxes"]) == count] for count in args.counts}
    comparison = Comparison("settle", args, INSIDE, "heaps of cards that fall into a tray", "deepest overlap, mm",
                            "bodies that do not sink into each other")
    petcomps(comparison, args, heaps)
    with comparison.absent_if_it_fails("Bullet"):
        bullets(comparison, heaps)
    comparison.finish()


if __name__ == "__main__":
    main()
