"""Runs commands with their output in a file, and measures their time."""
import dataclasses
import os
import pathlib
import re
import resource
import signal
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BUILD = ROOT / "build"
SHOWN_LINES = 40  # of what failed


class Failed(Exception):
    """Something other than a test failed: what and where is printed already."""


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
