"""Renders scenes of tests/mitsuba with Mitsuba 3.

Usage: mitsuba_compare.py FOLDER SIZE SPP PASSES SCENE.json...
Writes for each scene FOLDER/NAME.npy: rows, columns, and red, green, blue, and the variance of the mean brightness as
the passes, each with a seed of its own, tell it.
"""

import json
import pathlib
import sys
import time

import numpy as np

import mitsuba_scene


def main():
    folder, size, spp, passes = pathlib.Path(sys.argv[1]), *map(int, sys.argv[2:5])
    mi = mitsuba_scene.variant()
    report = {"variant": mi.variant(), "version": mi.__version__}
    for file in map(pathlib.Path, sys.argv[5:]):
        start = time.perf_counter()
        scene = mitsuba_scene.load(mi, file, size, spp)
        pictures = [mitsuba_scene.render(mi, scene, spp // passes, seed) for seed in range(passes)]
        mean = np.mean(pictures, axis=0)
        brightness = np.mean(pictures, axis=3)
        variance = np.var(brightness, axis=0, ddof=1) / passes
        assert np.isfinite(mean).all()
        planes = np.dstack([mean, variance]).astype("<f4")
        np.save(folder / f"{file.stem}.npy", np.ascontiguousarray(planes))
        report[file.stem] = round(time.perf_counter() - start, 2)
    print(json.dumps(report))


if __name__ == "__main__":
    main()
