"""Runs the default suite again and again: whether any test fails now and then."""
import os
import subprocess
import sys
import time

from pieces import DEFAULT_PIECES, do_piece
from process import BUILD, Stopwatch
from state import load, save

STATE = BUILD / "repeat" / "state.json"
BUSY_LOOP = "while True: pass"


class BusyLoops:
    """One on each core while it is entered."""

    def __init__(self, wanted):
        self.count = (os.cpu_count() or 1) if wanted else 0
        self.processes = []

    def __enter__(self):
        self.processes = [subprocess.Popen([sys.executable, "-c", BUSY_LOOP]) for _ in range(self.count)]

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.wait()


def failures_in(rows):
    return sum(row.failed for row in rows if not row.part.startswith("  "))


def run_repeatedly(times, busy):
    """Runs that were done before, of the same sources, are not done again. The last `busy` ones run beside busy loops."""
    state = load(STATE)
    for number in range(1, times + 1):
        beside = number > times - busy
        name = f"{number} beside busy loops" if beside else str(number)
        if name in state["done"]:
            continue
        print(f"\n#### run {name} of {times}, {time.strftime('%H:%M:%S')}", flush=True)
        watch = Stopwatch()
        with BusyLoops(beside):
            rows = [row for piece in DEFAULT_PIECES for row in do_piece(piece)]
        total = watch.row(name)
        tests = sum(row.tests or 0 for row in rows if not row.part.startswith("  "))
        state["done"][name] = {"tests": tests, "failed": failures_in(rows), "seconds": round(total.seconds)}
        save(STATE, state)
    show_runs()
    return not any(run["failed"] for run in state["done"].values())


def show_runs():
    state = load(STATE)
    print(f"\n{'run':<24} {'tests':>6} {'failed':>6} {'seconds':>8}")
    for name, run in state["done"].items():
        print(f"{name:<24} {run['tests']:>6} {run['failed'] or '':>6} {run['seconds']:>8}")
