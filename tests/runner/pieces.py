"""The default suite, and everything in pieces that are remembered.

A *piece* is built, run and remembered by itself. What is remembered belongs to the sources as they are: a change starts anew.
"""
import dataclasses
import hashlib
import re
import subprocess
import time

from builds import build, runs_of
from process import BUILD, ROOT, Failed, Row, Stopwatch
from results import print_table, run_tests
from state import load, save

STATE = BUILD / "all" / "state.json"


@dataclasses.dataclass(frozen=True)
class Piece:
    name: str
    preset: str
    target: str  # of ninja
    select: tuple = ()  # arguments of ctest; empty: the piece only builds


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


def in_turn(pieces):
    """Begins at a place that follows from the commit: over many commits, each piece gets its turn."""
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, check=False, capture_output=True, text=True).stdout.strip()
    start = int(hashlib.sha256(commit.encode()).hexdigest(), 16) % len(pieces)
    return pieces[start:] + pieces[:start]


def run_all(minutes, rotate):
    watch = Stopwatch()
    deadline = None if minutes is None else time.monotonic() + 60 * minutes
    state = load(STATE)
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
        save(STATE, state)
    failed = [name for name, result in state["done"].items() if result == "failed"]
    for title, names in (("not reached in the time given", left), ("failed", failed)):
        if names:
            print(f"\n{title}:\n" + "\n".join(f"  {name}" for name in names))
    print_end(table, watch)
    return not failed


def show_status():
    state = load(STATE)
    for piece in DEFAULT_PIECES + all_pieces():
        print(f"{state['done'].get(piece.name, '-'):<8} {piece.name}")
