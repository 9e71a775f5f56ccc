"""Repeats the default suite, to find tests that fail sometimes."""
import subprocess
import sys
import time

from pieces import DEFAULT_PIECES, do_piece, keep_results, print_outcomes
from process import BUILD, CORES, Failed, Stopwatch
from state import State

STATE = BUILD / "repeat" / "state.json"
BUSY_LOOP = "import os\nparent = os.getppid()\nwhile os.getppid() == parent: pass"


class BusyLoops:
    """Runs a busy loop on each core."""

    def __init__(self, wanted):
        self.count = CORES if wanted else 0
        self.processes = []

    def __enter__(self):
        self.processes = [subprocess.Popen([sys.executable, "-c", BUSY_LOOP]) for _ in range(self.count)]

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.wait()


def run_repeatedly(times, busy):
    """Runs that were done with the same sources are not repeated. Busy loops run during the last `busy` runs."""
    state = State(STATE)
    first, *others = DEFAULT_PIECES
    for number in range(1, times + 1):
        is_busy = number > times - busy
        name = f"{number} with busy loops" if is_busy else str(number)
        if name in state.done:
            continue
        print(f"\n#### run {name} of {times}, {time.strftime('%H:%M:%S')}", flush=True)
        watch = Stopwatch()
        with BusyLoops(is_busy):
            outcomes = do_piece(first, None, others)
        print_outcomes(outcomes, watch)
        failed = [test for outcome in outcomes for test in outcome.results.failed]
        if any(outcome.results.rows[0].failed for outcome in outcomes):
            print("a build failed: this run does not count")
            raise Failed
        keep_results(outcomes, STATE.parent / f"failed-{number}")
        tests = sum(row.tests or 0 for outcome in outcomes for row in outcome.results.rows if not row.is_detail)
        state.record({name: {"tests": tests, "failed": failed, "seconds": round(watch.row(name).seconds)}})
    show_runs(state)
    return not any(run["failed"] for run in state.done.values())


def show_runs(state):
    if not state.done:
        print("\n--repeat has done nothing with these sources")
        return
    print(f"\n{'run':<24} {'tests':>6} {'seconds':>8}  failed")
    for name, run in state.done.items():
        print(f"{name:<24} {run['tests']:>6} {run['seconds']:>8}  {', '.join(run['failed'])}")
