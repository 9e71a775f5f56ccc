#!/usr/bin/env python3
"""Cost of `auto` over the best of the methods that find all light, on a running farm.

  tests/bench/regret.py [SCENE.json ...] -o FOLDER [--seconds 60] [--short 15] [--size 256x256] [--seeds 4]

Renders each scene (default: all of scenes/) by each method that the planner admits, except ppm. Methods between which the
pilot of auto has a choice get --seconds of CPU for each seed, the others --short seconds and two seeds. A method's error is half
of the relMSE between pictures of different seeds. A job's cost is error x CPU seconds, with those of auto's pilot. Writes
FOLDER/results.csv and prints a table. The difference of two methods' pictures beyond both errors is their bias.
"""
import argparse
import csv
import itertools
import json
import math
import pathlib
import statistics
import sys

from measured_farm import farm, lightmill

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"


def options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("scenes", type=pathlib.Path, nargs="*", default=sorted(SCENES.glob("*.json")))
    parser.add_argument("-o", dest="folder", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=float, default=60, help="CPU seconds of jobs with a pilot (default: %(default)g)")
    parser.add_argument("--short", type=float, default=15, help="CPU seconds of all others (default: %(default)g)")
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--threads", type=int, default=2)
    return parser.parse_args()


def error_between(one, other):
    """relMSE of two pictures, with each as the reference in turn."""
    return statistics.mean(json.loads(lightmill("error", a, b, "--json"))["rel_mse"] for a, b in ((one, other), (other, one)))


def samples_for(own, scene, method, seconds, args):
    """A multiple of 256 samples that takes this many CPU seconds."""
    common = ["--method", method, "--size", args.size, "--seed", 99]
    own.render(scene, *common, "--spp", 1)
    _, few, _ = own.render(scene, *common, "--spp", 256)  # paths of the first 256 samples are split
    _, more, _ = own.render(scene, *common, "--spp", 512)
    return 256 + 256 * math.ceil(max(0, (seconds - few) / max(more - few, 1e-3)))


def measure(own, scene, args):
    check = json.loads(lightmill("check", scene, "--json"))
    may_take = check["auto"]["methods"]
    methods = [method["name"] for method in check["methods"] if method["admitted"] and method["name"] != "ppm"]
    piloted = len(may_take) > 1
    samples, pictures, rows = {}, {}, []

    def row(asked, method, seed, cpu):
        rows.append({"scene": scene.stem, "asked": asked, "method": method, "seed": seed, "samples": samples[method], "cpu": cpu})

    for method in methods:
        long = piloted and method in may_take
        samples[method] = samples_for(own, scene, method, args.seconds if long else args.short, args)
        pictures[method] = []
        for seed in range(1, 1 + (args.seeds if long else 2)):
            job, cpu, _ = own.render(scene, "--method", method, "--size", args.size, "--spp", samples[method], "--seed", seed)
            picture = args.folder / f"{scene.stem}-{method}-{seed}.exr"
            own.fetch(job, picture)
            pictures[method].append(picture)
            row(method, method, seed, cpu)
            if not piloted and method == may_take[0]:
                row("auto", method, seed, cpu)
    for seed in range(1, 1 + (args.seeds if piloted else 0)):
        # The pilot runs before the first sample, so a job of one sample shows its choice.
        job, _, _ = own.render(scene, "--size", args.size, "--spp", 1, "--seed", seed)
        chosen = own.show(job)["method"]
        job, cpu, _ = own.render(scene, "--size", args.size, "--spp", samples[chosen], "--seed", seed)
        if own.show(job)["method"] != chosen:
            sys.exit(f"{scene.stem}, seed {seed}: the pilot chose {chosen} once, and otherwise the next time")
        row("auto", chosen, seed, cpu)
    report(scene.stem, methods, pictures, rows)
    return rows


def report(scene, methods, pictures, rows):
    errors = {method: statistics.mean(error_between(*pair) for pair in itertools.combinations(of, 2)) / 2
              for method, of in pictures.items()}
    for row in rows:
        row["rel_mse"] = errors[row["method"]]
        row["cost"] = row["rel_mse"] * row["cpu"]
    cost = {method: statistics.mean(row["cost"] for row in rows if row["asked"] == method) for method in methods}
    best = min(cost, key=cost.get)
    print(f"\n{scene}")
    for method in methods:
        of = [row for row in rows if row["asked"] == method]
        cpu = [row["cpu"] for row in of]
        print(f"  {method:10} {of[0]['samples']:6} samples, {statistics.mean(cpu):6.1f} CPU s ({min(cpu):.1f} to {max(cpu):.1f}), "
              f"relMSE {errors[method]:.3g}, {cost[method] / cost[best]:.2f} times the best's time")
    for one, other in itertools.combinations(methods, 2):
        apart = statistics.mean(error_between(a, b) for a, b in zip(pictures[one], pictures[other][1:] + pictures[other][:1]))
        print(f"  {one} and {other} are {apart:.3g} apart; {errors[one] + errors[other]:.3g} of this is noise")
    for row in rows:
        if row["asked"] == "auto":
            row["regret"] = row["cost"] / cost[best]
            print(f"  auto, seed {row['seed']}: {row['method']}, {row['cpu']:.1f} CPU s, regret {row['regret']:.3f}")
    sys.stdout.flush()


def main():
    args = options()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.folder = args.folder.resolve()
    rows = []
    with farm(args.folder, args.threads) as own:
        for scene in args.scenes:
            rows += measure(own, scene.resolve(), args)
    with open(args.folder / "results.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, fieldnames=["scene", "asked", "method", "seed", "samples", "cpu", "rel_mse", "cost", "regret"])
        table.writeheader()
        table.writerows(rows)
    regrets = [row["regret"] for row in rows if "regret" in row]
    if regrets:
        print(f"\nregret of {len(regrets)} jobs: geometric mean {statistics.geometric_mean(regrets):.3f}, worst {max(regrets):.3f}")


if __name__ == "__main__":
    main()
