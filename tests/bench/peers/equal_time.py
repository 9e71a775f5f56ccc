#!/usr/bin/env python3
"""Pictures by Blender's Cycles and by Lightmill that took the same CPU time.

  tests/bench/peers/equal_time.py SCENE.blend -o FOLDER [--seconds 60] [--method M]

First both render few samples, to measure the CPU seconds of a sample. FOLDER gets cycles.png and lightmill.png, shown alike and not
denoised, and times.txt with the samples and CPU seconds of both. Needs Blender. compare.py says what the times are.
"""
import argparse
import copy
import os
import pathlib
import sys

from compare import document_of, run_cycles, run_lightmill

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from measured_farm import lightmill  # noqa: E402

PILOT = [8, 24]  # samples a pixel


def options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("scene", type=pathlib.Path, help="a Blender file")
    parser.add_argument("-o", dest="folder", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=float, default=60, help="CPU seconds of each picture (default: %(default)s)")
    parser.add_argument("--method", default="path", help="Lightmill's (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    return parser.parse_args()


def at_seconds(run, args, name):
    """The run whose CPU time is about the wanted one. `name`: the argument that has the samples."""
    def with_samples(samples):
        own = copy.copy(args)
        setattr(own, name, samples)
        own.seeds = [1]
        return list(run(own))
    few, more = with_samples(PILOT)
    per_sample = max((more["cpu"] - few["cpu"]) / (PILOT[1] - PILOT[0]), 1e-6)
    samples = max(round((args.seconds - few["cpu"]) / per_sample) + PILOT[0], 1)
    return with_samples([samples])[0]


def main():
    args = options()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.folder, args.scene = args.folder.resolve(), args.scene.resolve()
    document = document_of(args)
    lines = []
    for renderer, run, name in (("lightmill", lambda own: run_lightmill(own, document), "samples"),
                                ("cycles", run_cycles, "cycles_samples")):
        found = at_seconds(run, args, name)
        lightmill("convert", found["picture"], "-o", args.folder / f"{renderer}.png")
        lines.append(f"{renderer}: {found['samples']} samples per pixel, {found['cpu']:.1f} CPU s")
        print(lines[-1])
    (args.folder / "times.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
