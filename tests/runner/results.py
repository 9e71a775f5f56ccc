"""Runs tests with ctest, and reports their results."""
import dataclasses
import json
import re
import time
import xml.etree.ElementTree

import contain
from process import CORES, ROOT, SHOWN_LINES, Row, Stopwatch, at_once, doing, run_logged, show_end_of

RUN_BYTES = 1 << 30
KINDS_OF_RUN = ("asan", "long", "release", "threads")  # labels of the pieces that select a run. The other labels state its subject
# A crash has its reason before the asterisks: "Subprocess aborted***Exception:".
ENDED = re.compile(r" *\d+/\d+ Test +#\d+: (\S+) \.* *(Passed|[^*]*\*\*\*.*?) +([\d.]+) sec")
STARTED = re.compile(r" *Start +\d+: (\S+)")
PASSED, SKIPPED = "Passed", "***Skipped"
STEP = re.compile(r"\[ +(RUN|OK|FAILED|SKIPPED) +\] (\w[\w/]*\.[\w/]+)")  # of GoogleTest's output
DISABLED = "disabled"


@dataclasses.dataclass
class Results:
    """Result of a piece: rows of the table, names of failed tests, and skipped ones with the reason."""
    rows: list = dataclasses.field(default_factory=list)
    failed: list = dataclasses.field(default_factory=list)
    skipped: list = dataclasses.field(default_factory=list)
    is_late: bool = False  # the deadline came first, so something did not run

    def add(self, other):
        self.rows += other.rows
        self.failed += other.failed
        self.skipped += other.skipped
        self.is_late |= other.is_late


@dataclasses.dataclass
class Case:
    """A test in the report of a program."""
    name: str
    failures: list
    skipped: str | None  # the reason


def cases_of(report):
    """The tests in a report, or none if the report is incomplete."""
    try:
        tree = xml.etree.ElementTree.parse(report)
    except (OSError, xml.etree.ElementTree.ParseError):
        return []
    cases = []
    for case in tree.iter("testcase"):
        skipped = next((skipped.get("message", "") for skipped in case.iter("skipped")), None)
        if case.get("status") != "run":
            skipped = DISABLED
        cases.append(Case(f"{case.get('classname')}.{case.get('name')}",
                          [failure.get("message", "") for failure in case.iter("failure")], skipped))
    return cases


def cases_of_output(output, reason):
    """The tests of a program that ended without a report. Those that had not ended have failed for this reason."""
    last = {match.group(2): match.group(1) for match in map(STEP.match, output) if match}
    failures = {"RUN": [reason], "FAILED": ["its output is in the log"]}
    return [Case(name, failures.get(step, []), "the reason is in the log" if step == "SKIPPED" else None) for name, step in last.items()]


class Running:
    """What ctest has started and not ended."""

    def __init__(self):
        self.begun = {}

    def __call__(self, line):
        """Reads a line of ctest's output. Returns the text for a terminal, or None if nothing has changed."""
        if match := STARTED.match(line):
            self.begun[match.group(1)] = time.monotonic()
        elif match := ENDED.match(line):
            self.begun.pop(match.group(1), None)
        else:
            return None
        return f"running: {', '.join(self.begun)}" if self.begun else ""

    def show(self, reason):
        for name, begun in self.begun.items():
            print(f"{reason}: {name} had run for {time.monotonic() - begun:.0f} s")


def read_log(log, runs):
    """ctest's result of each run: its end, its seconds, and the output of a failed one. A failed test of this runner prints such
    lines too, about other runs."""
    ends, output, names = {}, None, {run.name for run in runs}
    for line in log.read_text(errors="replace").splitlines():
        ended, started = ENDED.match(line), STARTED.match(line)
        if ended and ended.group(1) in names - ends.keys():
            output = []
            ends[ended.group(1)] = (ended.group(2), float(ended.group(3)), output)
        elif started and started.group(1) in names or re.match(r"\d+% tests passed", line) and len(ends) == len(runs):
            output = None
        elif output is not None:
            output.append(line[:400])
    return ends


def output_of_run(test_folder, name):
    """The lines that a run printed, from ctest's own log."""
    log = (test_folder / "Testing" / "Temporary" / "LastTest.log").read_text(errors="replace")
    output = re.search(rf"^\d+/\d+ Testing: {re.escape(name)}$.*?^Output:\n-+\n(.*?)^<end of output>$", log, re.M | re.S)
    return output.group(1).strip().splitlines() if output else []


def judge(run, end, output, output_if_passed):
    """A row of the table, failed tests with their output, and skipped ones with the reason. A run passes only with proof: ctest
    says so, and a test program has a report of tests that ran. `output_if_passed()`: lines that a run printed that did not fail."""
    cases = cases_of(run.report) if run.report else []
    how = "\n".join([f"{run.name}: {end.replace('***', ' ').strip(' :')}", *output[-SHOWN_LINES:]])
    if run.report and not cases and end != PASSED:
        cases = cases_of_output(output, how)
    failed = [(case.name, "\n".join(case.failures)) for case in cases if case.failures]
    skipped = [(case.name, (case.skipped.strip().splitlines() or ["no reason given"])[-1]) for case in cases if case.skipped is not None]
    if end == SKIPPED and not run.report:
        return Row(run.name, 0, 0, 1), [], [(run.name, ([*output_if_passed()] or ["exit code 77"])[-1])]
    if end != PASSED and not failed:
        failed = [(run.name, how)]
    elif run.report and not cases:
        last = [match.group(2) for match in map(STEP.match, output_if_passed()) if match and match.group(1) == "RUN"][-1:]
        failed = [(run.name, f"{run.report.name} was not written" + "".join(f": {test} has ended the program" for test in last))]
    elif run.report and all(case.skipped == DISABLED for case in cases):
        failed = [(run.name, f"no test ran: {run.report.name} names none that is enabled")]
    tests = len(cases) - len(skipped) if run.report else 1
    return Row(run.name, max(tests, len(failed)), len(failed), len(skipped)), failed, skipped


def slots():
    """How many runs ctest has at once, and how many of them compute (cmake/tests.cmake)."""
    runs = at_once(4 * CORES, RUN_BYTES)
    return runs, min(runs, CORES)


def run_tests(test_folder, runs, folder, part, deadline=None):
    """Runs these entries of ctest's `test_folder`. Its log and the reports go into `folder`. `part` is their name in the
    table."""
    log = folder / "test.log"
    reports = [run.report for run in runs if run.report]
    for report in reports:
        report.unlink(missing_ok=True)
    watch = Stopwatch()
    select = "|".join(re.escape(run.name) for run in runs)
    cores = folder / "cores.json"
    folder.mkdir(parents=True, exist_ok=True)
    at_most, computing = slots()
    cores.write_text(json.dumps({"version": {"major": 1, "minor": 0},
                                 "local": [{"cores": [{"id": str(core)} for core in range(computing)]}]}))
    running = Running()
    try:
        with doing(f"{part} ({log.relative_to(ROOT)})"):
            code = run_logged(["ctest", "--test-dir", str(test_folder), "--output-on-failure", "--no-tests=error", "-j", str(at_most),
                               "--resource-spec-file", str(cores), "-R", f"^({select})$"], log, r"^ *\d+/\d+ Test +#", running, deadline)
    except KeyboardInterrupt:
        running.show("interrupted")
        raise
    if code is None:
        running.show("time limit reached")
    ends = read_log(log, runs)
    results, by_label = Results(is_late=code is None), {}
    for run in runs:
        if results.is_late and run.name not in ends:
            continue
        end, seconds, output = ends.get(run.name, ("ctest did not run it", 0, []))
        row, failed, skipped = judge(run, end, output, lambda run=run: output_of_run(test_folder, run.name))
        for name, text in failed:
            lines = [re.sub(r"^(\.\./)+", "", line) for line in text.splitlines()]  # ctest runs in the build folder
            print(f"\nfailed: {name}\n" + "\n".join(f"    {line}" for line in lines[:SHOWN_LINES + 1]))
        results.failed += [name for name, _ in failed]
        results.skipped += skipped
        label = next((label for label in run.labels if label not in KINDS_OF_RUN), "other")
        total = by_label.setdefault(label, Row(f"  of these {label}, sum of their times", 0, is_detail=True))
        total.seconds += seconds
        total.add(row)
    if code == contain.LEFT_BEHIND:
        results.failed.append("processes were left behind")
    elif code and not results.failed:
        show_end_of(log)
        print(f"ctest ended with exit code {code}: {log.relative_to(ROOT)}")
        results.failed.append("ctest")
    if results.failed:
        print(f"\nlog: {log.relative_to(ROOT)}")
    for report in reports:
        if report.exists():
            report.replace(folder / report.name)
    total = watch.row(part, 0)
    for row in by_label.values():
        total.add(row)
    total.failed = len(results.failed)
    results.rows = [total] + (sorted(by_label.values(), key=lambda row: -row.seconds) if len(by_label) > 1 else [])
    return results


def print_table(rows):
    print(f"\n{'part':<52} {'tests':>6} {'failed':>6} {'skipped':>7} {'seconds':>8} {'CPU':>6}")
    for row in rows:
        print(f"{row.part:<52} {'' if row.tests is None else row.tests:>6} {row.failed or '':>6} {row.skipped or '':>7} "
              f"{row.seconds:>8.0f} {'' if row.cpu is None else format(row.cpu, '.0f'):>6}")


def print_end(results, watch):
    """Prints skipped and failed tests, the table, and a line with the numbers of tests."""
    for title, lines in (("skipped", [f"{name}: {reason}" for name, reason in results.skipped]), ("failed", results.failed)):
        if lines:
            print(f"\n{title}:\n" + "\n".join(f"  {line}" for line in lines))
    rows = [row for row in results.rows if not row.is_detail]
    total = watch.row("all parts", 0)
    for row in rows:
        total.add(row)
    print_table([*results.rows, total])
    failed = sum(row.failed for row in rows if row.tests is not None)
    print(f"\n{total.tests - failed} passed, {failed} failed, {total.skipped} skipped"
          + (f", failed builds: {total.failed - failed}" if total.failed > failed else ""))
