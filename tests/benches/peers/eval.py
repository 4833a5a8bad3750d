"""petcomp eval beside pycocotools: the same files, whole programs and evaluation alone.

    python3 tests/benches/peers/eval.py --petcomp target/release/petcomp -n 5        (needs numpy, pycocotools)

Draws truth and detections for 2000 images, writes them as COCO JSON and times both; prints medians and their ratio,
and the greatest difference of the three numbers that both print.
"""

import argparse
import contextlib
import io
import json
import pathlib
import random
import statistics
import subprocess
import tempfile
import time

from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval


def draw(images, seed=1):
    rng = random.Random(seed)
    truth, found = [], []
    for image in range(1, images + 1):
        for _ in range(rng.randint(2, 20)):
            w, h = rng.randint(10, 150), rng.randint(10, 150)
            box, c = [rng.randint(0, 640 - w), rng.randint(0, 480 - h), w, h], rng.randint(1, 4)
            truth.append(dict(id=len(truth) + 1, image_id=image, category_id=c, bbox=box, area=w * h, iscrowd=0))
            for _ in range(rng.randint(0, 4)):
                near = [v + rng.uniform(-9, 9) for v in box[:2]] + [max(1, v + rng.uniform(-9, 9)) for v in box[2:]]
                found.append(dict(image_id=image, category_id=c, bbox=near, score=rng.random()))
    named = [dict(id=i, file_name=f"{i}.png", width=640, height=480) for i in range(1, images + 1)]
    classes = [dict(id=c, name=str(c)) for c in range(1, 5)]
    return dict(images=named, annotations=truth, categories=classes), found


def pycoco(truth, found):
    with contextlib.redirect_stdout(io.StringIO()):
        known = COCO(truth)
        judge = COCOeval(known, known.loadRes(found), "bbox")
        start = time.perf_counter()
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    return time.perf_counter() - start, judge.stats[:3]


def ours(program, truth, found, out):
    subprocess.run([program, "eval", found, truth, "--rounds", "0", "-o", out, "-q"], check=True)
    metrics = json.loads((pathlib.Path(out) / "metrics.json").read_text())
    ap = [c["ap"] for c in metrics["coco"]["scores"]["classes"]]
    mean = lambda values: sum(values) / len(values)
    return [mean([mean(a) for a in ap]), mean([a[0] for a in ap]), mean([a[5] for a in ap])]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--petcomp", default="target/release/petcomp")
    parser.add_argument("-n", type=int, default=5)
    parser.add_argument("--images", type=int, default=2000)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = [str(pathlib.Path(folder) / name) for name in ("truth.json", "found.json")]
        for path, data in zip(files, draw(args.images)):
            pathlib.Path(path).write_text(json.dumps(data))
        whole, alone, mine = [], [], []
        for _ in range(args.n):
            start = time.perf_counter()
            seconds, theirs = pycoco(*files)
            whole.append(time.perf_counter() - start)
            alone.append(seconds)
            start = time.perf_counter()
            us = ours(args.petcomp, *files, str(pathlib.Path(folder) / "out"))
            mine.append(time.perf_counter() - start)
    median = statistics.median
    print(f"pycocotools: {median(whole):.3f} s with reading, {median(alone):.3f} s alone")
    print(f"petcomp eval, whole program, both definitions: {median(mine):.3f} s")
    print(f"ratio {median(whole) / median(mine):.1f} (whole), {median(alone) / median(mine):.1f} (their evaluation alone)")
    print("greatest difference", max(abs(a - b) for a, b in zip(theirs, us)))


if __name__ == "__main__":
    main()
