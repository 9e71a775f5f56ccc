"""Builds Lightmill and runs its tests. test.sh calls this."""
import argparse
import contextlib
import os
import re
import signal
import sys

import pieces
import repeat
from coverage import run_coverage
from named import run_named
from process import BUILD, INTERRUPTS, Failed, install_packages, show_what_runs
from session import go_to_background, lock_holder, only_one, temporary_folder
from state import State, sources_id


# The caller's other LIGHTMILL_ variables are settings of the programs, such as a token. Tests must not use them.
KEPT = ("LIGHTMILL_BLENDER",)
# These change what is compiled, or what a check or a script does.
DROPPED = ("ASAN_OPTIONS", "CFLAGS", "CPPFLAGS", "CXXFLAGS", "LDFLAGS", "LSAN_OPTIONS", "NODE_OPTIONS", "PYTHONPATH", "TSAN_OPTIONS",
           "UBSAN_OPTIONS")
OF_TESTS = ("LIGHTMILL_DAMAGE_ROUNDS", "LIGHTMILL_FUZZ_CASES", "LIGHTMILL_SHOW", "LIGHTMILL_SIMULATION_SEED", "LIGHTMILL_SIMULATION_SEEDS")


def minutes(text):
    with contextlib.suppress(ValueError):
        if 0 < (value := float(text)) < float("inf"):
            return value
    raise argparse.ArgumentTypeError(f"a number above 0 is expected, got {text}")


def parse():
    parser = argparse.ArgumentParser(prog="./test.sh", description="Builds Lightmill and runs its tests.", allow_abbrev=False)
    parser.add_argument("names", nargs="*", metavar="NAME", help="only programs, labels or tests whose names match, or a piece of --list; "
                                                               "asan, ubsan or tsan before them names a build with that sanitizer")
    parser.add_argument("--all", action="store_true", help="everything, in pieces; continues where it stopped")
    parser.add_argument("--repeat", type=int, metavar="N", help="the default suite N times; continues where it stopped")
    parser.add_argument("--busy", type=int, default=0, metavar="M", help="with --repeat: run a busy loop on each core during the last M runs")
    parser.add_argument("--coverage", action="store_true", help="which lines the default suite runs; with --all, the long tests too")
    parser.add_argument("--background", action="store_true", help="with --all or --repeat: in the background")
    parser.add_argument("--minutes", type=minutes, metavar="N", help="with --all: stop after N minutes")
    parser.add_argument("--in-turn", action="store_true", help="with --all: skip the default suite, and start at a piece that "
                                                               "depends on the commit")
    parser.add_argument("--status", action="store_true", help="what --all and --repeat have done so far")
    parser.add_argument("--list", action="store_true", help="the pieces of --all, and the programs and scripts of each")
    options = parser.parse_args()
    given = {name for name in ("names", "all", "repeat", "coverage", "status", "list") if getattr(options, name) not in ([], None, False)}
    if len(given) > 1 and given != {"all", "coverage"}:
        parser.error("NAME, --all, --repeat, --coverage, --status and --list exclude each other. Only --coverage and --all can be combined")
    if not all(re.search(r"\w", name) for name in options.names):
        parser.error("each NAME must contain a letter or a digit")
    if options.background and given not in ({"all"}, {"repeat"}):
        parser.error("--background needs --all or --repeat")
    if (options.minutes is not None or options.in_turn) and given != {"all"}:
        parser.error("--minutes and --in-turn need --all")
    if options.repeat is not None and options.repeat < 1 or not 0 <= options.busy <= (options.repeat or 0):
        parser.error("--repeat must be at least 1, and --busy at most the number of --repeat")
    return options


def show_status():
    holder = lock_holder()
    print(f"{holder} is running" if holder else "no run is active")
    show_what_runs()
    pieces.show_states(State(pieces.STATE))
    repeat.show_runs(State(repeat.STATE))


def run(options):
    """Returns whether everything passed."""
    if options.coverage:
        return run_coverage(options.all)
    if options.repeat:
        return repeat.run_repeatedly(options.repeat, options.busy)
    if options.all:
        return pieces.run_all(options.minutes, options.in_turn)
    if not options.names:
        return pieces.run_default()
    piece = pieces.piece_named(options.names[0]) if len(options.names) == 1 else None
    return pieces.run_piece(piece) if piece else run_named(options.names)


def main():
    options = parse()
    INTERRUPTS.enable()
    for name in list(os.environ):
        if name in DROPPED or name.startswith("GTEST_") or name.startswith("LIGHTMILL_") and name not in KEPT and not (options.names and name in OF_TESTS):
            del os.environ[name]
    try:
        if options.status or options.list:
            signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # so that head can end it
        if options.status:
            show_status()
            return True
        install_packages("--tests")
        with only_one() as note:
            if options.list:
                pieces.show_pieces()
                return True
            if options.background:
                sources_id()  # fails here, rather than in the background
                go_to_background(BUILD / ("all" if options.all else "repeat") / "log")
                note()
            with temporary_folder():
                return run(options)
    except Failed:
        return False
    except OSError as error:  # such as a full disk
        sys.exit(f"./test.sh: {error}")
    except KeyboardInterrupt:
        print("\ninterrupted")
        sys.exit(130)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
