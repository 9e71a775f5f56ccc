"""Runs tests by ctest and reads their reports."""
import os
import pathlib
import re
import shutil
import xml.etree.ElementTree

from builds import runs_of
from process import BUILD, SHOWN_LINES, Failed, Row, Stopwatch, run_logged, show_end_of

CORES = os.cpu_count() or 1
# Runs that wait for real processes take one slot, runs that compute take two (cmake/targets.cmake).
SLOTS = 3 * CORES
KINDS_OF_RUN = ("asan", "long", "threads", "tsan")  # labels that say when a run runs; the others say what it is
MEMORY_DISK = pathlib.Path("/dev/shm")
MEMORY_DISK_BYTES = 4 << 30  # that must be free


def cases_of(preset, run):
    """What the report of this run says: (test, failures, why it was skipped) each; the last is None where it ran."""
    try:
        tree = xml.etree.ElementTree.parse(BUILD / preset / "reports" / f"{run}.xml")
    except (OSError, xml.etree.ElementTree.ParseError):
        return []  # a script has no report; of a program that was killed, ctest says so
    cases = []
    for case in tree.iter("testcase"):
        if case.get("status") == "run":
            failures = [failure.get("message", "") for failure in case.iter("failure")]
            skipped = next((skipped.get("message", "") for skipped in case.iter("skipped")), None)
            cases.append((f"{case.get('classname')}.{case.get('name')}", failures, skipped))
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
    """Runs what ctest selects. Returns rows of the table by label, and the row of all; None if the deadline came."""
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
    rows, failed_runs, skipped = {}, [], []
    for case in xml.etree.ElementTree.parse(junit).iter("testcase"):
        name = case.get("name")
        own = cases_of(preset, name)
        label = next((label for label in labels.get(name, []) if label not in KINDS_OF_RUN), "other")
        row = rows.setdefault(label, Row(label, 0))
        skipped += [(test, reason) for test, _, reason in own if reason is not None]
        ran = sum(reason is None for _, _, reason in own)
        row.tests += (ran if own else 1) if case.get("status") != "notrun" else 0
        row.seconds += float(case.get("time", 0))
        if case.get("status") not in ("run", "notrun"):
            row.failed += max(sum(1 for _, failures, _ in own if failures), 1)
            failed_runs.append((name, own))
    for test, reason in skipped:
        print(f"skipped: {test}: {reason.strip().splitlines()[-1] if reason.strip() else 'no reason given'}")
    for name, own in failed_runs:
        print(f"\nfailed: {name}")
        told = False
        for test, failures, _ in own:
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
