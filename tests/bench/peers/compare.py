#!/usr/bin/env python3
"""CPU and wall seconds that Blender's Cycles and Lightmill need to reach an error, on the same scene.

  tests/bench/peers/compare.py SCENE -o FOLDER --reference REFERENCE.exr [--method M] [--samples 16,64,256] ...

SCENE is the document of a Cornell box, or a Blender file. Both render it at several sample counts and seeds. All pictures are compared
with the reference (`lightmill error`). FOLDER gets results.csv, summary.txt and lab/report.html. Needs Blender. The time of Cycles is that
of the render call in a running Blender with the loaded scene. That of Lightmill is from submission until the job is done, of coordinator,
worker and submitting client of a running farm.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from measured_farm import farm, lightmill  # noqa: E402


def numbers(text):
    return [int(word) for word in text.split(",")]


def options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("-o", dest="folder", type=pathlib.Path, required=True)
    parser.add_argument("--reference", type=pathlib.Path, required=True, help="an EXR with a tenth of the errors to be judged")
    parser.add_argument("--method", default="path", help="Lightmill's (default: %(default)s)")
    parser.add_argument("--samples", type=numbers, default=[16, 64, 256], help="Lightmill's, a pixel")
    parser.add_argument("--cycles-samples", type=numbers, default=[16, 64, 256], help="Cycles', a pixel")
    parser.add_argument("--seeds", type=numbers, default=[1, 2, 3])
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--errors", type=lambda text: [float(word) for word in text.split(",")], default=[0.01, 0.001])
    return parser.parse_args()


def blender_command(file, script, *arguments):
    """The command that runs a script in Blender, with an open file or without. Blender's Python would take the modules of another Python
    that it finds first in PATH."""
    blender = shutil.which(os.environ.get("LIGHTMILL_BLENDER", "blender"))
    if blender is None:
        sys.exit("needs Blender: deploy/setup --blender installs it")
    return ["/usr/bin/env", f"PATH={os.defpath}", blender, "--background", "--factory-startup", "--disable-autoexec", *file,
            "--python-exit-code", "3", "--python", str(script), "--", *map(str, arguments)]


def document_of(args):
    """The scene as a document. A Blender file is exported, as the command line does it."""
    if args.scene.suffix != ".blend":
        return args.scene
    script = pathlib.Path(__file__).resolve().parents[3] / "client/blender/run.py"
    subprocess.run(blender_command([str(args.scene)], script, args.folder / "export", 1024), check=True, stdout=subprocess.DEVNULL)
    return args.folder / "export/scene.json"


def run_cycles(args):
    command = blender_command([], pathlib.Path(__file__).with_name("cycles_render.py"), args.scene, args.folder, args.threads,
                              ",".join(map(str, args.cycles_samples)), ",".join(map(str, args.seeds)))
    log = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as blender:
        for line in blender.stdout:
            if line.startswith("PEER "):
                run = json.loads(line[5:])
                print(f"Cycles {run['samples']} samples, seed {run['seed']}: {run['cpu']:.2f} CPU s", file=sys.stderr)
                yield run
            else:
                log = (log + [line])[-20:]
    if blender.returncode != 0:
        sys.exit("Blender failed:\n" + "".join(log))


def run_lightmill(args, document):
    with farm(args.folder, args.threads) as own:
        common = ["--method", args.method]
        own.render(document, *common, "--spp", 1, "--seed", 999)  # loads the scene
        for samples in args.samples:
            for seed in args.seeds:
                job, cpu, wall = own.render(document, *common, "--spp", samples, "--seed", seed)
                picture = args.folder / f"lightmill-{samples}-{seed}.exr"
                own.fetch(job, picture)
                print(f"Lightmill {samples} samples, seed {seed}: {cpu:.2f} CPU s", file=sys.stderr)
                yield {"samples": samples, "seed": seed, "cpu": cpu, "wall": wall, "picture": str(picture)}


def judge(run, reference):
    return run | json.loads(lightmill("error", run["picture"], reference, "--json"))


def seconds_to(error, curve, column, unit):
    """Seconds at which a seed's curve (its runs by samples) reaches the error, and whether it does. If not, the time is a lower
    bound. Interpolates on logarithmic scales. Before the first point, error × time is constant, as for noise."""
    points = [(run[unit], run[column]) for run in curve]
    if points[0][1] <= error:
        return points[0][0] * points[0][1] / error, True
    for (s0, e0), (s1, e1) in zip(points, points[1:]):
        if e1 <= error < e0:
            along = math.log(e0 / error) / math.log(e0 / e1)
            return s0 * (s1 / s0) ** along, True
    return points[-1][0], False


def median_seconds(results, renderer, error, column, unit):
    """Summary of all seeds: the median, whether it is a lower bound, and the range."""
    seeds = sorted({run["seed"] for run in results})
    reached = [seconds_to(error, sorted((run for run in results if run["renderer"] == renderer and run["seed"] == seed),
                                        key=lambda run: run["samples"]), column, unit) for seed in seeds]
    times = sorted(reached)
    short = sum(1 for _, there in reached if not there)
    middle = statistics.median(time for time, _ in times)
    exact = all(there for time, there in times[:len(times) // 2 + 1])
    text = f"{unit} {'' if exact else 'over '}{middle:.3g} s ({times[0][0]:.3g} to {times[-1][0]:.3g}"
    return middle, exact, text + (f"; {short} of {len(seeds)} seeds not there yet)" if short else ")")


def summarise(results, args):
    columns = [key for key in ("rel_mse", "rel_mse_trimmed") if key in results[0]]
    for column in columns:
        for error in args.errors:
            found = {(renderer, unit): median_seconds(results, renderer, error, column, unit)
                     for renderer in ("cycles", "lightmill") for unit in ("cpu", "wall")}
            for renderer in ("cycles", "lightmill"):
                yield f"{column} {error:g}  {renderer:9}  " + ";  ".join(found[renderer, unit][2] for unit in ("cpu", "wall"))
            for unit in ("cpu", "wall"):
                theirs, ours = found["cycles", unit], found["lightmill", unit]
                if ours[1]:
                    bound = "" if theirs[1] else "over "
                    yield f"{column} {error:g}  Cycles / Lightmill, {unit}: {bound}{theirs[0] / ours[0]:.3g}"
    for renderer in ("cycles", "lightmill"):
        most = max(run["samples"] for run in results if run["renderer"] == renderer)
        last = [run for run in results if run["renderer"] == renderer and run["samples"] == most]
        yield (f"{renderer}, {most} samples: energy over the reference's {statistics.mean(r['energy_ratio'] for r in last):.4f}, "
               f"relMSE {statistics.median(r['rel_mse'] for r in last):.3g}")


def write_page(results, args, document):
    """The curves of both, by CPU seconds, as `lightmill lab` draws them."""
    name = args.scene.stem
    names = {"lightmill": f"Lightmill {args.method}", "cycles": "Cycles"}
    with open(args.folder / "pictures.jsonl", "w", encoding="utf-8") as file:
        for run in results:
            line = {"scene": name, "method": names[run["renderer"]], "seed": run["seed"], "samples": run["samples"],
                    "seconds": run["cpu"], "wall": run["wall"], "picture": run["picture"]}
            file.write(json.dumps(line) + "\n")
    experiment = {"title": f"{name}: Lightmill and Cycles, CPU seconds", "others": "pictures.jsonl",
                  "scenes": [{"name": name, "file": str(document)}], "reference": str(args.reference.resolve())}
    (args.folder / "experiment.json").write_text(json.dumps(experiment))
    lightmill("lab", args.folder / "experiment.json", "-o", args.folder / "lab")


def main():
    args = options()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.folder, args.scene = args.folder.resolve(), args.scene.resolve()
    document = document_of(args)
    results = []
    for renderer, runs in (("lightmill", run_lightmill(args, document)), ("cycles", run_cycles(args))):
        results += [{"renderer": renderer} | judge(run, args.reference) for run in runs]
    with open(args.folder / "results.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, fieldnames=results[0].keys(), extrasaction="ignore")
        table.writeheader()
        table.writerows(results)
    write_page(results, args, document)
    summary = "\n".join(summarise(results, args)) + "\n"
    (args.folder / "summary.txt").write_text(summary)
    print(summary, end="")


if __name__ == "__main__":
    main()
