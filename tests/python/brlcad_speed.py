"""Rates of `render --rt-compat` at BRL-CAD's six benchmark views, beside those of BRL-CAD's own `rt`.

Usage: brlcad_speed.py --program target/release/lanecast --data FOLDER [--repeat 11] [--size 1024] [-o FILE.csv]

FOLDER holds db/NAME.asc, views/NAME.rt and ref/NAME.pix. Pictures of 512x512 pixels are compared first: each case must
show what the scalar engine shows, byte by byte, and the f64 pictures the references', where there are any; f32 is compared with
f64. Fewer than 99.9 % of bytes within one level is no result: such a row says so, and is left out of the mean. Then the views
and precisions are rendered in turns, one thread, all rays counted as `rt` counts them. `rt`'s rates are million rays per second of processor time of BRL-CAD 7.32.6,
all rays, the lowest and the highest that were measured, on a Xeon with AVX-512 (family 6, model 207) and not here; a ratio is over the middle of the two.
"""

import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

import machine

# View: top object, rates of `rt`.
VIEWS = {
    "moss": ("all.g", 2.4, 3.5),
    "world": ("all.g", 1.3, 1.5),
    "star": ("all", 1.3, 1.4),
    "bldg391": ("all.g", 1.0, 1.1),
    "m35": ("all.g", 1.1, 1.3),
    "sphflake": ("scene.r", 1.3, 1.7),
}
PRECISIONS = ["f64", "f32"]
# Bytes within one level that make a picture a result.
ENOUGH = 0.999


def words(args, name, precision, size, picture):
    folder = pathlib.Path(args.data)
    return [
        "render",
        str(folder / "db" / f"{name}.asc"),
        *["--top", VIEWS[name][0], "--view", str(folder / "views" / f"{name}.rt"), "--rt-compat"],
        *["--precision", precision, "--size", f"{size}x{size}", "--threads", "1", "-o", str(picture), "--json", "-q"],
    ]


def run(args, *rest):
    return json.loads(subprocess.check_output([args.program, *rest], text=True))


def near(got, wanted):
    """Share of bytes within one level."""
    if len(got) != len(wanted):
        raise SystemExit(f"{len(got)} and {len(wanted)} bytes")
    return sum(abs(a - b) <= 1 for a, b in zip(got, wanted)) / len(wanted)


def check(args, name, picture):
    """Shares of bytes within one level: f64's of the reference's, `None` without one, and f32's of f64's."""
    shown = {}
    for precision in PRECISIONS:
        command = words(args, name, precision, 512, picture)
        run(args, *command, "--engine", "scalar")
        slow = picture.read_bytes()
        run(args, *command)
        shown[precision] = picture.read_bytes()
        if shown[precision] != slow:
            raise SystemExit(f"{name} in {precision}: not the scalar engine's picture: no result")
    reference = pathlib.Path(args.data) / "ref" / f"{name}.pix"
    against = near(shown["f64"], reference.read_bytes()) if reference.exists() else None
    return {"f64": against, "f32": near(shown["f32"], shown["f64"])}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--data", required=True)
    parser.add_argument("--repeat", type=int, default=11)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("-o", "--output")
    args = parser.parse_args()
    model, flags = machine.cpu()
    version = subprocess.check_output([args.program, "--version"], text=True)
    cases = [(name, precision) for name in VIEWS for precision in PRECISIONS]
    reports = {case: [] for case in cases}
    with tempfile.TemporaryDirectory() as folder:
        picture = pathlib.Path(folder) / "out.pix"
        checked = {name: check(args, name, picture) for name in VIEWS}
        for _ in range(args.repeat):
            for name, precision in cases:
                reports[name, precision].append(run(args, *words(args, name, precision, args.size, picture)))
    rows = []
    for (name, precision), shown in reports.items():
        top, low, high = VIEWS[name]
        rates = [one["mrays_per_s"] for one in shown]
        median = statistics.median(rates)
        share = checked[name][precision]
        rows.append(
            {
                "revision": version.split("revision ")[1].split(",")[0],
                "date": machine.now(),
                "cpu": model,
                "flags": flags,
                "threads": 1,
                "scene": name,
                "scene_hash": run(args, "info", str(pathlib.Path(args.data) / "db" / f"{name}.asc"), "--top", top, "--json")["hash"],
                "precision": precision,
                "engine": shown[0]["engine"],
                "size": f"{args.size}x{args.size}",
                "rays": shown[0]["rays"]["total"],
                "compared_with": "" if share is None else "f64" if precision == "f32" else "the reference",
                "within_one_level": "" if share is None else round(share, 6),
                "result": "yes" if share is None or share >= ENOUGH else "no",
                "repeat": len(rates),
                "median_mrays_per_s": round(median, 3),
                "best_mrays_per_s": round(max(rates), 3),
                "spread": machine.spread(rates),
                "rt_mrays_per_s": f"{low} to {high}",
                "over_rt": round(median / ((low + high) / 2), 2),
                "command": f"brlcad_speed.py --repeat {args.repeat} --size {args.size}",
            }
        )
    for row in rows:
        print(f"{row['scene']:10} {row['precision']} {row['median_mrays_per_s']:8.2f} Mrays/s {row['over_rt']:6.2f} x rt, result: {row['result']}")
    for precision in PRECISIONS:
        ratios = [row["over_rt"] for row in rows if row["precision"] == precision and row["result"] == "yes"]
        print(f"{precision}: geometric mean {math.prod(ratios) ** (1 / len(ratios)):.2f}, least {min(ratios):.2f}")
    if args.output:
        machine.write_rows(args.output, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
