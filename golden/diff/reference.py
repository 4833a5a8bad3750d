#!/usr/bin/env python3
"""Prints SSIM (scikit-image) and FLIP (its authors' flip-evaluator) of the two pictures in src/diff/test_pictures.rs.

    python3 golden/diff/reference.py      # needs scikit-image==0.26.0 flip-evaluator==1.7
"""

import flip_evaluator
import numpy as np
from skimage.metrics import structural_similarity

y, x = np.mgrid[0:64, 0:96].astype(np.float64)
wave = 0.5 + 0.3 * np.sin(x / 5.0) * np.cos(y / 7.0)
edge = np.where(x + 2.0 * y > 120.0, 0.25, 0.0)
pattern = np.stack([wave, 0.2 + 0.006 * x, (wave + edge) * 0.7], axis=2).astype(np.float32)

moved = pattern[:, np.minimum(np.arange(96) + 1, 95)]
point = np.where((x % 16 == 3) & (y % 12 == 5), 0.3, 0.0)
changed = np.stack([np.minimum(moved[..., 0] * np.float32(0.95) + point.astype(np.float32), 1.0),
                    moved[..., 1], moved[..., 2] * np.float32(0.9)], axis=2).astype(np.float32)

similarity = structural_similarity(pattern.astype(np.float64), changed.astype(np.float64), gaussian_weights=True,
                                   sigma=1.5, use_sample_covariance=False, data_range=1.0, channel_axis=2)
_, error, _ = flip_evaluator.evaluate(pattern, changed, "LDR", applyMagma=False)
print("ssim %.8f" % similarity)
print("flip %.8f" % error)
