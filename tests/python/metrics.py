"""Metrics of the picture pairs of tests/compare_metrics.rs by scikit-image and FLIP's authors. Usage: metrics.py FOLDER

For each pair NAME: NAME_a.npy and NAME_b.npy, linear light of shape (height, width, 3). Prints one JSON object.
"""

import json
import sys
from pathlib import Path

import flip_evaluator
import numpy as np
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

folder = Path(sys.argv[1])


def srgb(linear):
    x = np.clip(linear.astype("f8"), 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype("f4")


def ssim(a, b, white):
    return structural_similarity(
        a, b, channel_axis=-1, data_range=white, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )


found = {}
for path in sorted(folder.glob("*_a.npy")):
    name = path.name.removesuffix("_a.npy")
    a, b = np.load(path), np.load(folder / f"{name}_b.npy")
    white = float(a.max())
    shown = srgb(a), srgb(b)
    found[name] = {
        "psnr": peak_signal_noise_ratio(a, b, data_range=white),
        "ssim": ssim(a, b, white),
        "psnr_display": peak_signal_noise_ratio(*shown, data_range=1),
        "ssim_display": ssim(*shown, 1),
        "flip": float(flip_evaluator.evaluate(*shown, "LDR")[1]),
        "flip_dense": float(flip_evaluator.evaluate(*shown, "LDR", parameters={"ppd": 40.0})[1]),
        "hdr_flip": float(flip_evaluator.evaluate(a, b, "HDR")[1]),
    }
print(json.dumps(found, default=float))
