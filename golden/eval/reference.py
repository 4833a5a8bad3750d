"""Average precision by pycocotools and by YOLOv5's own code, for boxes drawn here.

    python3 golden/eval/reference.py            (needs numpy, pycocotools, torch and yolov5 7.0.14)

Each case is a folder with boxes.json (truth: image class x y w h crowd; found: image class x y w h score) and
reference.json. YOLOv5 sorts by confidence with an unstable sort; here NumPy is told to keep the order of equal ones,
which is one of the orders that it may give. Objects that are there twice are left out for the same reason: which of
two equal overlaps YOLOv5 takes changes from box to box.
"""

import contextlib
import io
import json
import pathlib
import random

import numpy
import pycocotools
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

HERE = pathlib.Path(__file__).parent
SIDE = 640


def box(rng, least=8, most=200):
    w, h = rng.randint(least, most), rng.randint(least, most)
    return [rng.randint(0, SIDE - w), rng.randint(0, SIDE - h), w, h]


def near(rng, b, spread):
    x, y, w, h = b
    move = lambda v: v + rng.randint(-spread, spread)
    return [move(x), move(y), max(1, move(w)), max(1, move(h))]


def draw(seed, images, classes, truths, miss=0.2, noise=3, spread=12, levels=10000, crowd=0.0, least=8, most=200):
    rng = random.Random(seed)
    truth, found = [], []
    score = lambda: rng.randint(1, levels) / levels
    for image in range(images):
        for _ in range(rng.randint(*truths)):
            c, b = rng.randrange(classes), box(rng, least, most)
            truth.append([image, c, *b, int(rng.random() < crowd)])
            while rng.random() > miss:
                other = rng.random() < 0.1
                found.append([image, rng.randrange(classes) if other else c, *near(rng, b, spread), score()])
                if rng.random() < 0.7:
                    break
        for _ in range(rng.randint(0, noise)):
            found.append([image, rng.randrange(classes), *box(rng, least, most), score()])
    return {"images": images, "classes": classes, "truth": truth, "found": found}


def cases():
    yield "random", "four classes, forty images", draw(1, 40, 4, (0, 8))
    yield "one_image", "a single image", draw(2, 1, 2, (5, 5))
    yield "one_class", "a single class with few errors", draw(3, 30, 1, (1, 4), miss=0.05, noise=0, spread=4)
    yield "ties", "confidences of four values only", draw(4, 40, 3, (0, 6), levels=4)
    yield "crowds", "a third of the truth counts for nobody", draw(5, 40, 3, (0, 8), crowd=0.33)
    yield "small_objects", "boxes from one pixel on", draw(6, 40, 2, (0, 8), least=1, most=24, spread=2)
    yield "large_objects", "boxes as large as the image", draw(7, 20, 2, (0, 4), least=300, most=640, spread=60)
    yield "thousands", "more than a hundred detections an image", draw(8, 6, 2, (120, 130), noise=90)
    empty = draw(9, 10, 2, (1, 4))
    yield "nothing_found", "no detection at all", {**empty, "found": []}
    yield "nothing_there", "no object at all", {**empty, "truth": []}
    same = draw(10, 10, 2, (2, 4))
    twice = [[*f] for f in same["found"] for _ in range(2)]
    yield "doubled", "every detection is there twice", {**same, "found": twice}
    flat = [[0, 0, 10, 10, 0, 50, 0], [0, 0, 100, 100, 40, 40, 0], [1, 1, 5, 5, 0, 0, 0]]
    seen = [[0, 0, 10, 10, 0, 50, 0.9], [0, 0, 100, 100, 40, 40, 0.8], [0, 0, 100, 100, 40, 0, 0.7], [1, 1, 5, 5, 0, 0, 0.6]]
    yield "degenerate", "boxes without area", {"images": 2, "classes": 2, "truth": flat, "found": seen}


def coco(data):
    images = [{"id": i + 1, "file_name": f"{i}.png", "width": SIDE, "height": SIDE} for i in range(data["images"])]
    truth = [
        {"id": k + 1, "image_id": i + 1, "category_id": c + 1, "bbox": b, "area": b[2] * b[3], "iscrowd": crowd}
        for k, (i, c, *b, crowd) in enumerate(data["truth"])
    ]
    found = [
        {"image_id": i + 1, "category_id": c + 1, "bbox": b, "score": s} for i, c, *b, s in data["found"]
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        known = COCO()
        known.dataset = {
            "info": {}, "images": images, "annotations": truth,
            "categories": [{"id": c + 1, "name": str(c)} for c in range(data["classes"])],
        }
        known.createIndex()
        seen = known.loadRes(found) if found else COCO()
        if not found:
            seen.dataset = {**known.dataset, "annotations": []}
            seen.createIndex()
        judge = COCOeval(known, seen, "bbox")
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    per_class = judge.eval["precision"][:, :, :, 0, 2].mean(1).T  # class, threshold; -1 without truth
    return {"stats": judge.stats.tolist(), "ap": per_class.tolist()}


def yolov5(data):
    import torch
    from yolov5.utils.metrics import ap_per_class
    from yolov5.val import process_batch

    iouv = torch.linspace(0.5, 0.95, 10)
    stats = []
    corners = lambda b: [b[0], b[1], b[0] + b[2], b[1] + b[3]]
    for image in range(data["images"]):
        there = [[c, *corners(b), crowd] for i, c, *b, crowd in data["truth"] if i == image]
        truth = torch.tensor([row[:5] for row in there if not row[5]], dtype=torch.float32)
        found = [[*corners(b), s, c] for i, c, *b, s in data["found"] if i == image]
        found = torch.tensor(sorted(found, key=lambda d: -d[4]), dtype=torch.float32).reshape(-1, 6)
        truth = truth.reshape(-1, 5)
        right = process_batch(found, truth, iouv) if len(truth) else torch.zeros(len(found), 10, dtype=torch.bool)
        crowds = torch.tensor([row[:5] for row in there if row[5]], dtype=torch.float32).reshape(-1, 5)
        ignored = ~right & (share_in(crowds, found)[:, None] >= iouv)
        stats.append((right, ignored, found[:, 4], found[:, 5], truth[:, 0]))
    right, ignored, score, seen, wanted = [torch.cat(part, 0).numpy() for part in zip(*stats)]
    if not len(wanted):
        return {"classes": [], "ap": [], "precision": [], "recall": []}
    # YOLOv5 knows no crowds: at each threshold it is shown what COCO's rule leaves of the detections.
    at = [ap_per_class(right[kept, j : j + 1], score[kept], seen[kept], wanted, names={}) for j, kept in enumerate(~ignored.T)]
    _, _, p, r, _, _, classes = at[0]
    ap = numpy.concatenate([scores[5] for scores in at], 1)
    return {"classes": classes.tolist(), "ap": ap.tolist(), "precision": p.tolist(), "recall": r.tolist()}


def share_in(crowds, found):
    """The largest share of each detection that a crowd of its class covers."""
    import torch

    lows = torch.maximum(found[:, None, :2], crowds[None, :, 1:3])
    highs = torch.minimum(found[:, None, 2:4], crowds[None, :, 3:5])
    inside = (highs - lows).clamp(min=0).prod(2)
    area = (found[:, 2:4] - found[:, :2]).prod(1)[:, None]
    share = inside / area.clamp(min=1e-12) * (found[:, None, 5] == crowds[None, :, 0])
    return torch.cat([share, torch.zeros(len(found), 1)], 1).max(1).values


def stable_argsort():
    plain = numpy.argsort
    numpy.argsort = lambda a, *args, **kwargs: plain(a, kind="stable")


def about(name, text):
    return f'''about = "{text}"

[reference]
program = "pycocotools and yolov5"
version = "{version(pycocotools)} and 7.0.14"
script = "golden/eval/reference.py"

[tolerance]
# The issue's own bound; YOLOv5 works in single precision.
fail = 1e-6
'''


def version(module):
    from importlib.metadata import version as of

    return of(module.__name__)


def main():
    stable_argsort()
    if not hasattr(numpy, "trapz"):
        numpy.trapz = numpy.trapezoid  # renamed in NumPy 2
    for name, text, data in cases():
        folder = HERE / name
        folder.mkdir(exist_ok=True)
        (folder / "case.toml").write_text(about(name, text))
        (folder / "boxes.json").write_text(json.dumps(data, separators=(",", ":")) + "\n")
        reference = {"coco": coco(data), "yolov5": yolov5(data)}
        (folder / "reference.json").write_text(json.dumps(reference, separators=(",", ":")) + "\n")
        print(name, len(data["truth"]), "there,", len(data["found"]), "found")


if __name__ == "__main__":
    main()
