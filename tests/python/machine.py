"""The machine that rows were measured on."""

import csv
import datetime
import pathlib
import platform
import statistics


def cpu():
    """Model and instruction sets of this machine."""
    model, flags = platform.processor(), ""
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
            if line.startswith("flags"):
                wanted = ("avx", "avx2", "fma", "avx512f")
                flags = "+".join(f for f in wanted if f in line.split())
    except OSError:
        pass
    return model, flags


def now():
    return datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def spread(values):
    """Largest minus smallest value over the median."""
    return round((max(values) - min(values)) / statistics.median(values), 4)


def write_rows(path, rows):
    """Writes `rows`, dictionaries with the same keys, as CSV."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
