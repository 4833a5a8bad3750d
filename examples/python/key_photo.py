#!/usr/bin/env python3
"""Make a cut-out of a photo on a green screen, in two ways.

key_photo.py PHOTO FOLDER
"""

import sys
from pathlib import Path

import numpy as np
import petcomp


def main():
    photo, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    image = petcomp.io.read(photo)

    # Blender's Keying node, with the median colour of the image border as the screen colour.
    rim = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    keyed = petcomp.matte.key(image, screen=np.median(rim, axis=0), profile="blender-4.5", clip_black=0.1)
    petcomp.io.write(folder / "keyed.exr", keyed.cutout)

    # The whole process: find the object, fit the screen and solve for see-through plastic.
    cut = petcomp.matte.cut_out(image)
    petcomp.io.write(folder / "cut_out.exr", cut.rgba)
    (folder / "cut_out.png").write_bytes(cut._repr_png_())
    for diagnostic in cut.diagnostics:
        print(diagnostic["message"])
    print(f"{photo.name}: matte {keyed.matte.mean():.3f} on average, cut-out {cut.rgba.shape[1]} x {cut.rgba.shape[0]}")


if __name__ == "__main__":
    main()
