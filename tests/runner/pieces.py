"""Everything that can run, in pieces, and the default suite.

A *piece* is built, run and remembered on its own.
"""
import collections.abc
import contextlib
import dataclasses
import re
import shutil
import time

from builds import build, files_of, runs_of
from process import BUILD, ROOT, Failed, Stopwatch, beside
from results import Results, print_end, run_tests
from state import State, git

STATE = BUILD / "all" / "state.json"
PASSED, FAILED, SKIPPED, LATE = "passed", "failed", "skipped", "not reached"
FLAKY = "failed, then passed"


@dataclasses.dataclass(frozen=True)
class Piece:
    name: str
    preset: str
    selects: collections.abc.Callable | None = None  # chooses the preset's runs; None: the piece only builds
    target: str = "all"  # the build target of such a piece

    @property
    def folder(self):
        return folder_of(self.name)


def folder_of(name):
    return BUILD / "results" / re.sub(r"[^\w.]+", "-", name)


@dataclasses.dataclass
class Outcome:
    name: str  # of the piece
    results: Results

    @property
    def state(self):
        rows = self.results.rows
        if any(row.failed for row in rows):
            return FAILED
        if self.results.is_late:
            return LATE
        return SKIPPED if any(row.skipped for row in rows) and not any(row.tests for row in rows) else PASSED


def labelled(*labels, without=()):
    return lambda run: any(label in run.labels for label in labels) and not any(label in run.labels for label in without)


DEFAULT_PIECES = [
    Piece("release build", "release", lambda run: "long" not in run.labels and ("asan" not in run.labels or "release" in run.labels)),
    Piece("address and undefined-behaviour sanitizers", "asan", labelled("asan", without=("long",))),
]


OTHER_PIECES = [
    Piece("fuzzers", "fuzz", labelled("fuzz")),
    Piece("programs by clang", "fuzz", target="programs"),
    Piece("each file compiled by itself", "plain"),
]


def later_pieces(after_default):
    """All pieces except the default suite. After the default suite, nothing runs twice in the same build."""
    def is_new(preset, run):
        return not after_default or not any(piece.preset == preset and piece.selects(run) for piece in DEFAULT_PIECES)
    pieces = [Piece("release: readers of untrusted input", "release",
                    lambda run: labelled("asan", without=("long",))(run) and is_new("release", run))]
    for preset, labels in (("asan", ("unit", "fuzz", "simulation")), ("ubsan", ("unit", "fuzz", "simulation")),
                           ("tsan", ("threads", "unit", "simulation", "statistical"))):
        for i, label in enumerate(labels):
            # A simulation has one thread, so ThreadSanitizer finds nothing new in more schedules.
            others = labels[:i] + (("long",) if (preset, label) == ("tsan", "simulation") else ())
            pieces.append(Piece(f"{preset}: {label}", preset, lambda run, preset=preset, label=label, without=others:
                                labelled(label, without=without)(run) and is_new(preset, run)))
    # Last, because these rarely fail.
    long = [Piece(f"long: {run.name}", "release", lambda each, name=run.name: each.name == name)
            for run in runs_of("release") if "long" in run.labels]
    return pieces + OTHER_PIECES + long


def piece_named(name):
    """None if no piece has this name."""
    pieces = DEFAULT_PIECES + OTHER_PIECES + (later_pieces(True) if ": " in name else [])
    return next((piece for piece in pieces if piece.name == name), None)


def run_piece(piece):
    """Whether it passed. --all does not remember it."""
    watch = Stopwatch()
    return print_outcomes(do_piece(piece), watch)


def show_pieces():
    for piece in DEFAULT_PIECES + later_pieces(True):
        runs = [run.name for run in runs_of(piece.preset) if piece.selects(run)] if piece.selects else []
        print(f"{piece.name}: {' '.join(runs)}" if runs else piece.name)


def build_piece(piece, deadline):
    """Its results so far, and its runs if they can run."""
    print(f"\n== {piece.name}", flush=True)
    shutil.rmtree(piece.folder, ignore_errors=True)
    results, runs, failed = Results(), [], 0
    watch = Stopwatch()
    try:
        runs = [run for run in runs_of(piece.preset) if piece.selects(run)] if piece.selects else []
        if piece.selects and not runs:
            print("nothing is selected")
            raise Failed
        targets = files_of(runs) if piece.selects else [piece.target]
        results.is_late = not build(piece.preset, targets, piece.folder / "build.log", deadline)
    except Failed:
        failed = 1
    results.rows.append(watch.row(f"{piece.name}: build", failed=failed))
    return results, [] if failed or results.is_late else runs


def do_piece(piece, deadline=None, others=()):
    """Builds the piece and runs its tests, and the other pieces beside it. Returns an Outcome of each."""
    with contextlib.ExitStack() as stack:
        later = [stack.enter_context(beside(lambda other=other: do_piece(other, deadline), BUILD / "results" / f"{other.folder.name}.log"))
                 for other in others]
        results, runs = build_piece(piece, deadline)
        if runs:
            results.add(run_tests(BUILD / piece.preset, runs, piece.folder, f"{piece.name}: tests", deadline))
        return [Outcome(piece.name, results), *(outcome for outcomes in later for outcome in outcomes())]


def print_outcomes(outcomes, watch):
    """Whether nothing failed."""
    everything = Results()
    for outcome in outcomes:
        everything.add(outcome.results)
    print_end(everything, watch)
    return not any(outcome.state == FAILED for outcome in outcomes)


def keep_results(outcomes, folder):
    """Copies the results of failed pieces, because the next run replaces them."""
    for outcome in outcomes:
        results = folder_of(outcome.name)
        if outcome.state == FAILED and results.exists():
            shutil.rmtree(folder / results.name, ignore_errors=True)
            kept = shutil.copytree(results, folder / results.name)
            print(f"kept: {kept.relative_to(ROOT)}")


def run_default():
    watch = Stopwatch()
    first, *others = DEFAULT_PIECES
    return print_outcomes(do_piece(first, None, others), watch)


def in_turn(pieces):
    """Starts at a piece that depends on the commit, so that over many commits each piece gets its turn."""
    start = int(git("rev-parse", "HEAD"), 16) % len(pieces)
    return pieces[start:] + pieces[:start]


def state_after(before, now):
    """A failure stays, even if a second try of the same sources passes."""
    if before not in (FAILED, FLAKY):
        return now
    return FLAKY if now == PASSED else before


def run_all(minutes, rotate):
    watch = Stopwatch()
    begun, limit = time.monotonic(), float("inf") if minutes is None else 60 * minutes
    state = State(STATE)
    groups = [[piece] for piece in (in_turn(later_pieces(False)) if rotate else later_pieces(True))]
    groups = groups if rotate else [DEFAULT_PIECES, *groups]
    state.record({piece.name: state.done.get(piece.name, LATE) for group in groups for piece in group})
    outcomes = []
    try:
        for group in groups:
            left = [piece for piece in group if state.done[piece.name] not in (PASSED, FLAKY)]
            now = time.monotonic()
            if left and now < begun + limit:
                # With --in-turn, a piece gets at most half of --minutes.
                deadline = min(begun + limit, now + limit / 2 if rotate else float("inf"))
                new = do_piece(left[0], None if minutes is None else deadline, left[1:])
                outcomes += new
                keep_results(new, STATE.parent / "failed")
                state.record({each.name: state_after(state.done[each.name], each.state) for each in new})
    finally:
        print_outcomes(outcomes, watch)
        show_states(state)
    states = list(state.done.values())
    print(f"\npieces: {len(states) - states.count(LATE)} were run, {states.count(LATE)} were not reached")
    return (rotate or LATE not in states) and not {FAILED, FLAKY} & set(states)


def show_states(state):
    if not state.done:
        print("\n--all has done nothing with these sources")
        return
    print(f"\n{'state':<20} piece")
    for name, said in state.done.items():
        print(f"{said:<20} {name}")
