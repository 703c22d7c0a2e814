"""Decodes the PNG of tests/film_python.rs with zlib alone, and writes one with zlib. Usage: png.py FOLDER"""

import struct
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])


def chunks(data):
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at = 8
    while at < len(data):
        (size,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        assert struct.unpack_from(">I", data, at + 8 + size) == (zlib.crc32(kind + body),), kind
        yield kind, body
        at += 12 + size


def paeth(a, b, c):
    nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))
    return nearest[2]


def unfilter(kind, row, pixel):
    """One row without a row above it, undone as the PNG specification says."""
    out = bytearray()
    for i, byte in enumerate(row):
        left = out[i - pixel] if i >= pixel else 0
        out.append((byte + {0: 0, 1: left, 2: 0, 3: left // 2, 4: paeth(left, 0, 0)}[kind]) & 255)
    return out


def level(linear):
    signal = 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
    return round(255 * signal)


found = dict(chunks((folder / "a.png").read_bytes()))
assert found[b"IHDR"] == struct.pack(">IIBBBBB", 4, 1, 8, 2, 0, 0, 0), found[b"IHDR"]
assert found[b"sRGB"] == b"\0"
raw = zlib.decompress(found[b"IDAT"])
pixels = list(unfilter(raw[0], raw[1:], 3))
expected = [level(x * scale) for x in (0, 0.18, 0.5, 1) for scale in (1, 0.5, 0)]
assert pixels == expected, (pixels, expected)


def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


gray = chunk(b"IHDR", struct.pack(">IIBBBBB", 3, 1, 8, 0, 0, 0, 0))
gray += chunk(b"IDAT", zlib.compress(bytes([0, 0, 128, 255]))) + chunk(b"IEND", b"")
(folder / "zlib.png").write_bytes(b"\x89PNG\r\n\x1a\n" + gray)
print("checked")
