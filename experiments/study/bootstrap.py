"""Confidence intervals from the bootstrap over pictures and the random variation of trainings."""

import zlib

import numpy as np

ROUNDS = 500
# How often the chance of trainings is drawn in each round: unlike a choice of pictures it costs nothing.
CHANCES = 20
PERCENTILES = [2.5, 97.5]
# Relative standard deviation of mAP@0.5:0.95 between trainings of 40,000 images that differ in their seed alone, with
# six degrees of freedom: `python -m study.chance results/first_rooms`.
TRAINING_DEVIATION = 0.0303


def samples(arm, rounds=ROUNDS):
    """mAP@0.5:0.95 of an arm, mean over seeds and rooms, in each round.

    `arm[seed][room]` are the matches of the classes. In each round, every arm has the same pictures of a
    room, so ratios of two arms are paired.
    """
    return np.array([np.mean([over_rooms(turn, rooms) for rooms in arm.values()]) for turn in range(rounds)])


def with_chance(name, samples, trainings):
    """`CHANCES` times as many samples of an arm, with the random variation of a mean over this many trainings."""
    deviation = TRAINING_DEVIATION / np.sqrt(trainings)
    # Drawn for each arm by itself, unlike the pictures.
    chance = np.random.default_rng(zlib.crc32(name.encode())).normal(0, deviation, (CHANCES, len(samples)))
    return (samples * (1 + chance)).ravel()


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


def interval(values):
    return [float(v) for v in np.percentile(values, PERCENTILES)]
