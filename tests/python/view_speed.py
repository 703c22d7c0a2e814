"""How long a person waits: first pictures, blocks, orbits, edits.

Usage: view_speed.py --program target/release/lanecast [--sponza FILE.ply] [--repeat 11] [--threads 2] [--only KIND,...]
       [-o FOLDER] [SCENE...]

Writes a table per kind to FOLDER: `first` (time to the first blocks of 16 pixels, and to the finished picture, of a built
scene), `blocks` (render by blocks over the plain render of the same bits, in turns), `orbit` (frames per second, each
finished; and how many finish in 33 ms), `edit` (from a save to the first new picture). With --sponza the nave of that
mesh is one of the scenes, and the edits are made beside it.
"""

import argparse
import csv
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import machine

SCENES = ["builtin:gallery", "builtin:sphere-flake", "builtin:forest", "builtin:bolt"]
NAVE = """camera "nave" { eye -1100 180 -30; look-at 1000 350 0; up 0 1 0; fov 60 }
light point { position -200 900 0; intensity 900000 }
define "hall" { mesh "sponza.ply" }
"""
HALL = 'instance "hall" { translate 0 0 %d }\n'
SOLID = "difference { translate 200 300 0; box { size 300 300 300 }; sphere radius=%d }\n"
BOLT = pathlib.Path(__file__).resolve().parents[2] / "scenes/bolt.kdl"


class Bench:
    """Where and with what is measured."""

    def __init__(self, args, folder):
        self.args, self.folder = args, folder
        self.scenes = list(args.scenes or SCENES)
        if args.sponza:
            self.mesh = folder / "sponza.ply"
            shutil.copyfile(args.sponza, self.mesh)
            (folder / "sponza.kdl").write_text(NAVE + HALL % 0)
            self.scenes.append("sponza.kdl")

    def run(self, *words):
        command = [self.args.program, *map(str, words), "--threads", str(self.args.threads), "-q"]
        return subprocess.run(command, cwd=self.folder, check=True, capture_output=True, text=True).stdout

    def view(self, scene, script, *words):
        (self.folder / "script.txt").write_text(script)
        shown = self.run("view", scene, "--size", "1280x720", "--headless-script", "script.txt", *words)
        return [json.loads(line) for line in shown.splitlines()]

    def row(self, scene, values, **more):
        """A row: medians and spreads of `values`, milliseconds or ratios."""
        model, flags = machine.cpu()
        info = json.loads(subprocess.check_output([self.args.program, "info", scene, "--json"], cwd=self.folder))
        version = subprocess.check_output([self.args.program, "--version"], text=True)
        row = {
            "revision": version.split("revision ")[1].split(",")[0],
            "date": machine.now(),
            "cpu": model,
            "flags": flags,
            "threads": self.args.threads,
            "scene": scene,
            "scene_hash": info["hash"],
            **more,
        }
        for name, measured in values.items():
            row["repeat"] = len(measured)
            row[name] = round(statistics.median(measured), 4)
            row[f"{name}_spread"] = machine.spread(measured)
        row["command"] = " ".join(["view_speed.py", *self.args.shown])
        return row


def milliseconds(objects, key):
    return [1e3 * one[key] for one in objects]


def first(bench):
    for scene in bench.scenes:
        shown = bench.view(scene, "wait\n" * bench.args.repeat)
        yield bench.row(
            scene,
            {
                "first_blocks_ms": milliseconds(shown, "first_picture_seconds"),
                "finished_ms": milliseconds(shown, "seconds"),
            },
            size="1280x720",
        )


def blocks(bench):
    for scene in bench.scenes:
        for spp in (1, 4, 16):
            seconds = {"plain": [], "blocks": []}
            for _ in range(bench.args.repeat):
                for name, words in (("plain", ["--exact"]), ("blocks", ["--blocks", 16])):
                    size = ["--size", "1920x1080", "--spp", spp]
                    report = bench.run("render", scene, "-o", f"{name}.npy", "--json", *size, *words)
                    seconds[name].append(json.loads(report)["seconds"])
                if (bench.folder / "plain.npy").read_bytes() != (bench.folder / "blocks.npy").read_bytes():
                    raise SystemExit(f"{scene}: the pictures differ: no result")
            pairs = [b / a for a, b in zip(seconds["plain"], seconds["blocks"])]
            values = {f"{name}_ms": [1e3 * s for s in taken] for name, taken in seconds.items()}
            yield bench.row(scene, {**values, "blocks_over_plain": pairs}, size="1920x1080", spp=spp)


def orbit(bench):
    frames = 40
    for scene in bench.scenes:
        for engine in ("auto", "tile"):
            turns = f"spin {frames} 2 0\n" * bench.args.repeat
            try:
                shown = bench.view(scene, turns + f"spin {frames} 2 33\n", "--engine", engine)
            except subprocess.CalledProcessError:
                # No such engine in the scene's precision.
                continue
            yield bench.row(
                scene,
                {
                    "frames_per_second": [one["frames_per_second"] for one in shown[:-1]],
                    "mrays_per_s": [one["mrays_per_s"] for one in shown[:-1]],
                },
                size="1280x720",
                engine="auto-exact" if engine == "auto" else engine,
                frames=frames,
                finished_in_33_ms=shown[-1]["complete_frames"],
            )


def edit(bench):
    bolt = BOLT.read_text()
    wider = lambda i: bolt.replace("hole.radius 4.2", f"hole.radius {4.2 + 0.01 * i:.2f}")
    cases = {"a solid in bolt.kdl": wider}
    if bench.args.sponza:
        cases["a solid beside sponza"] = lambda i: NAVE + HALL % 0 + SOLID % (160 + i)
        cases["the place of sponza beside a solid"] = lambda i: NAVE + HALL % i + SOLID % 160
    for name, text in cases.items():
        file = bench.folder / "edited.kdl"
        file.write_text(text(0))
        script = "wait\n" + "reload 60\n" * bench.args.repeat
        (bench.folder / "script.txt").write_text(script)
        command = [bench.args.program, "view", file.name, "--size", "1280x720", "--headless-script", "script.txt", "-q"]
        command += ["--threads", str(bench.args.threads)]
        view = subprocess.Popen(command, cwd=bench.folder, stdout=subprocess.PIPE, text=True)
        view.stdout.readline()
        shown = []
        for i in range(1, bench.args.repeat + 1):
            time.sleep(0.2)
            file.write_text(text(i))
            shown.append(json.loads(view.stdout.readline()))
        view.wait()
        wrong = [one for one in shown if one.get("error") or not one["changed"]]
        if wrong:
            raise SystemExit(f"{name}: {wrong}")
        keys = ["save_to_picture", "open", "build", "first_picture"]
        values = {f"{key}_ms": milliseconds(shown, f"{key}_seconds") for key in keys}
        yield bench.row(file.name, values, edited=name, size="1280x720")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, type=os.path.abspath)
    parser.add_argument("--sponza", type=pathlib.Path)
    parser.add_argument("--repeat", type=int, default=11)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--only", default="first,blocks,orbit,edit")
    parser.add_argument("-o", dest="out", type=pathlib.Path, default=pathlib.Path("."))
    parser.add_argument("scenes", nargs="*")
    args = parser.parse_args()
    args.shown = [os.path.basename(a) if "/" in a else a for a in sys.argv[1:]]
    args.out.mkdir(parents=True, exist_ok=True)
    kinds = {"first": first, "blocks": blocks, "orbit": orbit, "edit": edit}
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(args, pathlib.Path(folder))
        for kind in args.only.split(","):
            with open(args.out / f"{kind}.csv", "w", encoding="utf-8", newline="") as file:
                writer = None
                for row in kinds[kind](bench):
                    if writer is None:
                        writer = csv.DictWriter(file, row.keys())
                        writer.writeheader()
                    writer.writerow(row)
                    file.flush()
                    hidden = ("revision", "date", "cpu", "flags", "scene_hash", "command")
                    print(" ".join(f"{k}={v}" for k, v in row.items() if k not in hidden), file=sys.stderr)


if __name__ == "__main__":
    main()
