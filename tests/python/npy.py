"""Checks the .npy files of tests/film_python.rs with NumPy, and writes some with NumPy. Usage: npy.py FOLDER"""

import io
import sys
from pathlib import Path

import numpy as np

folder = Path(sys.argv[1])
HIT = np.dtype([("t", "<f4"), ("u", "<f4"), ("v", "<f4"), ("prim", "<u4"), ("inst", "<u4")])


def check(name, dtype, shape):
    array = np.load(folder / name, allow_pickle=False)
    assert array.dtype == np.dtype(dtype), (name, array.dtype)
    assert array.shape == shape, (name, array.shape)
    # The same array saved by NumPy gives the same bytes, header and padding included.
    buffer = io.BytesIO()
    np.save(buffer, array)
    assert buffer.getvalue() == (folder / name).read_bytes(), name
    return array


rays = check("rays.npy", "<f4", (3, 8))
assert rays[0].tolist() == [1, 2, 3, 0.5, 4, 5, 6, np.inf]
second = np.array([-0.0, 1e-40, 3.4e38, 0.0, 0.1, 0.2, 0.3, 100.0], "<f4")
assert rays[1].tobytes() == second.tobytes()
assert rays[2, 7] < rays[2, 3], "the third ray is dead"

hits = check("hits.npy", HIT, (2,))
assert hits[0].tolist() == (1.5, 0.25, 0.125, 7, 4_000_000_000)
assert hits[1].tolist() == (np.inf, 0, 0, 0xFFFFFFFF, 0xFFFFFFFF)

assert check("occluded.npy", "u1", (3,)).tolist() == [1, 0, 1]
assert check("plane.npy", "<f4", (2, 3)).tolist() == [[0, 1, 2], [3, 4, 5]]
assert check("ids.npy", "<u4", (2, 1)).tolist() == [[1], [0xFFFFFFFF]]

made = np.arange(40, dtype="<f4").reshape(5, 8)
np.save(folder / "numpy_rays.npy", made)
np.save(folder / "numpy_double_rays.npy", np.array([[0.1, 0.2, 0.3, 0, 1, 1, 1, np.inf]]))
with open(folder / "numpy_version_2.npy", "wb") as file:
    np.lib.format.write_array(file, made, version=(2, 0))
np.save(folder / "numpy_bool.npy", np.array([True, False, False]))
np.save(folder / "numpy_hits.npy", np.array([(2, 0, 0, 1, 2), (0.5, 0, 0, 11, 0xFFFFFFFF)], HIT))
np.save(folder / "numpy_big_endian.npy", made.astype(">f4"))
np.save(folder / "numpy_fortran.npy", np.asfortranarray(made))
np.save(folder / "numpy_seven.npy", np.ascontiguousarray(made[:, :7]))
print("checked")
