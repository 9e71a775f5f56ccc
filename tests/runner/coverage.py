"""Measures which lines the tests run, with gcov and gcovr."""
import json
import shutil

from builds import build, files_of, runs_of
from process import BUILD, CORES, ROOT, Failed, Stopwatch, install_packages, run_logged, show_end_of
from results import print_end, run_tests

OTHER_BUILDS = ("deploy.quickstart", "deploy.package", "deploy.container")  # runs that test programs of other builds
FOLDERS = ("common", "server", "worker", "client")


def measure(preset, log, summary):
    """gcovr's summary of a build folder whose tests have run."""
    filters = [word for folder in FOLDERS for word in ("--filter", f"{folder}/")]
    command = ["gcovr", "--root", str(ROOT), "--object-directory", f"build/{preset}", *filters, "-j", str(CORES),
               "--json-summary", str(summary), f"build/{preset}"]
    if run_logged(command, log) != 0:
        show_end_of(log)
        raise Failed
    return json.loads(summary.read_text())


def run_coverage(everything):
    """Runs the default suite, or with `everything` also the long tests. Prints the share of covered lines by folder."""
    if shutil.which("gcovr") is None:
        install_packages("--coverage")
    preset, folder, watch = "coverage", BUILD / "results" / "coverage", Stopwatch()
    runs = [run for run in runs_of(preset) if "long" not in run.labels or everything and run.name not in OTHER_BUILDS]
    build(preset, files_of(runs), folder / "build.log")
    for counts in (BUILD / preset).rglob("*.gcda"):
        counts.unlink()
    results = run_tests(BUILD / preset, runs, folder, "tests")
    print_end(results, watch)
    files = measure(preset, folder / "gcovr.log", folder / "coverage.json")["files"]
    print(f"\n{'folder':<10} {'lines':>7} {'run':>7} {'share':>7}")
    for name, chosen in [*((folder, [f for f in files if f["filename"].startswith(folder + "/")]) for folder in FOLDERS),
                         ("all", files)]:
        lines, run = sum(f["line_total"] for f in chosen), sum(f["line_covered"] for f in chosen)
        print(f"{name:<10} {lines:>7} {run:>7} {100 * run / max(lines, 1):>6.1f}%")
    return not results.failed
