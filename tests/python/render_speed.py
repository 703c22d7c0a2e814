"""Times whole pictures of two builds of lanecast in turns, after comparing them.

Usage: render_speed.py --program NEW --against OLD [--repeat 9] [--size 1280x720] [--spp 4] [-o FILE.csv] [SCENE...]

The pictures are compared first: less than 60 dB between them is no result, as it is not the same work. Then the builds
take turns, one thread each; a ratio is the median over rounds of old over new. Seconds are those of the render itself, without
reading, building and writing. SCENE may be followed by options in the same word, as in "model.ply --integrator ao".
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import machine

SCENES = ["builtin:gallery", "builtin:still-life", "builtin:bolt", "builtin:teaching", "builtin:sphere-flake", "builtin:forest"]
# Decibels between pictures that count as the same.
SAME = 60.0


def run(program, words):
    return json.loads(subprocess.check_output([program, *words], text=True))


def revision(program):
    return subprocess.check_output([program, "--version"], text=True).split("revision ")[1].split(",")[0]


def measure(args, scene, folder):
    words = ["render", *scene.split(), "--size", args.size, "--spp", str(args.spp), "--threads", "1", "--json", "-q", "-o"]
    pictures = [folder / "new.exr", folder / "old.exr"]
    programs = [args.program, args.against]
    reports = [run(program, [*words, str(picture)]) for program, picture in zip(programs, pictures)]
    psnr = run(args.program, ["compare", *map(str, pictures), "--json"])["psnr"]
    if psnr is not None and psnr < SAME:
        raise SystemExit(f"{scene}: {psnr:.1f} dB between the pictures: no result")
    seconds = [[], []]
    for _ in range(args.repeat):
        for k, program in enumerate(programs):
            seconds[k].append(run(program, [*words, str(pictures[k])])["seconds"])
    ratios = [old / new for new, old in zip(*seconds)]
    model, flags = machine.cpu()
    return {
        "revision": revision(args.program),
        "against": revision(args.against),
        "date": machine.now(),
        "cpu": model,
        "flags": flags,
        "threads": 1,
        "scene": scene.split()[0].rsplit("/", 1)[-1],
        "scene_hash": run(args.program, ["info", scene.split()[0], "--json"])["hash"],
        "size": args.size,
        "spp": args.spp,
        "engine": reports[0]["engine"],
        "rays": reports[0]["rays"]["total"],
        "psnr_db": "inf" if psnr is None else round(psnr, 1),
        "repeat": args.repeat,
        "median_seconds": round(statistics.median(seconds[0]), 4),
        "median_seconds_against": round(statistics.median(seconds[1]), 4),
        "spread": machine.spread(seconds[0]),
        "times_as_fast": round(statistics.median(ratios), 3),
        "least": round(min(ratios), 3),
        "most": round(max(ratios), 3),
        "command": " ".join(["lanecast", *words[:-1]]),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--against", required=True)
    parser.add_argument("--repeat", type=int, default=9)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("-o", "--output")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=SCENES)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for scene in args.scenes:
            row = measure(args, scene, pathlib.Path(folder))
            print(f"{scene:40} {row['times_as_fast']:6.2f} times as fast ({row['least']} to {row['most']}), {row['psnr_db']} dB")
            rows.append(row)
    if args.output:
        machine.write_rows(args.output, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
