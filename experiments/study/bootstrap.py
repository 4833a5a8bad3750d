"""Intervals by bootstrap over pictures and seeds."""

import zlib

import numpy as np

ROUNDS = 500
PERCENTILES = [2.5, 97.5]


def samples(name, arm, rounds=ROUNDS):
    """mAP@0.5:0.95 of an arm, over rooms and seeds, in each round.

    `arm[seed][room]` are the matches of the classes. In a round the pictures of a room are the same
    for every arm, so ratios of two arms are paired; seeds are drawn for each arm by itself.
    """
    seeds = np.random.default_rng(zlib.crc32(name.encode()))
    return np.array([one_round(k, seeds.choice(list(arm), len(arm)), arm) for k in range(rounds)])


def one_round(turn, seeds, arm):
    scores = {seed: over_rooms(turn, arm[seed]) for seed in set(seeds)}
    return np.mean([scores[seed] for seed in seeds])


def over_rooms(turn, rooms):
    return np.mean([map_of(matches, picture_times(turn, room, matches)) for room, matches in rooms.items()])


def picture_times(turn, room, matches):
    count = len(matches[0].truths)
    rng = np.random.default_rng([turn, int(room)])
    return np.bincount(rng.choice(count, count), minlength=count).astype(float)


def map_of(matches, times):
    """Mean over the classes that are there, as COCO has it."""
    found = [one.average_precision(times) for one in matches]
    found = [values.mean() for values in found if values is not None]
    return np.mean(found) if found else 0.0


def interval(values):
    return [float(v) for v in np.percentile(values, PERCENTILES)]
