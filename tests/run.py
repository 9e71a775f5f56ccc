"""Builds and runs the tests: see test.sh, which calls this.

A *run* is one entry of ctest: a test program, a share of one, or a script. A *piece* is a part of `--all` that is built,
run and remembered by itself. The state of `--all` belongs to the sources as they are: a change starts it anew.
"""
import argparse
import dataclasses
import difflib
import hashlib
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"
STATE = BUILD / "all" / "state.json"
LOG = BUILD / "all" / "log"
CORES = os.cpu_count() or 1
# Runs that wait for real processes take one slot, runs that compute take two (cmake/targets.cmake).
SLOTS = 2 * CORES
SHOWN_LINES = 40  # of a failed run's output
KINDS_OF_RUN = ("asan", "long", "threads", "tsan")  # labels that say when a run runs; the others say what it is
MEMORY_DISK = pathlib.Path("/dev/shm")
MEMORY_DISK_BYTES = 4 << 30  # that must be free


@dataclasses.dataclass(frozen=True)
class Piece:
    name: str
    preset: str
    target: str  # of ninja
    select: tuple = ()  # arguments of ctest; empty: the piece only builds


@dataclasses.dataclass
class Row:
    """One line of the closing table. `tests` is None where there are none, as in a build."""
    part: str
    tests: int | None = None
    failed: int = 0
    seconds: float = 0.0
    cpu: float | None = None


class Stopwatch:
    """Seconds, and seconds of CPU time of all processes that ended since."""

    def __init__(self):
        self.begun, self.cpu_begun = time.monotonic(), self.cpu_of_children()

    @staticmethod
    def cpu_of_children():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    def row(self, part, tests=None, failed=0):
        return Row(part, tests, failed, time.monotonic() - self.begun, self.cpu_of_children() - self.cpu_begun)


DEFAULT_PIECES = [
    Piece("release", "release", "all_tests", ("-LE", "long")),
    Piece("address and undefined-behaviour sanitizers", "asan", "tests_of_asan", ("-L", "^asan$")),
    Piece("thread sanitizer", "tsan", "tests_of_tsan", ("-L", "^tsan$")),
]


def all_pieces():
    """Everything but the default suite."""
    pieces = [Piece(f"long: {run['name']}", "release", "all_tests", ("-R", f"^{re.escape(run['name'])}$"))
              for run in runs_of("release") if "long" in run["labels"]]
    for label in ("unit", "fuzz", "simulation"):
        pieces.append(Piece(f"asan: {label}", "asan", f"tests_of_{label}", ("-L", f"^{label}$")))
    for label in ("threads", "unit", "simulation", "statistical"):
        pieces.append(Piece(f"tsan: {label}", "tsan", f"tests_of_{label}", ("-L", f"^{label}$")))
    pieces.append(Piece("fuzzers", "fuzz", "fuzzers", ("-L", ".")))
    pieces.append(Piece("each file compiled by itself", "plain", "all"))
    return pieces


class Failed(Exception):
    """Something other than a test failed: what and where is printed already."""


# ---- processes ----


def run_logged(command, log, show=None, deadline=None):
    """Runs a command with its output in a file; prints the lines that match `show`. Returns its exit code, or None if the
    deadline ended it. Interrupts reach the command, which is waited for."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with open(log, "wb") as out, subprocess.Popen(command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                                  stderr=subprocess.STDOUT, start_new_session=True) as process:
        def end(*_):
            os.killpg(process.pid, signal.SIGTERM)
        previous = signal.signal(signal.SIGALRM, end)
        if deadline is not None:
            signal.setitimer(signal.ITIMER_REAL, max(deadline - time.monotonic(), 0.01))
        try:
            for line in process.stdout:
                out.write(line)
                out.flush()
                if show is not None and re.search(show, line.decode(errors="replace")):
                    print(line.decode(errors="replace").rstrip(), flush=True)
            code = process.wait()
        except KeyboardInterrupt:
            end()
            process.wait()
            raise
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, previous)
    return None if deadline is not None and time.monotonic() >= deadline and code != 0 else code


def show_end_of(log, lines=SHOWN_LINES):
    print("\n".join(log.read_text(errors="replace").splitlines()[-lines:]))


def configure(preset):
    """Only where there is no build folder yet, or one without tests: ninja does it by itself from then on."""
    folder = BUILD / preset
    cache = folder / "CMakeCache.txt"
    if (folder / "build.ninja").exists() and "LIGHTMILL_TESTS:BOOL=ON" in cache.read_text():
        return
    log = folder / "configure.log"
    if run_logged(["cmake", "--preset", preset, "-DLIGHTMILL_TESTS=ON"], log) != 0:
        show_end_of(log)
        raise Failed


def build(preset, targets, deadline=None):
    """False if the deadline came first."""
    configure(preset)
    log = BUILD / preset / "build.log"
    code = run_logged(["ninja", "-C", f"build/{preset}", *targets], log, show=r"^FAILED|error:", deadline=deadline)
    if code is None:
        return False
    if code != 0:
        show_end_of(log)
        print(f"the build failed: {log.relative_to(ROOT)}")
        raise Failed
    return True


# ---- what there is ----


def runs_of(preset):
    """The runs of a build folder: dicts of name, labels and command."""
    configure(preset)
    listed = subprocess.run(["ctest", "--test-dir", f"build/{preset}", "--show-only=json-v1"], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout
    runs = []
    for test in json.loads(listed)["tests"]:
        labels = next((p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"), [])
        runs.append({"name": test["name"], "labels": labels, "command": test.get("command", [])})
    return runs


def programs_of(preset):
    """Each test program and its source files."""
    lines = (BUILD / preset / "test_programs.txt").read_text().splitlines()
    return {words[0]: words[1:] for words in (line.split() for line in lines)}


# ---- reports ----


def cases_of(preset, runs):
    """What the reports of these runs say: (run, test, seconds, failures) each."""
    cases = []
    for run in runs:
        report = BUILD / preset / "reports" / f"{run}.xml"
        if not report.exists():
            continue
        try:
            tree = xml.etree.ElementTree.parse(report)
        except xml.etree.ElementTree.ParseError:
            continue  # the program was killed: ctest says so
        for case in tree.iter("testcase"):
            if case.get("status") == "run":
                failures = [failure.get("message", "") for failure in case.iter("failure")]
                cases.append((run, f"{case.get('classname')}.{case.get('name')}", float(case.get("time", 0)), failures))
    return cases


def output_of(log, run):
    """What a failed run printed, from ctest's log."""
    lines, inside = [], False
    for line in log.read_text(errors="replace").splitlines():
        if re.match(r" *(Start +\d+:|\d+/\d+ Test +#\d+:)", line):
            inside = f": {run} " in line + " " and "Test" in line
        elif inside:
            lines.append(line[:400])
    return lines


def run_tests(preset, select, deadline=None):
    """Runs what ctest selects. Returns rows of the table by label, and whether all passed; None if the deadline came."""
    reports = BUILD / preset / "reports"
    junit = BUILD / preset / "runs.xml"
    log = BUILD / preset / "test.log"
    junit.unlink(missing_ok=True)
    shutil.rmtree(reports, ignore_errors=True)
    reports.mkdir(parents=True)
    os.environ["GTEST_BRIEF"] = "1"
    if MEMORY_DISK.is_dir() and shutil.disk_usage(MEMORY_DISK).free > MEMORY_DISK_BYTES:
        os.environ.setdefault("TMPDIR", str(MEMORY_DISK))  # farms of tests write much, and wait for the disk
    watch = Stopwatch()
    code = run_logged(["ctest", "--test-dir", f"build/{preset}", "--output-on-failure", "--no-tests=error", "-j", str(SLOTS),
                       "--output-junit", str(junit), *select], log, show=r"^ *\d+/\d+ Test +#|% tests passed", deadline=deadline)
    if code is None:
        return None
    if not junit.exists():
        show_end_of(log)
        raise Failed
    labels = {run["name"]: run["labels"] for run in runs_of(preset)}
    rows, failed_runs = {}, []
    for case in xml.etree.ElementTree.parse(junit).iter("testcase"):
        name = case.get("name")
        own = cases_of(preset, [name])
        label = next((label for label in labels.get(name, []) if label not in KINDS_OF_RUN), "other")
        row = rows.setdefault(label, Row(label, 0))
        row.tests += max(len(own), 1) if case.get("status") != "notrun" else 0
        row.seconds += float(case.get("time", 0))
        if case.get("status") not in ("run", "notrun"):
            row.failed += max(sum(1 for c in own if c[3]), 1)
            failed_runs.append((name, own))
    for name, own in failed_runs:
        print(f"\nfailed: {name}")
        told = False
        for _, test, _, failures in own:
            for failure in failures:
                told = True
                print(f"  {test}\n" + "\n".join(f"    {line}" for line in failure.splitlines()[:SHOWN_LINES]))
        if not told:
            print("\n".join(f"    {line}" for line in output_of(log, name)[-SHOWN_LINES:]))
    total = watch.row("in all", sum(r.tests for r in rows.values()), sum(r.failed for r in rows.values()))
    return sorted(rows.values(), key=lambda r: -r.seconds), total


def print_table(rows):
    print(f"\n{'part':<52} {'tests':>6} {'failed':>6} {'seconds':>8} {'CPU':>6}")
    for row in rows:
        print(f"{row.part:<52} {'' if row.tests is None else row.tests:>6} {row.failed or '':>6} {row.seconds:>8.0f} "
              f"{'' if row.cpu is None else format(row.cpu, '.0f'):>6}")


# ---- the suites ----


def do_piece(piece, deadline=None):
    """Builds and runs it: rows of the table; None if the deadline came first."""
    print(f"\n== {piece.name}", flush=True)
    watch = Stopwatch()
    if not build(piece.preset, [piece.target], deadline):
        return None
    rows = [watch.row(f"{piece.name}: build")]
    if not piece.select:
        return rows
    result = run_tests(piece.preset, piece.select, deadline)
    if result is None:
        return None
    by_label, total = result
    total.part = f"{piece.name}: tests"
    rows.append(total)
    if len(by_label) > 1:
        rows += [dataclasses.replace(row, part=f"  of these {row.part}: one after the other") for row in by_label]
    return rows


def print_end(rows, watch):
    """The table, the sum, and a line with the number of tests."""
    counted = [row for row in rows if row.tests is not None and not row.part.startswith("  ")]
    tests, failed = sum(row.tests for row in counted), sum(row.failed for row in rows if not row.part.startswith("  "))
    print_table([*rows, watch.row("all parts", tests, failed)])
    print(f"\n{tests - failed} passed, {failed} failed")


def run_default():
    watch = Stopwatch()
    rows = [row for piece in DEFAULT_PIECES for row in do_piece(piece)]
    print_end(rows, watch)
    return not any(row.failed for row in rows)


def sources_id():
    """Names the sources as they are, changes that are not committed included."""
    def git(*arguments):
        return subprocess.run(["git", *arguments], cwd=ROOT, check=False, capture_output=True).stdout
    digest = hashlib.sha256(git("rev-parse", "HEAD^{tree}") + git("diff", "HEAD"))
    for name in git("ls-files", "--others", "--exclude-standard", "-z").split(b"\0"):
        if name and (ROOT / name.decode()).is_file():
            digest.update(name + (ROOT / name.decode()).read_bytes())
    return digest.hexdigest()


def load_state():
    try:
        state = json.loads(STATE.read_text())
    except (OSError, ValueError):
        state = {}
    now = sources_id()
    return state if state.get("sources") == now else {"sources": now, "done": {}}


def save_state(state):
    STATE.parent.mkdir(parents=True, exist_ok=True)
    temporary = STATE.with_suffix(".new")
    temporary.write_text(json.dumps(state, indent=1))
    temporary.replace(STATE)


def in_turn(pieces):
    """Begins at a place that follows from the commit: over many commits, each piece gets its turn."""
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, check=False, capture_output=True, text=True).stdout.strip()
    start = int(hashlib.sha256(commit.encode()).hexdigest(), 16) % len(pieces)
    return pieces[start:] + pieces[:start]


def run_all(minutes, rotate):
    watch = Stopwatch()
    deadline = None if minutes is None else time.monotonic() + 60 * minutes
    state = load_state()
    pieces = in_turn(all_pieces()) if rotate else DEFAULT_PIECES + all_pieces()
    table, left = [], []
    for piece in pieces:
        if state["done"].get(piece.name) == "passed":
            print(f"passed already: {piece.name}")
            continue
        rows = None
        if deadline is None or time.monotonic() < deadline - 5:
            try:
                rows = do_piece(piece, deadline)
            except Failed:
                rows = [Row(f"{piece.name}: the build or ctest failed", None, 1)]
        if rows is None:
            left.append(piece.name)
            continue
        table += rows
        state["done"][piece.name] = "failed" if any(row.failed for row in rows) else "passed"
        save_state(state)
    failed = [name for name, result in state["done"].items() if result == "failed"]
    for title, names in (("not reached in the time given", left), ("failed", failed)):
        if names:
            print(f"\n{title}:\n" + "\n".join(f"  {name}" for name in names))
    print_end(table, watch)
    return not failed


def run_in_background(arguments):
    LOG.parent.mkdir(parents=True, exist_ok=True)
    with open(LOG, "wb") as log:
        process = subprocess.Popen([sys.executable, "-B", __file__, *arguments], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=log,
                                   stderr=subprocess.STDOUT, start_new_session=True)
    print(f"process {process.pid} runs it; its log is {LOG.relative_to(ROOT)}.\n"
          f"./test.sh --status says what is done; kill {process.pid} stops it, and the same command continues it.")


def show_status():
    state = load_state()
    for piece in DEFAULT_PIECES + all_pieces():
        print(f"{state['done'].get(piece.name, '-'):<8} {piece.name}")


# ---- by name ----


def named_tests(sources, name):
    """Tests (Suite.Name) in these files whose names contain `name`."""
    found = []
    for source in sources:
        for suite, test in re.findall(r"^TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\)", pathlib.Path(source).read_text(), re.M):
            if name.lower() in f"{suite}.{test}".lower():
                found.append(f"{suite}.{test}")
    return found


def run_named(names):
    begun = time.monotonic()
    preset = "release"
    runs, programs = runs_of(preset), programs_of(preset)
    chosen, filters = [], {}
    for name in names:
        matching = [run for run in runs if name.lower() in re.split(r"[._]", run["name"].lower()) or name == run["name"]
                    or run["name"].startswith(name + ".")]
        matching = matching or [run for run in runs if name in run["labels"]]
        if matching:
            plain = [run for run in matching if "long" not in run["labels"]]
            chosen += plain or matching
            continue
        hits = {program: tests for program, files in programs.items() if (tests := named_tests(files, name))}
        if not hits:
            known = sorted({word for run in runs for word in [run["name"], *run["labels"]]})
            close = difflib.get_close_matches(name, known, 3, 0.4)
            print(f"{name}: no program, label or test has this name." + (f" Near to it: {', '.join(close)}." if close else ""))
            return False
        for program, tests in hits.items():
            filters.setdefault(program, []).extend(tests)
    targets = {pathlib.Path(run["command"][0]).name for run in chosen if run["command"]} & set(programs)
    scripts = [run for run in chosen if run["command"] and pathlib.Path(run["command"][0]).name not in programs]
    build(preset, sorted(targets | set(filters)) + (["all_tests"] if scripts else []))
    passed, tests = True, 0
    if chosen:
        select = "|".join(re.escape(run["name"]) for run in chosen)
        _, total = run_tests(preset, ("-R", f"^({select})$"))
        tests, passed = total.tests, total.failed == 0
    for program, found in filters.items():
        # A parameterised test has a prefix and a suffix.
        pattern = ":".join(f"{test}:*/{test}/*" for test in found)
        tests += len(found)
        passed &= subprocess.run([str(BUILD / preset / "tests" / program), f"--gtest_filter={pattern}"], cwd=BUILD / preset,
                                 check=False).returncode == 0
    print(f"{'passed' if passed else 'FAILED'}: {tests} tests, {time.monotonic() - begun:.0f} s with the build")
    return passed


def main():
    parser = argparse.ArgumentParser(prog="./test.sh", description="Builds Lightmill and runs its tests.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="only programs, labels or tests whose names match")
    parser.add_argument("--all", action="store_true", help="everything, in pieces; continues where it stopped")
    parser.add_argument("--background", action="store_true", help="with --all: in the background")
    parser.add_argument("--minutes", type=float, metavar="N", help="with --all: stop after N minutes")
    parser.add_argument("--in-turn", action="store_true", help="with --all: without the default suite, from a piece on that "
                                                               "follows from the commit")
    parser.add_argument("--status", action="store_true", help="what --all has done so far")
    parser.add_argument("--list", action="store_true", help="the pieces of --all")
    options = parser.parse_args()
    if (options.background or options.minutes is not None or options.in_turn) and not options.all:
        parser.error("--background, --minutes and --in-turn go with --all")
    if options.all and options.names:
        parser.error("--all takes no names")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        if options.status or options.list:
            if options.list:
                print("\n".join(piece.name for piece in DEFAULT_PIECES + all_pieces()))
            else:
                show_status()
            return True
        if options.all and options.background:
            run_in_background([argument for argument in sys.argv[1:] if argument != "--background"])
            return True
        if options.all:
            return run_all(options.minutes, options.in_turn)
        return run_named(options.names) if options.names else run_default()
    except Failed:
        return False
    except KeyboardInterrupt:
        print("\ninterrupted")
        sys.exit(130)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
