"""Time of lanecast against POV-Ray on the scenes of this folder, each written in both languages, on one thread.

Usage: compare.py --program target/release/lanecast [--povray povray] [--rounds 7] [--size WxH] [-o rows.csv] [CASE...]

Needs nothing but Python. Before a case is timed, all render it small, and the pictures must agree: but for EDGES of
the pixels, every channel within TOLERANCE. Programs then take turns (A B C, A B C, ...), one small warm-up before.
Times are those that the programs report for tracing and shading; parsing and building have a column of their own.
POV-Ray runs without output, lanecast writes a temporary file outside of its clock.
"""

import argparse
import array
import csv
import hashlib
import json
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python"))
import machine  # noqa: E402

# As in tests/povray.rs, which says why.
TOLERANCE, EDGES = 5e-5, 0.001
CHECK_SIZE = (160, 120)
# Name: scene, size, what changes a parameter in either language. The size of the last one lets a run end in a minute.
CASES = {
    "parts": ("parts", (1024, 768), [], []),
    "sponge-5": ("sponge", (1024, 768), ["--set", "side=5"], ["Declare=Side=5"]),
    "sponge-10": ("sponge", (320, 240), [], []),
}
# One thread, no window, no antialiasing; the rest is as it is by default.
POVRAY_FLAGS = ["+WT1", "-D", "-A"]
LANECAST_FLAGS = ["--threads", "1", "--depth", "4"]


class Lanecast:
    """The command line program in one precision."""

    def __init__(self, program, precision, case):
        scene, _, changes, _ = CASES[case]
        self.files = [HERE / f"{scene}.kdl"]
        self.program = program
        self.arguments = ["render", f"{scene}.kdl", *changes, "--precision", precision, *LANECAST_FLAGS]
        text = subprocess.check_output([program, "--version"], text=True)
        self.version = text.split("(")[0].strip()
        self.build = text.split("(", 1)[1].strip()[:-1]

    def run(self, size, folder, picture=False):
        """Seconds, seconds of building, counted rays, and the picture if it is asked for."""
        command = [self.program, *self.arguments, "--size", f"{size[0]}x{size[1]}", "-o", "out.npy", "--json", "-q"]
        report = json.loads(subprocess.check_output(command, cwd=folder))
        counts = {"primary": report["rays"]["primary"], "shadow": report["rays"]["shadow"]}
        self.engine = report["engine"]
        return report["seconds"], report["build_seconds"], counts, read_npy(folder / "out.npy", size) if picture else None

    def shown(self, size):
        return " ".join(["lanecast", *self.arguments, "--size", f"{size[0]}x{size[1]}", "-o", "out.npy"])


class Povray:
    """POV-Ray, told the scene in one of its ways."""

    engine = ""

    def __init__(self, program, case, declares):
        scene, _, _, changes = CASES[case]
        self.files = [HERE / f"{scene}.pov", HERE / "common.inc"]
        self.program = program
        self.arguments = [f"+I{scene}.pov", *changes, *declares, *POVRAY_FLAGS]
        out = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
        self.version = re.search(r"POV-Ray \S+", out.stdout + out.stderr).group(0)
        self.build = "; ".join(re.findall(r"(?:Built/Optimized for|Compiler flags): +(\S.*)", out.stdout + out.stderr))

    def run(self, size, folder, picture=False):
        output = ["+FP16", "File_Gamma=1.0", "+Oout.ppm"] if picture else ["-F"]
        command = [self.program, *self.arguments, f"+W{size[0]}", f"+H{size[1]}", *output]
        said = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stderr

        def number(pattern):
            return float(re.search(pattern, said).group(1))

        building = number(r"Parse Time:.*\(([\d.]+) sec") + number(r"Bounding Time:.*\(([\d.]+) sec")
        counts = {"primary": int(number(r"Rays: +(\d+)")), "shadow": int(number(r"Shadow Ray Tests: +(\d+)"))}
        seconds = number(r"Trace Time:.*\(([\d.]+) sec")
        return seconds, building, counts, read_ppm(folder / "out.ppm", size) if picture else None

    def shown(self, size):
        return " ".join(["povray", *self.arguments, f"+W{size[0]}", f"+H{size[1]}", "-F"])


def read_npy(path, size):
    """Red, green, blue of all pixels in a row, from an array of (height, width, 4) floats."""
    values = array.array("f", path.read_bytes()[-16 * size[0] * size[1] :])
    if sys.byteorder == "big":
        values.byteswap()
    return [v for i, v in enumerate(values) if i % 4 < 3]


def read_ppm(path, size):
    """The same from 16 bits per channel."""
    values = array.array("H", path.read_bytes()[-6 * size[0] * size[1] :])
    if sys.byteorder == "little":
        values.byteswap()
    return [v / 65535 for v in values]


def check(name, programs, folder):
    """The largest share of pixels that differ from those of the first program; ends the run where it is too large."""
    pictures = [p.run(CHECK_SIZE, folder, picture=True)[3] for p in programs.values()]
    n = len(pictures[0]) // 3
    worst = 0.0
    for program, picture in zip(programs, pictures):
        differs = sum(
            any(abs(a - b) > TOLERANCE for a, b in zip(pictures[0][3 * i : 3 * i + 3], picture[3 * i : 3 * i + 3]))
            for i in range(n)
        )
        if differs > EDGES * n:
            raise SystemExit(f"{name}, {program}: {differs} of {n} pixels differ: nothing is timed")
        worst = max(worst, differs / n)
    return worst


def programs_of(case, args):
    programs = {f"lanecast {precision}": Lanecast(args.program, precision, case) for precision in ("f64", "f32")}
    programs["povray"] = Povray(args.povray, case, [])
    if CASES[case][0] == "sponge":
        programs["povray, bounded by hand"] = Povray(args.povray, case, ["Declare=Bounded=1"])
    return programs


def measure(case, args, folder):
    """Rows of one case."""
    programs = programs_of(case, args)
    size = args.size or CASES[case][1]
    differ = check(case, programs, folder)
    for program in programs.values():
        program.run(CHECK_SIZE, folder)
    runs = {name: [] for name in programs}
    for _ in range(args.rounds):
        for name, program in programs.items():
            runs[name].append(program.run(size, folder))
    seconds = {name: [run[0] for run in of] for name, of in runs.items()}
    # The picture is the same, so the rays it needs are: those that we count. What POV-Ray counts stands beside it.
    needed = sum(runs["lanecast f64"][0][2].values())
    model, flags = machine.cpu()
    for name, program in programs.items():
        median = statistics.median(seconds[name])

        def over(ours):
            return round(statistics.median(s / o for s, o in zip(seconds[name], seconds[ours])), 3)

        scene = b"".join(file.read_bytes() for file in program.files)
        counts = runs[name][0][2]
        yield {
            "revision": re.sub(r".*revision (\S+),.*", r"\1", programs["lanecast f64"].build),
            "date": machine.now(),
            "cpu": model,
            "flags": flags,
            "threads": 1,
            "case": case,
            "scene_hash": hashlib.sha256(scene).hexdigest(),
            "program": name,
            "version": program.version,
            "build": program.build,
            "engine": program.engine,
            "size": f"{size[0]}x{size[1]}",
            "repeat": args.rounds,
            "best_seconds": round(min(seconds[name]), 6),
            "median_seconds": round(median, 6),
            "spread": machine.spread(seconds[name]),
            "build_seconds": round(statistics.median(run[1] for run in runs[name]), 6),
            "rays": needed,
            "median_mrays_per_s": round(needed / median / 1e6, 4),
            "counted_primary": counts["primary"],
            "counted_shadow": counts["shadow"],
            "f64_over_this": over("lanecast f64"),
            "f32_over_this": over("lanecast f32"),
            "pixels_that_differ": round(differ, 6),
            "seconds": " ".join(f"{s:.6f}" for s in seconds[name]),
            "command": program.shown(size),
            "run_by": " ".join(["compare.py", *args.shown]),
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="lanecast of a release build")
    parser.add_argument("--povray", default="povray")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--size", type=lambda text: tuple(map(int, text.split("x"))), help="WxH [default: by case]")
    parser.add_argument("-o", dest="out", default="-", help="rows [default: standard output]")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {', '.join(CASES)} [default: all]")
    args = parser.parse_args()
    unknown = [case for case in args.cases if case not in CASES]
    if unknown or args.rounds < 1:
        parser.error(f"no such case: {', '.join(unknown)}" if unknown else "at least one round")
    args.program = os.path.abspath(args.program)
    args.shown = [os.path.basename(a) if "/" in a else a for a in sys.argv[1:]]
    file = sys.stdout if args.out == "-" else open(args.out, "w", encoding="utf-8", newline="")
    table = "{:<10} {:<24} {:>10} {:>8} {:>8} {:>10} {:>9} {:>9}"
    head = ("case", "program", "median s", "best s", "spread", "Mrays/s", "f64 over", "f32 over")
    print(table.format(*head), file=sys.stderr)
    writer = None
    # POV-Ray is often configured to read and write in the current folder only.
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene in [*HERE.glob("*.kdl"), *HERE.glob("*.pov"), *HERE.glob("*.inc")]:
            shutil.copy(scene, folder)
        for case in args.cases or CASES:
            for row in measure(case, args, folder):
                if writer is None:
                    writer = csv.DictWriter(file, row.keys(), lineterminator="\n")
                    writer.writeheader()
                writer.writerow(row)
                file.flush()
                columns = ("case", "program", "median_seconds", "best_seconds", "spread", "median_mrays_per_s")
                numbers = [row[c] for c in (*columns, "f64_over_this", "f32_over_this")]
                print(table.format(*(f"{n:.4g}" if isinstance(n, float) else n for n in numbers)), file=sys.stderr)


if __name__ == "__main__":
    main()
