"""Checks the EXR files of tests/film_python.rs with OpenEXR, and writes one with it. Usage: exr.py FOLDER"""

import sys
from pathlib import Path

import numpy as np
import OpenEXR

folder = Path(sys.argv[1])
FLOATS = ["R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "albedo.R", "cost.nodes"]
LONG_NAME = "a name of more than the 31 characters of old EXR files"
HEIGHT, WIDTH = 25, 30


def check(name, compression):
    with OpenEXR.File(str(folder / name), separate_channels=True) as file:
        header, channels = file.header(), file.channels()
        assert header["compression"] == compression, header["compression"]
        check_header(header)
        check_channels(channels)


def check_header(header):
    windows = {k: [list(map(int, corner)) for corner in header[k]] for k in ("dataWindow", "displayWindow")}
    # Inclusive corners of a crop 10,20 to 40,45 (half open) of a picture of 100x50.
    assert windows == {"dataWindow": [[10, 20], [39, 44]], "displayWindow": [[0, 0], [99, 49]]}, windows
    expected = {
        "software": "lanecast test",
        "lanecast/revision": "0123abc",
        "lanecast/sceneHash": "f00d",
        "lanecast/engine": "packet16",
        "lanecast/isa": "x86-64-v4",
        "lanecast/lanes": 16,
        "lanecast/batch": 256,
        "lanecast/spp": 4,
        "lanecast/seed": "18446744073709551615",
        "lanecast/renderSeconds": 1.25,
        "lanecast/rays": 9e9,
    }
    for key, value in expected.items():
        assert header[key] == value, (key, header[key])
    # Row vectors: the point (1, 0, 0) turned by 90 degrees about z and moved by (5, 6, 7) is (5, 7, 7).
    camera = np.array(header["worldToCamera"]).reshape(4, 4)
    assert (np.array([1, 0, 0, 1]) @ camera).tolist() == [5, 7, 7, 1], camera
    ndc = np.array(header["worldToNDC"]).reshape(4, 4)
    assert (np.array([1, 1, 1, 1]) @ ndc).tolist() == [2, 3, 9, 1], ndc
    chromaticities = np.array(header["chromaticities"], dtype="f4").ravel()
    rec709 = np.array([0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290], dtype="f4")
    assert chromaticities.tolist() == rec709.tolist(), chromaticities


def check_channels(channels):
    assert sorted(channels) == sorted(FLOATS + ["id.instance", "id.primitive", LONG_NAME]), sorted(channels)
    assert (channels[LONG_NAME].pixels == 0.5).all()
    index = np.arange(HEIGHT * WIDTH, dtype="u4").reshape(HEIGHT, WIDTH)
    for k, name in enumerate(FLOATS):
        pixels = channels[name].pixels
        assert pixels.dtype == np.float32 and np.array_equal(pixels, k + index.astype("f4") / 1024), name
    for name, pixels in [("id.instance", index * 7), ("id.primitive", 0xFFFFFFFF - index)]:
        assert channels[name].type() == OpenEXR.UINT, name
        assert channels[name].pixels.dtype == np.uint32 and np.array_equal(channels[name].pixels, pixels), name


check("zip.exr", OpenEXR.ZIP_COMPRESSION)
check("piz.exr", OpenEXR.PIZ_COMPRESSION)

grid = np.arange(12).reshape(3, 4)
made = {
    "R": grid.astype("f4"),
    "half.Y": (grid / 2).astype("f2"),
    "id.instance": (0xFFFFFFFF - grid).astype("u4"),
}
header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage}
with OpenEXR.File(header, made) as file:
    file.write(str(folder / "openexr.exr"))
print("checked")
