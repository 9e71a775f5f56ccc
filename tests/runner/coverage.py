"""Which lines the tests run, by gcov and gcovr."""
import json
import shutil
import subprocess

from builds import build
from process import BUILD, ROOT, Failed, Row, run_logged, show_end_of
from results import CORES, print_table, run_tests

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
    """Runs the default suite, or with `everything` also the long tests, and prints the share of lines they run by folder."""
    if shutil.which("gcovr") is None:
        subprocess.run(["deploy/setup", "--coverage"], cwd=ROOT, check=True)
    preset = "coverage"
    build(preset, ["all_tests"])
    for counts in (BUILD / preset).rglob("*.gcda"):
        counts.unlink()
    by_label, total = run_tests(preset, ("-L", ".") if everything else ("-LE", "long"))
    print_table([*by_label, total])
    files = measure(preset, BUILD / preset / "gcovr.log", BUILD / preset / "coverage.json")["files"]
    print(f"\n{'folder':<10} {'lines':>7} {'run':>7} {'share':>7}")
    for name, chosen in [*((folder, [f for f in files if f["filename"].startswith(folder + "/")]) for folder in FOLDERS),
                         ("all", files)]:
        lines, run = sum(f["line_total"] for f in chosen), sum(f["line_covered"] for f in chosen)
        print(f"{name:<10} {lines:>7} {run:>7} {100 * run / max(lines, 1):>6.1f}%")
    return total.failed == 0
