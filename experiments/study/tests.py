"""Tests that need no training: `python -m unittest study.tests` in the folder of the experiments."""

import importlib.util
import tempfile
import unittest
import unittest.mock
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np

from . import archive, bootstrap, chance, files, main, page, results, score, study as studies

# Half of an interval of 95 %, in standard deviations known with `bootstrap.FREEDOM` degrees of freedom.
STUDENT = 2.120


class Intervals(unittest.TestCase):
    def test_one_training_has_chance_too(self):
        matches = {"real": {0: {"21": [some_matches()]}}}
        over_pictures = results.over_pictures(matches)
        drawn = results.with_chance(over_pictures, matches)
        self.assertGreater(width(drawn["real"]), width(over_pictures["real"]))

    def test_chance_by_number_of_trainings_and_rooms(self):
        for trainings, rooms in ((1, 1), (1, 3), (4, 3)):
            drawn = bootstrap.with_chance("real", np.ones(500), trainings, rooms)
            low, high = bootstrap.interval(drawn, 1)
            reach = STUDENT * bootstrap.deviation(rooms) / np.sqrt(trainings)
            self.assertAlmostEqual((high - 1) / reach, 1, delta=0.05)
            self.assertAlmostEqual((1 - low) / reach, 1, delta=0.05)

    def test_arms_share_pictures_and_not_chance(self):
        arm = {0: {"21": [some_matches()]}}
        over_pictures = results.over_pictures({"real": arm, "alike": arm})
        np.testing.assert_array_equal(over_pictures["real"], over_pictures["alike"])
        drawn = results.with_chance(over_pictures, {"real": arm, "alike": arm})
        reach = STUDENT * bootstrap.deviation(1) * np.sqrt(2)
        self.assertAlmostEqual(width(drawn["alike"] / drawn["real"]) / (2 * reach), 1, delta=0.05)

    def test_intervals_are_bias_corrected(self):
        """Rounds that are half a deviation too high say that the estimate is as much too high."""
        rounds = np.random.default_rng(1).normal(0.5, 1, 100_000)
        low, high = bootstrap.interval(rounds, 0)
        self.assertAlmostEqual(low, -0.5 - 1.96, delta=0.05)
        self.assertAlmostEqual(high, -0.5 + 1.96, delta=0.05)

    def test_rounds_that_are_all_the_same_have_an_interval(self):
        self.assertEqual(bootstrap.interval(np.zeros(100), 0), [0, 0])

    def test_deviation_is_that_of_the_trainings(self):
        arms = chance.of_folders([main.HERE / "results" / name for name in ("first_rooms", "few_real")]).values()
        shared, own = chance.components(arms)
        self.assertAlmostEqual(shared, bootstrap.SHARED_DEVIATION, places=4)
        self.assertAlmostEqual(own, bootstrap.ROOM_DEVIATION, places=4)
        self.assertEqual(chance.freedom(arms), bootstrap.FREEDOM)

    def test_components_of_trainings(self):
        """What all rooms share does not become less with their number."""
        rng = np.random.default_rng(2)
        arms = [1 + rng.normal(0, 0.02, (20, 1)) + rng.normal(0, 0.04, (20, 3)) for _ in range(500)]
        shared, own = chance.components(arms)
        self.assertAlmostEqual(shared, 0.02, delta=0.002)
        self.assertAlmostEqual(own, 0.04, delta=0.002)


class Page(unittest.TestCase):
    def test_shares_are_of_arms_that_differ_in_nothing_else(self):
        study = SimpleNamespace(arms=main.read_arms())
        arms = dict.fromkeys(["real", "elsewhere", "real_short", "real_longer", "real_25"])
        self.assertEqual(page.by_generator(study, arms), {None: ["real_25", "real"]})

    def test_sheets_outlive_the_cache(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "index.html"
            study = SimpleNamespace(rooms=[21], world=Path(folder), cache=Path(folder), arms={"generators": {"alike": {}}})
            kept = '<h3>alike</h3><img alt="" src="data:image/jpeg;base64,AAAA">'
            path.write_text(f"<h2>The pictures</h2>{kept}")
            self.assertEqual("".join(page.sheets(study, page.earlier_sheets(path))), kept)


class Check(unittest.TestCase):
    def test_the_headline_is_welcome_where_nothing_is_trained(self):
        """Called without a name, as by `make experiment` and in README.md."""
        for rooms, test_pictures in ((None, None), ([24], 40)):
            with self.subTest(rooms=rooms), tempfile.TemporaryDirectory() as cache:
                check_headline(Path(cache), rooms, test_pictures)

    def test_scores_on_pictures_of_another_world_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            here, elsewhere = some_matches(), some_matches()
            elsewhere.truths[3] = 2
            archive.write(Path(folder), {"real": {0: {"21": [here]}}, "alike": {0: {"21": [elsewhere]}}})
            study = studies.Study(main.read_arms(), Path(folder), Path(folder), None)
            study.arms["reality"] |= {"rooms": [21], "test_pictures": len(here.truths)}
            with self.assertRaisesRegex(SystemExit, "another world: room 21"):
                results.check(study, Path(folder))
            results.check(study, Path(folder), [("alike", 0)])


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
    low, high = bootstrap.interval(values, np.median(values))
    return high - low


if __name__ == "__main__":
    unittest.main()
