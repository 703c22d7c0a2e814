"""Paths per second, and variance, of lanecast against Mitsuba 3 on the scenes of tests/mitsuba.

Usage: mitsuba_speed.py --program target/release/examples/path_scene [--size 256] [--spp 64] [--threads 2]
       [--repeat 10] [--seeds 16] [--variants scalar_rgb,llvm_ad_rgb] [-o rows.csv] [SCENE.json...]

Before anything is timed, the means of 16 regions of both pictures must agree within one per cent. Each round renders
once with every program (A B C A B C ...), with a new seed; scenes are loaded and kernels compiled before. The variance is that of a pixel's brightness over independent seeds, relative to the square of the mean, summed
over all pixels, at the same samples per pixel and the same filter (a box of one pixel).
"""

import argparse
import csv
import hashlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import machine
import mitsuba_scene

HERE = pathlib.Path(__file__).resolve().parent
# Regions of a picture's side, and how far their means may be off.
REGIONS = 4
AGREE = 0.01


class Ours:
    """The example path_scene of a release build."""

    version = ""

    def __init__(self, program, scene, args):
        self.command = [program, str(scene), str(args.size), str(args.spp), str(args.threads)]

    def seconds(self, _):
        # The second of two pictures: the first one meets cold memory, as Mitsuba's warm-up does.
        report = json.loads(subprocess.check_output(self.command + ["2"]))
        self.version = report["revision"]
        return report["seconds"][1]

    def moments(self, seeds):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "out.npy"
            subprocess.check_output(self.command + [str(seeds), str(out)])
            planes = np.load(out).astype(np.float64)
        return planes[:, :, :3].mean(axis=2), planes[:, :, 3]


class Mitsuba:
    """A process of its own for each variant: variants do not share objects, and threads stay apart."""

    def __init__(self, variant, scene, args):
        numbers = [str(n) for n in (args.size, args.spp, args.threads)]
        command = [sys.executable, __file__, "--serve", variant, str(scene), *numbers]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.folder = tempfile.TemporaryDirectory()
        self.version = self.answer()["version"]
        self.seconds(1000)

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit("Mitsuba has ended")
        return json.loads(line)

    def ask(self, seed, out=""):
        self.process.stdin.write(json.dumps({"seed": seed, "out": out}) + "\n")
        self.process.stdin.flush()
        return self.answer()["seconds"]

    def seconds(self, seed):
        return self.ask(seed)

    def moments(self, seeds):
        out = str(pathlib.Path(self.folder.name) / "picture.npy")
        pictures = []
        for seed in range(seeds):
            self.ask(seed, out)
            pictures.append(np.load(out).mean(axis=2))
        return np.mean(pictures, axis=0), np.var(pictures, axis=0, ddof=1)

    def end(self):
        self.process.stdin.close()
        self.process.wait()
        self.folder.cleanup()


def serve(variant, scene, size, spp, threads):
    """Renders on demand: one line of JSON in, one out."""
    mi = mitsuba_scene.variant(variant)
    import drjit as dr

    dr.set_thread_count(threads)
    loaded = mitsuba_scene.load(mi, scene, size, spp)
    print(json.dumps({"version": mi.__version__}), flush=True)
    for line in sys.stdin:
        task = json.loads(line)
        start = time.perf_counter()
        image = mi.render(loaded, spp=spp, seed=task["seed"])
        if variant.startswith("llvm"):
            dr.eval(image)
            dr.sync_thread()
        seconds = time.perf_counter() - start
        if task["out"]:
            np.save(task["out"], np.array(image, dtype=np.float64))
        print(json.dumps({"seconds": seconds}), flush=True)


def relative_variance(moments):
    mean, variance = moments
    return float((variance / (mean * mean + 1e-4)).mean())


def worst_region(ours, theirs):
    """The largest difference of a region's mean brightness, relative."""
    edge = len(ours) // REGIONS

    def regions(picture):
        return picture[: edge * REGIONS, : edge * REGIONS].reshape(REGIONS, edge, REGIONS, edge).mean(axis=(1, 3))

    return float(np.abs(regions(ours) / regions(theirs) - 1).max())


def measure(args, scene):
    """Rows of one scene."""
    programs = {"lanecast": Ours(args.program, scene, args)}
    programs.update({name: Mitsuba(name, scene, args) for name in args.variants.split(",") if name})
    # All variants of Mitsuba take the same samples: the fastest one stands for them.
    judged = ["lanecast", "llvm_ad_rgb" if "llvm_ad_rgb" in programs else list(programs)[-1]]
    moments = {name: programs[name].moments(args.seeds) for name in judged}
    off = worst_region(*(moments[name][0] for name in judged))
    if off > AGREE:
        raise SystemExit(f"{scene.stem}: a region of the pictures differs by {100 * off:.2f} %: nothing is timed")
    times = {name: [] for name in programs}
    for round_ in range(args.repeat):
        for name, program in programs.items():
            times[name].append(program.seconds(round_))
    noise = {name: relative_variance(moments[name]) for name in judged}
    paths = args.size**2 * args.spp
    model, flags = machine.cpu()
    for name, seconds in times.items():
        median = statistics.median(seconds)
        mad = statistics.median(abs(s - median) for s in seconds)
        yield {
            "revision": programs["lanecast"].version,
            "date": machine.now(),
            "cpu": model,
            "flags": flags,
            "threads": args.threads,
            "scene": scene.stem,
            "scene_hash": hashlib.sha256(scene.read_bytes()).hexdigest(),
            "program": name,
            "version": programs[name].version,
            "size": args.size,
            "spp": args.spp,
            "depth": json.loads(scene.read_text(encoding="utf-8"))["depth"],
            "repeat": args.repeat,
            "best_seconds": round(min(seconds), 5),
            "median_seconds": round(median, 5),
            "spread": machine.spread(seconds),
            "mad_seconds": round(mad, 6),
            "median_mpaths_per_s": round(paths / median / 1e6, 4),
            "ours_over_this": round(median / statistics.median(times["lanecast"]), 4),
            "relative_variance": f"{noise[name]:.6g}" if name in noise else "",
            "variance_of_ours_over_this": round(noise["lanecast"] / noise[name], 4) if name in noise else "",
            "seeds": args.seeds if name in noise else "",
            "worst_region_off": round(off, 5),
            "command": " ".join(["mitsuba_speed.py", *args.shown]),
        }
    for program in programs.values():
        if isinstance(program, Mitsuba):
            program.end()


def main():
    if sys.argv[1:2] == ["--serve"]:
        return serve(sys.argv[2], sys.argv[3], *map(int, sys.argv[4:7]))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=10)
    parser.add_argument("--seeds", type=int, default=16, help="pictures for the comparison and the variance, at least 2")
    parser.add_argument("--variants", default="scalar_rgb,llvm_ad_rgb")
    parser.add_argument("-o", dest="out", default="-")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    args = parser.parse_args()
    args.shown = [os.path.basename(a) if "/" in a else a for a in sys.argv[1:]]
    scenes = args.scenes or sorted((HERE.parent / "mitsuba").glob("*.json"))
    file = sys.stdout if args.out == "-" else open(args.out, "w", encoding="utf-8", newline="")
    writer = None
    for scene in scenes:
        for row in measure(args, scene):
            if writer is None:
                writer = csv.DictWriter(file, row.keys())
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(
                f"{row['scene']} {row['program']}: {row['median_mpaths_per_s']} Mpaths/s, spread {row['spread']}, "
                f"ours is {row['ours_over_this']} times as fast, variance {row['relative_variance'] or '-'} "
                f"(ours over it {row['variance_of_ours_over_this'] or '-'})",
                file=sys.stderr,
            )


if __name__ == "__main__":
    main()
