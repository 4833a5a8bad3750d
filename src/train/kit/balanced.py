"""Equation 2 of the paper in a PyTorch training: batches of one source each, their loss weighted.

As a program it trains an Ultralytics detector on the images that combined.yaml lists:

    python balanced.py --epochs 300 --batch 32 --seed 1 --name combined/1

or, with `--real-share 0.125`, of batches in which that share is real, unweighted: where real images are few, that keeps
them from being seen too often. With `--data real.yaml`, or another list of the kit, the same detector is trained with
the same settings in the ordinary way, to compare with.

As a module it serves any other loop: `SingleSource` and `Shares` are batch samplers, `weights` gives the factor per source.
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
    """Factors on the loss of a batch of real and of synthetic images; `real`, `synthetic` are the sets' sizes."""
    scale = (real + synthetic) * (1.0 if normalize else 0.5)
    return scale / real * alpha, scale / synthetic * (1 - alpha)


class SingleSource(torch.utils.data.Sampler):
    """Lists of indices into [real images..., synthetic images...], each list from one source; new order every epoch."""

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
    """The same, each list with a share of real images, which are shuffled anew whenever all were seen; an epoch is one
    pass over the synthetic ones. `epoch` gives its number, where a trainer counts them: some ask for more lists than they
    use."""

    def __init__(self, real, synthetic, batch, share, seed=0, epoch=None):
        self.real, self.synthetic, self.batch, self.seed = real, synthetic, batch, seed
        self.epoch = epoch or itertools.count().__next__
        self.of_real = round(share * batch)
        if not 0 < self.of_real < batch:
            raise ValueError(f"share {share}: {self.of_real} of {batch} images are real, expected some of both")

    def __iter__(self):
        epoch = self.epoch()
        rng = random.Random(self.seed * 1_000_003 + epoch)
        # A pass over the real images goes on in the next epoch, so that all are seen equally often.
        real = self.passes(epoch * len(self) * self.of_real)
        order = rng.sample(range(self.real, self.real + self.synthetic), self.synthetic)
        size = self.batch - self.of_real
        for i in range(0, len(order), size):
            yield [*itertools.islice(real, self.of_real), *order[i : i + size]]

    def __len__(self):
        return -(-self.synthetic // (self.batch - self.of_real))

    def passes(self, first):
        """Real images without end, from the one on that is `first` of all passes."""
        for number in itertools.count(first // self.real):
            order = random.Random(f"{self.seed} {number}").sample(range(self.real), self.real)
            yield from order[max(0, first - number * self.real) :]


class Both(torch.utils.data.ConcatDataset):
    """Each source keeps its own mosaic, so that no picture mixes the two."""

    @property
    def labels(self):
        return [label for part in self.datasets for label in part.labels]

    def close_mosaic(self, hyp):
        for part in self.datasets:
            part.close_mosaic(hyp)


class Loader(torch.utils.data.DataLoader):
    """What Ultralytics' trainer asks of a loader whose sampler gives whole batches."""

    # Torch says None where batches come from a sampler of batches; the trainer divides by it.
    batch_size = property(lambda self: self.batch_sampler.batch, lambda self, value: None)

    def reset(self):
        """Workers start anew with every epoch: nothing to do."""


class WeightedLoss:
    """For a trainer: the loss of each batch times the `factor` that `preprocess_batch` sets."""

    # The training loop assigns the batch's loss here before it goes backward; the model stays Ultralytics' own.
    loss = property(lambda self: self.weighted, lambda self, value: self.weigh(value))

    def weigh(self, value):
        self.weighted = value * self.factor if torch.is_tensor(value) else value
        self.factor = 1.0  # once a batch


def ultralytics_trainer(batch_size, seed, real_share=None):
    """An Ultralytics trainer class that follows equation 2, or has a share of real images in each batch."""
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
