#!/usr/bin/env python3
"""CPU and wall seconds that Blender's Cycles and Lightmill need to a given error, on the same scene.

  tests/bench/peers/compare.py SCENE.json -o FOLDER --reference REFERENCE.exr [--method M] [--samples 16,64,256] ...

Renders the scene with both at several sample counts and seeds, compares all pictures with the reference
(`lightmill error`), and writes FOLDER/results.csv, FOLDER/summary.txt and FOLDER/lab/report.html. Counted is the CPU time of Cycles' render call
in a Blender that is up and has the scene; and of coordinator, worker and submitting client, from submission until the
job is done, on a farm that is up. Seconds to an error are read off each seed's curve by straight lines between its
points on logarithmic scales, before its first point along the slope of noise (error × time is constant); what lies
beyond the last point is not guessed but named. Needs Blender.
"""
import argparse
import contextlib
import csv
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROGRAMS = ROOT / "build/release/bin"
TICK = os.sysconf("SC_CLK_TCK")


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


def run_cycles(args):
    command = [os.environ.get("LIGHTMILL_BLENDER", "blender"), "--background", "--factory-startup", "--python-exit-code", "3",
               "--python", str(pathlib.Path(__file__).with_name("cycles_render.py")), "--", str(args.scene), str(args.folder),
               str(args.threads), ",".join(map(str, args.cycles_samples)), ",".join(map(str, args.seeds))]
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


def cpu_seconds(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


@contextlib.contextmanager
def farm(folder, threads):
    """A coordinator and a worker; gives its address and the two processes."""
    port_file = folder / "port"
    port_file.unlink(missing_ok=True)
    with open(folder / "farm.log", "w", encoding="utf-8") as log:
        server = subprocess.Popen([PROGRAMS / "lightmill-server", "--data", folder / "data", "--listen", "127.0.0.1:0",
                                   "--port-file", port_file], stdout=log, stderr=log)
        worker = None
        try:
            while not port_file.exists():
                if server.poll() is not None:
                    sys.exit(f"the coordinator ended, see {folder / 'farm.log'}")
                time.sleep(0.01)
            address = f"127.0.0.1:{port_file.read_text().strip()}"
            worker = subprocess.Popen([PROGRAMS / "lightmill-worker", "--server", address, "--threads", str(threads)],
                                      stdout=log, stderr=log)
            yield address, (server, worker)
        finally:
            for process in filter(None, (worker, server)):
                process.terminate()
                process.wait()


def run_lightmill(args):
    with farm(args.folder, args.threads) as (address, processes):
        common = ["--server", address]

        def render(samples, seed):
            submitted = subprocess.run([PROGRAMS / "lightmill", "submit", args.scene, *common, "--method", args.method,
                                        "--spp", str(samples), "--seed", str(seed), "--json"],
                                       check=True, capture_output=True, text=True)
            job = str(json.loads(submitted.stdout)["id"])
            subprocess.run([PROGRAMS / "lightmill", "watch", job, *common, "--json"], check=True, capture_output=True)
            return job

        render(1, 999)  # loads the scene
        for samples in args.samples:
            for seed in args.seeds:
                client = sum(os.times()[2:4])
                cpu, wall = sum(map(cpu_seconds, processes)), time.monotonic()
                job = render(samples, seed)
                cpu, wall = sum(map(cpu_seconds, processes)) - cpu, time.monotonic() - wall
                cpu += sum(os.times()[2:4]) - client
                picture = args.folder / f"lightmill-{samples}-{seed}.exr"
                subprocess.run([PROGRAMS / "lightmill", "fetch", job, *common, "-o", picture], check=True, capture_output=True)
                print(f"Lightmill {samples} samples, seed {seed}: {cpu:.2f} CPU s", file=sys.stderr)
                yield {"samples": samples, "seed": seed, "cpu": cpu, "wall": wall, "picture": str(picture)}


def judge(run, reference):
    compared = subprocess.run([PROGRAMS / "lightmill", "error", run["picture"], reference, "--json"],
                              check=True, capture_output=True, text=True)
    return run | json.loads(compared.stdout)


def seconds_to(error, curve, column, unit):
    """Seconds at which a seed's curve, [(seconds, error)] by samples, comes down to the error; None if it does not."""
    points = [(run[unit], run[column]) for run in curve]
    if points[0][1] <= error:
        return points[0][0] * points[0][1] / error
    for (s0, e0), (s1, e1) in zip(points, points[1:]):
        if e1 <= error < e0:
            along = math.log(e0 / error) / math.log(e0 / e1)
            return s0 * (s1 / s0) ** along
    return None


def summarise(results, args):
    columns = [key for key in ("rel_mse", "rel_mse_trimmed") if key in results[0]]
    for column in columns:
        for error in args.errors:
            medians = {}
            for renderer in ("cycles", "lightmill"):
                row = []
                for unit in ("cpu", "wall"):
                    reached = []
                    for seed in args.seeds:
                        curve = sorted((run for run in results if run["renderer"] == renderer and run["seed"] == seed),
                                       key=lambda run: run["samples"])
                        reached.append(seconds_to(error, curve, column, unit))
                    if None in reached:
                        best = min(run[column] for run in results if run["renderer"] == renderer)
                        row.append(f"{unit} not reached by {reached.count(None)} of {len(reached)} seeds (best {best:.3g})")
                    else:
                        medians[renderer, unit] = statistics.median(reached)
                        row.append(f"{unit} {medians[renderer, unit]:.3g} s ({min(reached):.3g} to {max(reached):.3g})")
                yield f"{column} {error:g}  {renderer:9}  " + ";  ".join(row)
            for unit in ("cpu", "wall"):
                if ("cycles", unit) in medians and ("lightmill", unit) in medians:
                    ratio = medians["cycles", unit] / medians["lightmill", unit]
                    yield f"{column} {error:g}  Cycles / Lightmill, {unit}: {ratio:.3g}"
    for renderer in ("cycles", "lightmill"):
        most = max(run["samples"] for run in results if run["renderer"] == renderer)
        energy = [run["energy_ratio"] for run in results if run["renderer"] == renderer and run["samples"] == most]
        yield f"energy of {renderer} over the reference's, {most} samples: {statistics.mean(energy):.4f}"


def write_page(results, args):
    """The curves of both, by CPU seconds, as `lightmill lab` draws them."""
    name = args.scene.stem
    names = {"lightmill": f"Lightmill {args.method}", "cycles": "Cycles"}
    with open(args.folder / "pictures.jsonl", "w", encoding="utf-8") as file:
        for run in results:
            line = {"scene": name, "method": names[run["renderer"]], "seed": run["seed"], "samples": run["samples"],
                    "seconds": run["cpu"], "wall": run["wall"], "picture": run["picture"]}
            file.write(json.dumps(line) + "\n")
    experiment = {"title": f"{name}: Lightmill and Cycles, CPU seconds", "others": "pictures.jsonl",
                  "scenes": [{"name": name, "file": str(args.scene)}], "reference": str(args.reference.resolve())}
    (args.folder / "experiment.json").write_text(json.dumps(experiment))
    subprocess.run([PROGRAMS / "lightmill", "lab", args.folder / "experiment.json", "-o", args.folder / "lab"], check=True)


def main():
    args = options()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.folder, args.scene = args.folder.resolve(), args.scene.resolve()
    results = []
    for renderer, runs in (("lightmill", run_lightmill(args)), ("cycles", run_cycles(args))):
        results += [{"renderer": renderer} | judge(run, args.reference) for run in runs]
    with open(args.folder / "results.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, fieldnames=results[0].keys(), extrasaction="ignore")
        table.writeheader()
        table.writerows(results)
    write_page(results, args)
    summary = "\n".join(summarise(results, args)) + "\n"
    (args.folder / "summary.txt").write_text(summary)
    print(summary, end="")


if __name__ == "__main__":
    main()
