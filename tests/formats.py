"""Checks a dataset with the programs that it was written for: formats.py CHECK FOLDER, run by tests/formats.rs."""

import glob
import json
import pathlib
import sys

# Annotations of one image have this many ids, as the writer documents.
IDS_PER_IMAGE = 1 << 16


def coco(folder):
    import contextlib
    import io

    import numpy as np
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    pixels = json.loads((folder / "pixels.json").read_text())
    count, crowd = 0, 0
    for part in ["train", "val"]:
        truth = COCO(str(folder / f"annotations/instances_{part}.json"))
        assert truth.getCatIds() == [1, 2], truth.getCatIds()
        names = sorted(path.name for path in (folder / "images" / part).iterdir())
        assert sorted(image["file_name"] for image in truth.loadImgs(truth.getImgIds())) == names
        for annotation in truth.loadAnns(truth.getAnnIds()):
            image, number = divmod(annotation["id"], IDS_PER_IMAGE)
            assert image == annotation["image_id"]
            found = truth.annToMask(annotation).astype(bool)
            expected = np.zeros_like(found)
            x, y = np.array(pixels[f"{image}/{number}"]).T
            expected[y, x] = True
            assert (found == expected).all(), (annotation["id"], (found != expected).sum())
            assert annotation["area"] == expected.sum()
            left, top, width, height = annotation["bbox"]
            assert (left, top, left + width, top + height) == (x.min(), y.min(), x.max() + 1, y.max() + 1)
            count, crowd = count + 1, crowd + annotation["iscrowd"]
        # The truth as its own detections is found whole.
        own = [dict(a, score=0.9) for a in truth.loadAnns(truth.getAnnIds(iscrowd=False))]
        for kind in ["bbox", "segm"]:
            evaluation = COCOeval(truth, truth.loadRes(own), kind)
            evaluation.evaluate()
            evaluation.accumulate()
            with contextlib.redirect_stdout(io.StringIO()):
                evaluation.summarize()
            assert abs(evaluation.stats[0] - 1) < 1e-9, evaluation.stats
    assert count > 10 and crowd > 0
    print(f"pycocotools: {count} annotations, {crowd} crowd, every mask and box as it was, AP 1.0")


def ultralytics(folder, is_segment):
    from ultralytics.data.utils import check_det_dataset, verify_image_label

    data = check_det_dataset(str(folder / "data.yaml"), autodownload=False)
    found, rows, outlines = 0, 0, 0
    for part in ["train", "val"]:
        for image in sorted(glob.glob(f"{data[part]}/*")):
            label = image.replace("/images/", "/labels/").rsplit(".", 1)[0] + ".txt"
            answer = verify_image_label((image, label, "", False, data["nc"], 0, 0, False))
            assert answer[0] is not None and answer[-2] == 0 and not answer[-1], answer
            found, rows, outlines = found + 1, rows + len(answer[1]), outlines + len(answer[3])
    assert found == 12 and rows > 10 and outlines == (rows if is_segment else 0), (found, rows, outlines)
    print(f"ultralytics: {found} images, {rows} rows, {outlines} outlines, none refused; names {data['names']}")


def yolov5(folder):
    from yolov5.utils.dataloaders import verify_image_label

    rows = 0
    for image in sorted(glob.glob(f"{folder}/images/*/*")):
        label = image.replace("/images/", "/labels/").rsplit(".", 1)[0] + ".txt"
        answer = verify_image_label((image, label, ""))
        assert answer[0] is not None and answer[-2] == 0 and not answer[-1], answer
        rows += len(answer[1])
    assert rows > 10
    print(f"yolov5: {rows} rows, none refused")


def webdataset(folder):
    import webdataset

    for part, numbers in [("train", [1, 2, 3, 4, 6, 7, 8, 9, 11]), ("val", [0, 5, 10])]:
        archives = sorted(map(str, (folder / "webdataset").glob(f"{part}-*.tar")))
        samples = list(webdataset.WebDataset(archives, shardshuffle=False))
        assert [int(sample["__key__"]) for sample in samples] == numbers
        for sample in samples:
            key = f"{int(sample['__key__']):06}"
            assert sample["png"] == (folder / f"images/{part}/{key}.png").read_bytes()
            assert sample["txt"] == (folder / f"labels/{part}/{key}.txt").read_bytes()
            assert json.loads(sample["json"])["index"] == json.loads(sample["coco.json"])["image"]["id"] == int(key)
    print("webdataset: 12 samples in order, their files unchanged")


def mot(folder):
    """Tracks of the truth are without error, and not where objects change their numbers."""
    for part in ["train", "val"]:
        sequences = folder / "mot" / part
        names = sorted(path.name for path in sequences.iterdir())
        for name in names:
            rows = [line.split(",") for line in (sequences / name / "gt/gt.txt").read_text().splitlines()]
            for tracker, numbers in [("own", lambda row: row[1]), ("forgetful", lambda row: row[0] + row[1])]:
                lines = [",".join([row[0], numbers(row), *row[2:6], "0.9,-1,-1,-1"]) + "\n" for row in rows]
                found = folder / "trackers" / part / tracker / "data" / f"{name}.txt"
                found.parent.mkdir(parents=True, exist_ok=True)
                found.write_text("".join(lines))
        scores = track_scores(sequences, folder / "trackers" / part, names)
        assert scores["own"] == {"HOTA": 1, "MOTA": 1, "IDF1": 1}, scores
        assert scores["forgetful"]["IDF1"] < 0.6, scores
        print(f"trackeval: {part}: {len(names)} sequences, {scores}")


def track_scores(truth, trackers, names):
    import contextlib
    import io

    import trackeval

    map_of_sequences = trackers / "sequences.txt"
    map_of_sequences.write_text("\n".join(["name", *names]) + "\n")
    settings = {"GT_FOLDER": str(truth), "TRACKERS_FOLDER": str(trackers), "SEQMAP_FILE": str(map_of_sequences)}
    settings |= {"TRACKERS_TO_EVAL": ["own", "forgetful"], "DO_PREPROC": False, "SKIP_SPLIT_FOL": True}
    quiet = {"PRINT_RESULTS": False, "OUTPUT_SUMMARY": False, "OUTPUT_DETAILED": False, "PLOT_CURVES": False}
    with contextlib.redirect_stdout(io.StringIO()):
        sequences = trackeval.datasets.MotChallenge2DBox(settings)
        metrics = [trackeval.metrics.HOTA(), trackeval.metrics.CLEAR(), trackeval.metrics.Identity()]
        found, _ = trackeval.Evaluator(quiet | {"BREAK_ON_ERROR": True}).evaluate([sequences], metrics)
    scores = {}
    for tracker, of_tracker in found["MotChallenge2DBox"].items():
        whole = of_tracker["COMBINED_SEQ"]["pedestrian"]
        scores[tracker] = {
            "HOTA": round(float(whole["HOTA"]["HOTA"].mean()), 9),
            "MOTA": round(float(whole["CLEAR"]["MOTA"]), 9),
            "IDF1": round(float(whole["Identity"]["IDF1"]), 9),
        }
    return scores


def kubernetes(folder):
    import kubernetes_validate
    import yaml

    job = yaml.safe_load((folder / "kubernetes_job.yaml").read_text())
    version = kubernetes_validate.validate(job, kubernetes_validate.latest_version(), strict=True)
    print(f"kubernetes: the job is one of version {version}")


if __name__ == "__main__":
    check, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    {
        "coco": lambda: coco(folder),
        "detect": lambda: ultralytics(folder, False),
        "segment": lambda: ultralytics(folder, True),
        "yolov5": lambda: yolov5(folder),
        "mot": lambda: mot(folder),
        "webdataset": lambda: webdataset(folder),
        "kubernetes": lambda: kubernetes(folder),
    }[check]()
