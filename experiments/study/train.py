"""Trains a detector and runs it on the test pictures.

    python -m study.train TRAINING.json

The file contains all settings (see `study.describe`). An interrupted training resumes from its last
checkpoint. Detections are written to `predictions/ROOM/NAME.txt` next to the file, then
`training.done.json`.
"""

import functools
import json
import random
import sys
import time
from pathlib import Path

import cv2
import torch
import ultralytics
from ultralytics import YOLO
from ultralytics.data.dataset import YOLODataset
from ultralytics.models.yolo.detect import DetectionTrainer
from ultralytics.nn.tasks import DetectionModel

from . import augment, files

# Equation 2 is that of `petcomp dataset train-kit`.
sys.path.append(str(Path(__file__).parents[2] / "src/train/kit"))
import balanced

# Checkpoints of a training: what an interruption loses at most is one part of it.
PARTS = 10
# Parts at the end without mosaics, so that the detector sees whole pictures too.
WHOLE_PICTURE_PARTS = 2
# Parts at the end with real pictures alone, where the arm asks for fine-tuning.
FINE_TUNING_PARTS = 3
# A detector is asked for everything it has, as average precision wants it.
LEAST_CONFIDENCE = 0.001
MOST_DETECTIONS = 100


def main(path):
    training = json.loads(path.read_text())
    torch.backends.cudnn.benchmark = True
    cv2.setNumThreads(1)
    began = time.process_time()
    weights = train(training, path.parent)
    seconds = time.process_time() - began
    for room, pictures in training["test"].items():
        predict(training, weights, pictures, path.parent / "predictions" / room)
    done = {"cpu_seconds": round(seconds, 1), "ultralytics": ultralytics.__version__, "torch": torch.__version__}
    if on_gpu(training):
        done["device"] = torch.cuda.get_device_name()
    files.write_json(path.with_suffix(".done.json"), done)


def train(training, folder):
    """Train; return the path of the last weights."""
    last = folder / "detector/weights/last.pt"
    if last.exists() and is_finished(last):
        return last
    trainer(training, folder)(overrides=settings(training, folder, last)).train()
    return last


def is_finished(last):
    """Whether the checkpoint is of the last part, so that nothing is left to resume."""
    return torch.load(last, map_location="cpu", weights_only=False)["epoch"] in (PARTS - 1, -1)


def settings(training, folder, last):
    if last.exists():
        return {"resume": str(last), "model": str(last)}
    return {
        "model": training["model"],
        "pretrained": training["start"] or False,
        "data": str(data_file(training, folder)),
        "epochs": PARTS,
        "batch": training["batch"],
        "nbs": training["batch"],
        "imgsz": training["image_size"],
        "single_cls": training["classes"] == 1,
        "seed": training["seed"],
        "device": training["device"],
        "amp": on_gpu(training) and "bf16",
        "deterministic": not on_gpu(training),
        "close_mosaic": WHOLE_PICTURE_PARTS,
        "optimizer": "AdamW",
        "lr0": 0.002,
        "warmup_bias_lr": 0.0,
        "warmup_epochs": 0.3,
        "cos_lr": True,
        "cache": "ram",
        "workers": 0,
        "val": False,
        "plots": False,
        "verbose": False,
        "project": str(folder),
        "name": "detector",
        "exist_ok": True,
    }


def on_gpu(training):
    return training["device"] != "cpu"


def data_file(training, folder):
    """Write the list of pictures that Ultralytics requires; the real batches come from `Streams`."""
    pictures = training["real"] or training["synthetic"]
    list_file(folder, "few", pictures[: training["batch"]])
    names = "".join(f"  {k}: {name}\n" for k, name in enumerate(files.CLASSES))
    text = f"path: {folder}\ntrain: few.txt\nval: few.txt\nnames:\n{names}"
    return files.write_text(folder / "data.yaml", text)


def list_file(folder, name, pictures):
    return str(files.write_text(folder / f"{name}.txt", "\n".join(pictures) + "\n"))


class Model(DetectionModel):
    """A model that computes its loss with 16-bit floats also on CPUs that support them (AVX-512); Ultralytics does so
    only on GPUs. Other CPUs are eight times as slow with them."""

    def loss(self, batch, preds=None):
        is_quick = torch.ops.mkldnn._is_mkldnn_bf16_supported()
        with torch.autocast("cpu", torch.bfloat16, enabled=is_quick):
            return super().loss(batch, preds)


class Streams(torch.utils.data.Sampler):
    """The batches of a part: indices into [real pictures..., synthetic pictures...].

    Each source is an endless stream of shuffled passes that depends only on the seed, so a resumed
    training sees the same pictures as an uninterrupted one.
    """

    def __init__(self, training, part):
        self.training, self.part, self.batch = training, part, training["batch"]
        self.counts = [len(training["real"]), len(training["synthetic"])]

    def __len__(self):
        return self.training["images"] // PARTS // self.batch

    def __iter__(self):
        return map(self.indices, self.numbers())

    def numbers(self):
        """Numbers of the batches of the part."""
        first = self.part() * len(self)
        return range(first, first + len(self))

    def indices(self, number):
        size, mix = self.batch, self.training["mix"]
        if mix == "concatenate":
            return self.stream("all", sum(self.counts), number * size, size)
        if mix == "equation2":
            return self.single_source_batch(number)
        if mix == "fine_tune":
            return self.balanced_then_real(number)
        return self.both(number, 0.5 if mix == "balanced" else mix)

    def both(self, number, real_share):
        """A batch with a share from each source."""
        real, synthetic = self.counts
        of_real = round(real_share * self.batch)
        of_synthetic = self.batch - of_real
        theirs = [real + k for k in self.stream("synthetic", synthetic, number * of_synthetic, of_synthetic)]
        return self.stream("real", real, number * of_real, of_real) + theirs

    def balanced_then_real(self, number):
        """A batch of both sources, or near the end of real pictures only."""
        if number < (PARTS - FINE_TUNING_PARTS) * len(self):
            return self.both(number, 0.5)
        return self.stream("fine_tuning", self.counts[0], number * self.batch, self.batch)

    def single_source_batch(self, number):
        """A batch of one source; batches alternate randomly, in proportion to the sources' numbers of pictures."""
        real, synthetic = self.counts
        size = self.batch
        is_real = [slot < real for slot in self.stream("order", real + synthetic, 0, number + 1)]
        earlier = sum(is_real[number] == other for other in is_real[:number])
        if is_real[number]:
            return self.stream("real", real, earlier * size, size)
        return [real + k for k in self.stream("synthetic", synthetic, earlier * size, size)]

    def stream(self, name, count, first, length):
        return [self.shuffled(name, count, at // count)[at % count] for at in range(first, first + length)]

    # Every index asks for the whole pass that it is in.
    @functools.cache
    def shuffled(self, name, count, turn):
        rng = random.Random(f"{self.training['seed']} {name} {turn}")
        return rng.sample(range(count), count)


def trainer(training, folder):
    """Ultralytics' trainer with our batches, and equation 2 of the paper if the arm uses it."""
    factors = loss_factors(training)
    real = set(training["real"])

    class Trainer(balanced.WeightedLoss, DetectionTrainer):
        def get_model(self, cfg=None, weights=None, verbose=True):
            # Ultralytics, which leaves one processor idle, has just set it.
            torch.set_num_threads(training["threads"])
            model = Model(cfg, nc=self.data["nc"], ch=self.data["channels"], verbose=False)
            if weights:
                model.load(weights)
            return model.to(memory_format=torch.channels_last)

        def build_optimizer(self, *args, **kwargs):
            optimizer = super().build_optimizer(*args, **kwargs)
            for group in optimizer.param_groups:
                # 1.5 ms less for each image on a CPU.
                group["fused"] = not on_gpu(training)
            return optimizer

        def get_dataloader(self, dataset_path, batch_size=16, rank=0, mode="train"):
            sources = [name for name in ("real", "synthetic") if training[name]]
            streams = Streams(training, lambda: self.epoch)
            if on_gpu(training):
                # Nothing is validated, and trainings side by side would write the same cache of labels.
                names = sources if mode == "train" else []
                if names and batch_size != training["batch"]:
                    raise MemoryError(f"a batch of {training['batch']} is too large for the GPU; see --processes")
                pictures = [augment.Pictures(training[name], training["classes"], self.device) for name in names]
                return augment.Loader(pictures, streams, training["image_size"], training["seed"])
            if mode != "train":
                return super().get_dataloader(dataset_path, batch_size, rank, mode)
            lists = [list_file(folder, name, training[name]) for name in sources]
            parts = [self.build_dataset(source, mode, batch_size) for source in lists]
            return balanced.Loader(balanced.Both(parts), batch_sampler=streams, collate_fn=YOLODataset.collate_fn)

        def preprocess_batch(self, batch):
            batch = super().preprocess_batch(batch)
            batch["img"] = batch["img"].contiguous(memory_format=torch.channels_last)
            self.factor = factors[batch["im_file"][0] not in real]
            return batch

        def validate(self):
            return {}, 0.0

        def final_eval(self):
            """Do nothing: the trainer does not use the test pictures."""

    return Trainer


def loss_factors(training):
    if training["mix"] != "equation2":
        return (1.0, 1.0)
    return balanced.weights(len(training["real"]), len(training["synthetic"]))


def predict(training, weights, pictures, folder):
    folder.mkdir(parents=True, exist_ok=True)
    found = YOLO(weights).predict(
        pictures,
        stream=True,
        imgsz=training["image_size"],
        conf=LEAST_CONFIDENCE,
        max_det=MOST_DETECTIONS,
        device=training["device"],
        verbose=False,
    )
    for picture, result in zip(pictures, found):
        boxes = zip(result.boxes.cls.tolist(), result.boxes.xywhn.tolist(), result.boxes.conf.tolist())
        rows = [f"{int(c)} {' '.join(f'{v:.6f}' for v in box)} {p:.6f}\n" for c, box, p in boxes]
        files.write_text(folder / f"{Path(picture).stem}.txt", "".join(rows))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
