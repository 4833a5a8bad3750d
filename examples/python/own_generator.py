#!/usr/bin/env python3
"""Write the images of your own generator as a dataset that trainers read; here, each shows one leaning card.

own_generator.py FOLDER
"""

import sys

import numpy as np
import petcomp


def sample(k):
    """Make image k and its labels, which depend only on k."""
    camera = petcomp.Camera.look_at([0.0, -0.8, 0.8], [0.0, 0.0, 0.0], 500.0, [320, 240])
    green = np.full((8, 8, 4), [0.05, 0.3, 0.1, 0.6], np.float32)
    card = petcomp.Card(
        id=1, texture=green, size=(0.25, 0.10), position=(0.0, 0.0, 0.1), rotation=(0.1 * k, 0.0, 0.3 * k)
    )
    plate = np.full((240, 320, 3), 0.4, np.float32)
    shot = petcomp.Shot(camera, classes=("film",)).with_plate(plate).with_card(card).with_ambient(1.0)
    return petcomp.render(shot)


def main():
    folder = sys.argv[1]
    counts = petcomp.generate(sample, 10, folder, classes=["film"], progress=print)
    print(f"{folder}: {counts.images} images, {counts.labelled} labels")


if __name__ == "__main__":
    main()
