"""Runs commands with their output in a file, ends them, and measures their time."""
import contextlib
import dataclasses
import errno
import multiprocessing
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

import contain

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BUILD = ROOT / "build"
NOW = BUILD / "now"  # notes by process
SHOWN_LINES = 40  # of a failed command
LONG_LINE = 500
LOW_PRIORITY = 10
COMPILER_BYTES = 2 << 30
CONTROL_GROUPS = pathlib.Path("/sys/fs/cgroup")
INHERITED = []  # descriptors that commands get
parts_at_once = 1  # which compile, each in a process of its own


class Failed(Exception):
    """A failure other than a failed test. Its message is printed already."""


@dataclasses.dataclass
class Row:
    """One row of the final table. `tests` is None for a row without tests, such as a build."""
    part: str
    tests: int | None = None
    failed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    cpu: float | None = None
    is_detail: bool = False  # another row includes its counts

    def add(self, other):
        """Adds the counts of another row, whose time runs in parallel."""
        self.tests = (self.tests or 0) + (other.tests or 0)
        self.failed += other.failed
        self.skipped += other.skipped


class Stopwatch:
    """Elapsed seconds, and CPU seconds of all processes that ended since."""

    def __init__(self):
        self.begun, self.cpu_begun = time.monotonic(), self.cpu_of_children()

    @staticmethod
    def cpu_of_children():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    def row(self, part, tests=None, failed=0, skipped=0):
        return Row(part, tests, failed, skipped, time.monotonic() - self.begun, self.cpu_of_children() - self.cpu_begun)


class Interrupts:
    """The first SIGINT, SIGTERM or SIGHUP raises KeyboardInterrupt. Later ones are ignored, because they must not interrupt the
    cleanup."""
    NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def __init__(self):
        self.is_delayed = self.is_due = False

    def enable(self):
        """A signal that nohup ignores stays without effect. Commands must not inherit that."""
        for number in self.NUMBERS:
            is_ignored = signal.getsignal(number) == signal.SIG_IGN
            signal.signal(number, (lambda *_: None) if is_ignored else self.receive)

    def receive(self, *_):
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_IGN)
        if not self.is_delayed:
            raise KeyboardInterrupt
        self.is_due = True

    @contextlib.contextmanager
    def delayed(self):
        """Delays interrupts while the block starts a process, because an unknown process could not be ended."""
        self.is_delayed = True
        try:
            yield
        finally:
            self.is_delayed = False
        if self.is_due:
            raise KeyboardInterrupt


INTERRUPTS = Interrupts()


@contextlib.contextmanager
def doing(what):
    """Notes what this process does, for --status. An interrupt prints it."""
    NOW.mkdir(parents=True, exist_ok=True)
    note, begun = NOW / str(os.getpid()), time.monotonic()
    note.write_text(what)
    try:
        yield
    except KeyboardInterrupt:
        print(f"\ninterrupted: {what}, after {time.monotonic() - begun:.0f} s")
        raise
    finally:
        note.unlink(missing_ok=True)


def show_what_runs():
    for note in sorted(NOW.glob("*")):
        with contextlib.suppress(OSError):  # it has just ended
            if pathlib.Path("/proc", note.name).exists():
                print(f"  {note.read_text()}, since {time.time() - note.stat().st_mtime:.0f} s")


def limits(name):
    """The control group of this process and those above it, each with its limit of this name if it has one (cgroup v2)."""
    own = re.search(r"^0::/(.*)$", pathlib.Path("/proc/self/cgroup").read_text(), re.M)
    folder = CONTROL_GROUPS / (own.group(1) if own else "")
    for group in (folder, *folder.parents):
        with contextlib.suppress(OSError):
            words = (group / name).read_text().split()
            if words[0] != "max":
                yield group, words


def cores():
    """How many this process may use."""
    shares = [int(quota) // int(period) for _, (quota, period) in limits("cpu.max")]
    return max(1, min([len(os.sched_getaffinity(0)), *shares]))


CORES = cores()


def number_in(file, name):
    return int(re.search(rf"^{name} *(\d+)", file.read_text(), re.M).group(1))


def free_memory():
    """Bytes. The kernel drops a control group's unused copies of files when it needs the memory."""
    left = [int(most) - number_in(group / "memory.current", "") + number_in(group / "memory.stat", "inactive_file")
            for group, [most] in limits("memory.max")]
    return min([number_in(pathlib.Path("/proc/meminfo"), "MemAvailable:") << 10, *left])


def at_once(most, bytes_of_each):
    """How many commands run at once in a part, if each has this much memory. The parts share what is free."""
    return max(1, min(most, free_memory() // (bytes_of_each * parts_at_once)))


def compilers():
    return at_once(CORES, COMPILER_BYTES)


def show_progress(text):
    """Replaces the last line of a terminal."""
    if sys.stdout.isatty():
        print(f"\r\033[K{text[:shutil.get_terminal_size().columns - 1]}", end="", flush=True)


def fail_to_run(command, error):
    print(f"{command[0]} cannot be run: {error.strerror}")
    raise Failed from None


def output_of(command):
    """What a command prints. It must succeed."""
    try:
        ended = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    except OSError as error:
        fail_to_run(command, error)
    if ended.returncode != 0:
        print(f"{' '.join(map(str, command))} failed:\n{ended.stdout}{ended.stderr}")
        raise Failed
    return ended.stdout


def install_packages(kind):
    """An interrupt waits for the end, because half an installation is worse."""
    with INTERRUPTS.delayed():
        code = subprocess.call(["deploy/setup", kind], cwd=ROOT, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    if code != 0:
        raise Failed


def run_logged(command, log, show=None, progress=None, deadline=None):
    """Runs a command with its output in a file, and prints the lines that match `show`. `progress` gets each line, and returns the
    text that a terminal is to show now, or None. Returns the command's exit code, or None if the deadline ended it. An interrupt
    ends it too. Processes that it leaves are ended, and then the exit code is contain.LEFT_BEHIND."""
    if shutil.which(command[0]) is None:
        fail_to_run(command, FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT)))
    log.parent.mkdir(parents=True, exist_ok=True)
    process, is_late = None, False

    def end_late(*_):
        nonlocal is_late
        is_late = True
        if process is not None:
            process.terminate()

    def read_all(out):
        for line in process.stdout:
            out.write(line)
            out.flush()
            text = line.decode(errors="replace").rstrip()
            if text.startswith("left behind: ") or show is not None and re.search(show, text):
                show_progress("")
                print(text, flush=True)
            if progress is not None and (now := progress(text)) is not None:
                show_progress(now)
    previous = signal.signal(signal.SIGALRM, end_late)
    with open(log, "wb") as out:
        try:
            if deadline is not None:
                signal.setitimer(signal.ITIMER_REAL, max(deadline - time.monotonic(), 0.01))
            try:
                with INTERRUPTS.delayed():
                    process = subprocess.Popen([sys.executable, "-B", contain.__file__, *command], cwd=ROOT, stdin=subprocess.DEVNULL,
                                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
                                               pass_fds=INHERITED)
            except OSError as error:
                fail_to_run(command, error)
            if is_late:  # before the process was known
                process.terminate()
            with contextlib.suppress(OSError):  # if the kernel shares time between sessions, `nice` counts only within one
                pathlib.Path(f"/proc/{process.pid}/autogroup").write_text(str(os.nice(0)))
            read_all(out)
            code = process.wait()
        except BaseException:
            if process is not None:
                process.terminate()
                process.wait()
                os.set_blocking(process.stdout.fileno(), False)  # a process that cannot be ended may still hold it
                read_all(out)
            raise
        finally:
            show_progress("")
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, previous)
    return None if is_late else code


def show_end_of(log, lines=SHOWN_LINES):
    """Without long lines, which are commands of compilers."""
    shown = [line for line in log.read_text(errors="replace").splitlines() if len(line) < LONG_LINE]
    print("\n".join(shown[-lines:]))


@contextlib.contextmanager
def beside(work, log):
    """Runs `work` in a second process of low priority. Yields a function that waits for its result and prints its output."""
    receiver, sender = multiprocessing.Pipe(duplex=False)

    def run():
        INTERRUPTS.is_delayed = False
        if INTERRUPTS.is_due:  # interrupted before it began
            return
        contain.end_with_parent()
        log.parent.mkdir(parents=True, exist_ok=True)
        with open(log, "wb") as out:
            os.dup2(out.fileno(), 1)
            os.dup2(out.fileno(), 2)
        os.nice(LOW_PRIORITY)
        try:
            sender.send(work())
        except OSError as error:
            sys.exit(f"./test.sh: {error}")

    def result():
        try:
            return receiver.recv()
        except EOFError:
            process.join()
            print(f"a part ended without a result, with exit code {process.exitcode}")
            raise Failed from None
        except BaseException:
            process.terminate()
            raise
        finally:
            process.join()
            print(log.read_text(errors="replace"), end="", flush=True)

    global parts_at_once
    process = multiprocessing.get_context("fork").Process(target=run)
    parts_at_once += 1
    try:
        with INTERRUPTS.delayed():
            process.start()
        sender.close()
        yield result
    finally:
        parts_at_once -= 1
        process.terminate()
        process.join()
