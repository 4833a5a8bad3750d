"""Equation 2 of the paper for PyTorch: batches from one source each, with weighted loss.

Run as a program to train an Ultralytics detector on the images of combined.yaml:

    python balanced.py --epochs 300 --batch 32 --seed 1 --name combined/1

With `--real-share 0.125`, that share of every batch is real and the loss is not weighted. If there are few real images,
this keeps them from being seen too often. With `--data real.yaml`, or another list of the kit, the same detector is
trained with the same settings in the ordinary way, for comparison.

Import it as a module for other training loops: `SingleSource` and `Shares` are batch samplers, `weights` returns the
loss factor of each source.
"""

import argparse
import itertools
import json
import pathlib
import random

import torch

HERE = pathlib.Path(__file__).resolve().parent
COMBINED = "combined.yaml"
REAL, SYNTHETIC = 0, 1


def weights(real, synthetic, alpha=0.5, normalize=False):
    """Loss factors for batches of real and of synthetic images; `real` and `synthetic` are the sizes of the sets."""
    scale = (real + synthetic) * (1.0 if normalize else 0.5)
    return scale / real * alpha, scale / synthetic * (1 - alpha)


class SingleSource(torch.utils.data.Sampler):
    """Batches of indices into [real images..., synthetic images...], each from one source; reshuffled every epoch."""

    def __init__(self, real, synthetic, batch, seed=0):
        self.parts, self.batch, self.seed, self.epoch = (range(real), range(real, real + synthetic)), batch, seed, 0

    def __iter__(self):
        rng = random.Random(self.seed * 1_000_003 + self.epoch)
        self.epoch += 1
        batches = []
        for part in self.parts:
            order = rng.sample(part, len(part))
            batches += [order[i : i + self.batch] for i in range(0, len(order), self.batch)]
        rng.shuffle(batches)
        return iter(batches)

    def __len__(self):
        return sum(-(-len(part) // self.batch) for part in self.parts)


class Shares(torch.utils.data.Sampler):
    """Batches with a fixed share of real images, which are reshuffled whenever all have been seen. An epoch is one pass
    over the synthetic images. `epoch` returns its number; pass it if the trainer counts epochs, since some trainers
    request more batches than they use."""

    def __init__(self, real, synthetic, batch, share, seed=0, epoch=None):
        self.real, self.synthetic, self.batch, self.seed = real, synthetic, batch, seed
        self.epoch = epoch or itertools.count().__next__
        self.of_real = round(share * batch)
        if not 0 < self.of_real < batch:
            raise ValueError(f"share {share}: {self.of_real} of {batch} images are real, expected some of both")

    def __iter__(self):
        epoch = self.epoch()
        rng = random.Random(self.seed * 1_000_003 + epoch)
        # A pass over the real images continues in the next epoch, so that all are seen equally often.
        real = self.passes(epoch * len(self) * self.of_real)
        order = rng.sample(range(self.real, self.real + self.synthetic), self.synthetic)
        size = self.batch - self.of_real
        for i in range(0, len(order), size):
            yield [*itertools.islice(real, self.of_real), *order[i : i + size]]

    def __len__(self):
        return -(-self.synthetic // (self.batch - self.of_real))

    def passes(self, first):
        """Yield real images endlessly, starting at position `first` of all passes."""
        for number in itertools.count(first // self.real):
            order = random.Random(f"{self.seed} {number}").sample(range(self.real), self.real)
            yield from order[max(0, first - number * self.real) :]


class Both(torch.utils.data.ConcatDataset):
    """Both sources, each with its own mosaics, so that no image mixes the two."""

    @property
    def labels(self):
        return [label for part in self.datasets for label in part.labels]

    def close_mosaic(self, hyp):
        for part in self.datasets:
            part.close_mosaic(hyp)


class Loader(torch.utils.data.DataLoader):
    """A loader for Ultralytics' trainer whose sampler yields whole batches."""

    # PyTorch sets None if a sampler yields batches, but the trainer divides by it.
    batch_size = property(lambda self: self.batch_sampler.batch, lambda self, value: None)

    def reset(self):
        """Do nothing: workers restart every epoch anyway."""


class WeightedLoss:
    """Mix-in for a trainer: multiplies the loss of each batch by the `factor` that `preprocess_batch` sets."""

    # The training loop assigns the loss of the batch here before the backward pass; the model stays Ultralytics' own.
    loss = property(lambda self: self.weighted, lambda self, value: self.weigh(value))

    def weigh(self, value):
        self.weighted = value * self.factor if torch.is_tensor(value) else value
        self.factor = 1.0  # once a batch


def ultralytics_trainer(batch_size, seed, real_share=None):
    """Return an Ultralytics trainer class that follows equation 2 or has a share of real images in each batch."""
    from ultralytics.data.dataset import YOLODataset
    from ultralytics.models.yolo.detect import DetectionTrainer

    balance = json.loads((HERE / "balance.json").read_text())
    factors = (balance["weights"]["real"], balance["weights"]["synthetic"])
    real = frozenset((HERE / "real_train.txt").read_text().split("\n"))

    class Balanced(WeightedLoss, DetectionTrainer):
        factor = 1.0

        def get_dataloader(self, dataset_path, batch_size=batch_size, rank=0, mode="train"):
            if mode != "train":
                return super().get_dataloader(dataset_path, batch_size, rank, mode)
            lists = [str(HERE / name) for name in ("real_train.txt", "synthetic_train.txt")]
            parts = [self.build_dataset(path, mode, batch_size) for path in lists]
            counts = map(len, parts)
            if real_share is None:
                sampler = SingleSource(*counts, batch_size, seed)
            else:
                sampler = Shares(*counts, batch_size, real_share, seed, lambda: self.epoch)
            return Loader(
                Both(parts), batch_sampler=sampler, num_workers=self.args.workers, collate_fn=YOLODataset.collate_fn
            )

        def preprocess_batch(self, batch):
            batch = super().preprocess_batch(batch)
            if real_share is not None:
                return batch
            sources = {REAL if path in real else SYNTHETIC for path in batch["im_file"]}
            if len(sources) != 1:
                raise ValueError("a batch mixes real and synthetic images")
            self.factor = factors[sources.pop()]
            return batch

    return Balanced


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--data", default=COMBINED, help="data file in this folder; default: %(default)s, balanced")
    parser.add_argument("--model", default="yolov5su.pt", help="default: %(default)s, pretrained on COCO; the paper's on ImageNet")
    parser.add_argument("--epochs", type=int, default=300)
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument(
        "--real-share", type=float,
        help="share of real images per batch, between 0 and 1; default: batches of one source, weighted",
    )
    parser.add_argument("--img", type=int, default=640)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=8)
    parser.add_argument("--device", default=None)
    parser.add_argument("--name", default="combined")
    args = parser.parse_args()
    if args.data != COMBINED and args.real_share is not None:
        parser.error(f"--real-share: given with {args.data}, expected {COMBINED}")
    settings = dict(
        model=args.model, data=str(HERE / args.data), epochs=args.epochs, batch=args.batch, imgsz=args.img,
        seed=args.seed, workers=args.workers, device=args.device, name=args.name, project=str(HERE / "runs"),
        optimizer="SGD", lr0=0.01, lrf=0.2, momentum=0.937, weight_decay=0.0005, warmup_epochs=3.0, cos_lr=True,
        mosaic=1.0, hsv_h=0.015, hsv_s=0.7, hsv_v=0.4, fliplr=0.5, close_mosaic=0,
    )
    trainer_of(args)(overrides=settings).train()


def trainer_of(args):
    if args.data == COMBINED:
        return ultralytics_trainer(args.batch, args.seed, args.real_share)
    from ultralytics.models.yolo.detect import DetectionTrainer

    return DetectionTrainer


if __name__ == "__main__":
    main()
