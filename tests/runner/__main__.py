"""Builds Lightmill and runs its tests: see test.sh, which calls this."""
import argparse
import pathlib
import signal
import subprocess
import sys

from coverage import run_coverage
from named import run_named
from pieces import DEFAULT_PIECES, all_pieces, run_all, run_default, show_status
from process import BUILD, ROOT, Failed
from repeat import run_repeatedly, show_runs


def run_in_background(folder, arguments):
    log = BUILD / folder / "log"
    log.parent.mkdir(parents=True, exist_ok=True)
    with open(log, "wb") as out:
        process = subprocess.Popen([sys.executable, "-B", str(pathlib.Path(__file__).parent), *arguments], cwd=ROOT,
                                   stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, start_new_session=True)
    print(f"process {process.pid} runs it; its log is {log.relative_to(ROOT)}.\n"
          f"./test.sh --status says what is done; kill {process.pid} stops it, and the same command continues it.")


def parse():
    parser = argparse.ArgumentParser(prog="./test.sh", description="Builds Lightmill and runs its tests.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="only programs, labels or tests whose names match")
    parser.add_argument("--all", action="store_true", help="everything, in pieces; continues where it stopped")
    parser.add_argument("--repeat", type=int, metavar="N", help="the default suite N times; continues where it stopped")
    parser.add_argument("--busy", type=int, default=0, metavar="M", help="with --repeat: the last M beside a busy loop on each core")
    parser.add_argument("--coverage", action="store_true", help="which lines the default suite runs; with --all, the long tests too")
    parser.add_argument("--background", action="store_true", help="with --all or --repeat: in the background")
    parser.add_argument("--minutes", type=float, metavar="N", help="with --all: stop after N minutes")
    parser.add_argument("--in-turn", action="store_true", help="with --all: without the default suite, from a piece on that "
                                                               "follows from the commit")
    parser.add_argument("--status", action="store_true", help="what --all and --repeat have done so far")
    parser.add_argument("--list", action="store_true", help="the pieces of --all")
    options = parser.parse_args()
    if options.background and not (options.all or options.repeat):
        parser.error("--background goes with --all or --repeat")
    if (options.minutes is not None or options.in_turn) and (not options.all or options.coverage):
        parser.error("--minutes and --in-turn go with --all")
    if options.busy and not options.repeat:
        parser.error("--busy goes with --repeat")
    if options.repeat and (options.all or options.coverage):
        parser.error("--repeat is about the default suite: it goes without --all and --coverage")
    if (options.all or options.repeat or options.coverage) and options.names:
        parser.error("--all, --repeat and --coverage take no names")
    return options


def run(options):
    """Whether all is well."""
    if options.list:
        print("\n".join(piece.name for piece in DEFAULT_PIECES + all_pieces()))
        return True
    if options.status:
        show_status()
        show_runs()
        return True
    if options.background:
        run_in_background("all" if options.all else "repeat", [word for word in sys.argv[1:] if word != "--background"])
        return True
    if options.coverage:
        return run_coverage(options.all)
    if options.repeat:
        return run_repeatedly(options.repeat, options.busy)
    if options.all:
        return run_all(options.minutes, options.in_turn)
    return run_named(options.names) if options.names else run_default()


def main():
    options = parse()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run(options)
    except Failed:
        return False
    except KeyboardInterrupt:
        print("\ninterrupted")
        sys.exit(130)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
