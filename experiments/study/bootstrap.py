"""Confidence intervals from the bootstrap over pictures and the random variation of trainings."""

import statistics
import zlib

import numpy as np

ROUNDS = 500
# How often the chance of trainings is drawn in each round: unlike a choice of pictures it costs nothing.
CHANCES = 20
# Half of a confidence interval of 95 %, in standard deviations of the normal distribution.
REACH = 1.96
# Relative standard deviations of mAP@0.5:0.95 between trainings of 40,000 images that differ in their seed alone: in all
# rooms alike, and in each room by itself; and how well they are known:
# `python -m study.chance results/first_rooms results/few_real`.
SHARED_DEVIATION = 0.0132
ROOM_DEVIATION = 0.0505
FREEDOM = 16


def samples(arm, rounds=ROUNDS):
    """mAP@0.5:0.95 of an arm, mean over seeds and rooms, in each round.

    `arm[seed][room]` are the matches of the classes. In each round, every arm has the same pictures of a
    room, so ratios of two arms are paired.
    """
    return np.array([np.mean([over_rooms(turn, rooms) for rooms in arm.values()]) for turn in range(rounds)])


def with_chance(name, samples, trainings, rooms):
    """`CHANCES` times as many samples of an arm, with the random variation of a mean over this many trainings and
    rooms."""
    size = (CHANCES, len(samples))
    # The deviation itself is uncertain, and the same for all arms: a ratio of two has Student's distribution.
    scale = np.sqrt(FREEDOM / np.random.default_rng(0).chisquare(FREEDOM, size))
    # Drawn for each arm by itself, unlike the pictures.
    normal = np.random.default_rng(zlib.crc32(name.encode())).normal(size=size)
    return (samples * (1 + deviation(rooms) / np.sqrt(trainings) * scale * normal)).ravel()


def deviation(rooms):
    """Relative standard deviation between trainings of the mean over so many rooms."""
    return np.hypot(SHARED_DEVIATION, ROOM_DEVIATION / np.sqrt(rooms))


def over_rooms(turn, rooms):
    return np.mean([map_of(matches, picture_times(turn, room, matches)) for room, matches in rooms.items()])


def picture_times(turn, room, matches):
    count = len(matches[0].truths)
    rng = np.random.default_rng([turn, int(room)])
    return np.bincount(rng.choice(count, count), minlength=count).astype(float)


def map_of(matches, times):
    """Mean over the classes that occur, as in COCO."""
    found = [one.average_precision(times) for one in matches]
    found = [values.mean() for values in found if values is not None]
    return np.mean(found) if found else 0.0


def interval(values, estimate):
    """The bias-corrected interval (Efron 1981): scores of resampled pictures, some of them there several times, tend to
    be better than the estimate."""
    normal = statistics.NormalDist()
    below = (np.mean(values < estimate) + np.mean(values <= estimate)) / 2
    # Not 0 or 1, which are infinitely far.
    bias = normal.inv_cdf(np.clip(below, 1 / len(values), 1 - 1 / len(values)))
    percentiles = [100 * normal.cdf(2 * bias + side * REACH) for side in (-1, 1)]
    return [float(v) for v in np.percentile(values, percentiles)]
