#!/usr/bin/env python3
"""Average precision of the same detections: `petcomp eval`, pycocotools and, if installed, YOLOv5's own code.

    make peers
    taskset -c 0 target/peers-python/bin/python tests/benches/peers/eval.py [-o FOLDER] [--images N]

Ground truth and detections of 2000 images are random and written as COCO JSON. eval.json times the work in memory: reading
both files, evaluating, summing up (petcomp by library.rs, the COCO definition; pycocotools called from Python).
eval_commands.json times whole processes: petcomp with both definitions, its tables and images; Python with its imports.
Error: the greatest difference of mean AP, AP at 0.5 and AP at 0.75 from those of pycocotools. YOLOv5 defines AP differently
and is compared with its own definition in petcomp. Its package needs PyTorch; if missing, it is listed as absent.
"""

import contextlib
import io
import json
import pathlib
import random
import sys

import numpy as np

from side_by_side import INSIDE, WHOLE, Comparison, arguments, here, library, library_seconds, pinned, seconds_of, spent, \
    told, version

CLASSES, TIMES = 4, 3


def draw(images, seed=1):
    rng = random.Random(seed)
    truth, found = [], []
    for image in range(1, images + 1):
        for _ in range(rng.randint(2, 20)):
            w, h = rng.randint(10, 150), rng.randint(10, 150)
            box, c = [rng.randint(0, 640 - w), rng.randint(0, 480 - h), w, h], rng.randint(1, CLASSES)
            truth.append(dict(id=len(truth) + 1, image_id=image, category_id=c, bbox=box, area=w * h, iscrowd=0))
            for _ in range(rng.randint(0, 4)):
                near = [v + rng.uniform(-9, 9) for v in box[:2]] + [max(1, v + rng.uniform(-9, 9)) for v in box[2:]]
                found.append(dict(image_id=image, category_id=c, bbox=near, score=rng.random()))
    named = [dict(id=i, file_name=f"{i}.png", width=640, height=480) for i in range(1, images + 1)]
    classes = [dict(id=c, name=str(c)) for c in range(1, CLASSES + 1)]
    return dict(images=named, annotations=truth, categories=classes), found


def pycocotools_stats(truth, found):
    """Mean AP, AP at 0.5 and at 0.75."""
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval
    with contextlib.redirect_stdout(io.StringIO()):
        known = COCO(str(truth))
        judge = COCOeval(known, known.loadRes(str(found)), "bbox")
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    return list(map(float, judge.stats[:3]))


def petcomp_stats(out, definition="coco"):
    metrics = json.loads((out / "metrics.json").read_text())[definition]
    ap = np.array([c["ap"] for c in metrics.get("scores", metrics)["classes"]])
    return [ap.mean(), ap[:, 0].mean(), ap[:, 5].mean()]


def yolov5_stats(truth, found):
    """YOLOv5's validation without the detector: match boxes image by image, then compute its average precision."""
    import torch
    np.trapz = np.trapezoid  # the name that YOLOv5 7.0 knows it by
    from yolov5.utils.metrics import ap_per_class
    from yolov5.val import process_batch
    boxes = lambda rows: torch.tensor([[x, y, x + w, y + h] for x, y, w, h in (row["bbox"] for row in rows)]).reshape(-1, 4)
    def by_image(rows):
        images = {}
        for row in rows:
            images.setdefault(row["image_id"], []).append(row)
        return images
    thresholds = torch.linspace(0.5, 0.95, 10)
    truths, founds = by_image(json.loads(truth.read_text())["annotations"]), by_image(json.loads(found.read_text()))
    stats = []
    for image, labels in truths.items():
        rows = sorted(founds.get(image, []), key=lambda row: -row["score"])
        classes = lambda rows: torch.tensor([row["category_id"] - 1.0 for row in rows])
        scores = torch.tensor([row["score"] for row in rows])
        right = torch.zeros(len(rows), 10, dtype=torch.bool)
        if rows:
            detections = torch.cat([boxes(rows), scores[:, None], classes(rows)[:, None]], 1)
            right = process_batch(detections, torch.cat([classes(labels)[:, None], boxes(labels)], 1), thresholds)
        stats.append((right, scores, classes(rows), classes(labels)))
    ap = ap_per_class(*(torch.cat(column).numpy() for column in zip(*stats)), names=dict.fromkeys(range(CLASSES)))[5]
    return [float(ap.mean()), float(ap[:, 0].mean()), float(ap[:, 5].mean())]


def apart(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def in_memory(args, files, described):
    comparison = Comparison("eval", args, INSIDE, described, "greatest difference of three APs", "pycocotools")
    out, program = args.output / "eval" / "petcomp", library()
    words = [program, TIMES, "eval", files["found"], files["truth"]]
    seconds_of(pinned(args.petcomp, "-q", "eval", files["found"], files["truth"], "--rounds", 0, "-o", out))
    theirs = [petcomp_stats(out)]  # where there is no pycocotools, nothing differs from it
    ours, yolos = petcomp_stats(out), []
    comparison.add("petcomp", version([args.petcomp, "--version"]), "default", told(pinned(*words)),
                   lambda: library_seconds(*words), lambda: apart(ours, theirs[-1]))

    def called(stats, kept):
        seconds, value = here(lambda: stats(files["truth"], files["found"]))
        kept.append(value)
        return seconds

    with comparison.absent_if_it_fails("pycocotools"):
        import importlib.metadata
        comparison.add("pycocotools", importlib.metadata.version("pycocotools"), "bbox", "COCOeval(truth, found, 'bbox')",
                       lambda: called(pycocotools_stats, theirs), lambda: 0.0)
    with comparison.absent_if_it_fails("YOLOv5"):
        import yolov5
        comparison.add("YOLOv5", yolov5.__version__, "process_batch, ap_per_class", "yolov5.utils.metrics.ap_per_class(..)",
                       lambda: called(yolov5_stats, yolos), lambda: apart(yolos[-1], petcomp_stats(out, "yolov5")))
    comparison.finish()


def commands(args, files, described):
    comparison = Comparison("eval commands", args, WHOLE, described, "greatest difference of three APs", "pycocotools")
    out, theirs = args.output / "eval" / "petcomp", [None]
    ours = pinned(args.petcomp, "-q", "eval", files["found"], files["truth"], "--rounds", 0, "-o", out)
    other = pinned(sys.executable, pathlib.Path(__file__).resolve().relative_to(pathlib.Path.cwd()), "--alone", files["truth"],
                   files["found"])

    def alone():
        seconds, said = spent(other)
        theirs[0] = json.loads(said)
        return seconds

    comparison.add("petcomp", version([args.petcomp, "--version"]), "default, both definitions and a report", told(ours),
                   lambda: seconds_of(ours), lambda: apart(petcomp_stats(out), theirs[0] or petcomp_stats(out)))
    with comparison.absent_if_it_fails("pycocotools"):
        import importlib.metadata
        comparison.add("pycocotools", importlib.metadata.version("pycocotools"), "bbox", told(other), alone, lambda: 0.0)
    comparison.finish()


def main():
    parser = arguments(__doc__)
    parser.add_argument("--images", type=int, default=2000)
    parser.add_argument("--alone", type=pathlib.Path, nargs=2, help="only print pycocotools' numbers for TRUTH FOUND, as JSON")
    args = parser.parse_args()
    if args.alone:
        return print(json.dumps(pycocotools_stats(*args.alone)))
    folder = args.output / "eval"
    folder.mkdir(parents=True, exist_ok=True)
    files = {name: folder / f"{name}.json" for name in ("truth", "found")}
    for path, data in zip(files.values(), draw(args.images)):
        path.write_text(json.dumps(data))
    described = f"boxes and detections of {args.images} images"
    in_memory(args, files, described)
    commands(args, files, described)


if __name__ == "__main__":
    main()
