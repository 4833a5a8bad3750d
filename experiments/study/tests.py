"""Tests that need no training: `python -m unittest study.tests` in the folder of the experiments."""

import importlib.util
import tempfile
import unittest
import unittest.mock
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np

from . import archive, bootstrap, chance, files, main, results, score

# Half of an interval of 95 %, in standard deviations.
REACH = 1.96


class Intervals(unittest.TestCase):
    def test_one_training_has_chance_too(self):
        matches = {"real": {0: {"21": [some_matches()]}}}
        over_pictures = results.over_pictures(matches)
        drawn = results.with_chance(over_pictures, matches)
        self.assertGreater(width(drawn["real"]), width(over_pictures["real"]))

    def test_chance_by_number_of_trainings(self):
        for trainings in (1, 4):
            drawn = bootstrap.with_chance("real", np.ones(500), trainings)
            low, high = bootstrap.interval(drawn)
            reach = REACH * bootstrap.TRAINING_DEVIATION / np.sqrt(trainings)
            self.assertAlmostEqual((high - 1) / reach, 1, delta=0.05)
            self.assertAlmostEqual((1 - low) / reach, 1, delta=0.05)

    def test_arms_share_pictures_and_not_chance(self):
        arm = {0: {"21": [some_matches()]}}
        over_pictures = results.over_pictures({"real": arm, "alike": arm})
        np.testing.assert_array_equal(over_pictures["real"], over_pictures["alike"])
        drawn = results.with_chance(over_pictures, {"real": arm, "alike": arm})
        reach = REACH * bootstrap.TRAINING_DEVIATION * np.sqrt(2)
        self.assertAlmostEqual(width(drawn["alike"] / drawn["real"]) / (2 * reach), 1, delta=0.05)

    def test_deviation_is_of_the_first_rooms(self):
        seeds = chance.of_seeds(archive.rows(main.HERE / "results/first_rooms"))
        deviation, freedom = chance.pooled(seeds.values())
        self.assertAlmostEqual(deviation, bootstrap.TRAINING_DEVIATION, places=4)
        self.assertEqual(freedom, 6)


class Check(unittest.TestCase):
    def test_the_headline_is_welcome_where_nothing_is_trained(self):
        """Called without a name, as by `make experiment` and in README.md."""
        for rooms, test_pictures in ((None, None), ([24], 40)):
            with self.subTest(rooms=rooms), tempfile.TemporaryDirectory() as cache:
                check_headline(Path(cache), rooms, test_pictures)


def check_headline(cache, rooms, test_pictures):
    options = SimpleNamespace(
        headline=True, screening=None, gpu=False, rooms=rooms, test_pictures=test_pictures, name=None, seeds=None
    )
    study = main.full(options, cache, None)
    main.check_planned(study, main.kept(study), main.chosen(options, study.arms), options.seeds)


@unittest.skipUnless(importlib.util.find_spec("torch"), "PyTorch is not there")
class Augmented(unittest.TestCase):
    """Tests of the augmentation for GPUs, run on the CPU."""

    @unittest.mock.patch("study.augment.LEAST_AREA", 0)
    @unittest.mock.patch("study.augment.LEAST_SIDE", 0)
    @unittest.mock.patch("study.augment.MOST_ASPECT", np.inf)
    def test_boxes_cover_what_was_in_them(self):
        from . import augment

        with tempfile.TemporaryDirectory() as folder:
            pictures = augment.Pictures([red_rectangle(Path(folder), name) for name in range(4)], 1, "cpu")
            loader = augment.Loader([pictures], SimpleNamespace(batch=4), 160, seed=0)
            for is_mosaic in (True, False):
                loader.is_mosaic = is_mosaic
                batch = loader.made(np.random.default_rng(1), [0, 1, 2, 3])
                is_red = (batch["img"][:, 0] - batch["img"][:, 2] > 15).numpy()
                self.assertGreater(is_red.sum(), 1000)
                self.assertTrue(is_red[boxed(batch, -1)].all())
                self.assertFalse((is_red & ~boxed(batch, 1)).any())

    def test_colours_change_as_with_opencv(self):
        import torch

        from . import augment

        rng = np.random.default_rng(0)
        image, gains = rng.uniform(0, 255, (2, 3, 8, 8)).astype(np.float32), rng.uniform(-0.4, 0.4, (2, 3))
        changed = augment.recoloured(torch.from_numpy(image), gains).numpy()
        for before, after, gain in zip(image, changed, gains):
            hsv = cv2.cvtColor(np.ascontiguousarray(before.transpose(1, 2, 0)) / 255, cv2.COLOR_RGB2HSV)
            hsv = (hsv + (360 * gain[0], 0, 0)) * (1, 1 + gain[1], 1 + gain[2])
            expected = np.dstack([hsv[..., 0] % 360, hsv[..., 1:].clip(0, 1)]).astype(np.float32)
            rgb = 255 * cv2.cvtColor(expected, cv2.COLOR_HSV2RGB)
            np.testing.assert_allclose(after.transpose(1, 2, 0), rgb, atol=0.01)


def red_rectangle(folder, name):
    """Write a black picture with a red rectangle, and its label."""
    picture = np.zeros((120, 160, 3), np.uint8)
    left, top = 20 * name, 10 * name
    picture[top : top + 40, left : left + 80] = (0, 0, 255)
    path = folder / f"images/{name}.png"
    path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(path), picture)
    files.write_text(files.label_of(path), f"0 {(left + 40) / 160} {(top + 20) / 120} {80 / 160} {40 / 120}\n")
    return str(path)


def boxed(batch, margin):
    """Mask of the boxes, enlarged by `margin` pixels on each side."""
    mask = np.zeros((len(batch["img"]), *batch["img"].shape[2:]), bool)
    for owner, (x, y, width, height) in zip(batch["batch_idx"].int(), batch["bboxes"].numpy() * 160):
        mask[owner, side(y, height / 2 + margin), side(x, width / 2 + margin)] = True
    return mask


def side(centre, reach):
    return slice(max(0, round(centre - reach)), max(0, round(centre + reach)))


def some_matches(pictures=20):
    """Matches of one box per picture, found in every other picture."""
    right = np.repeat(np.arange(pictures) % 2 == 0, len(score.IOUS)).reshape(pictures, -1)
    return score.Matches(np.arange(pictures), right, np.ones(pictures))


def width(values):
    low, high = bootstrap.interval(values)
    return high - low


if __name__ == "__main__":
    unittest.main()
