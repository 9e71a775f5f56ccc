"""The environment of a call: one at a time in a checkout, its folder for temporary files, and the background."""
import contextlib
import fcntl
import os
import pathlib
import re
import shutil
import sys
import time

from process import BUILD, ROOT, Failed, free_memory

LOCK = BUILD / "test.lock"
MEMORY_DISK = pathlib.Path("/dev/shm")
MEMORY_DISK_BYTES = 4 << 30  # required free space
RESERVE_BYTES = 4 << 30  # of memory, for compilers and tests
MOMENT = 1  # second: --status may hold the lock for less
LEFT_OVER = re.compile(r"(?:lightmill|faketime_shm|sem\.faketime_sem)[-_](\d+)")  # libfaketime's files of killed programs too


def lock_holder():
    """The process that builds or tests in this checkout now, as text, or None."""
    with contextlib.suppress(FileNotFoundError), open(LOCK, encoding="ascii") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return lock.read().strip()
    return None


def try_to_lock(lock):
    with contextlib.suppress(BlockingIOError):
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    return False


@contextlib.contextmanager
def only_one():
    """Allows one call at a time, because two would overwrite each other's builds and results. Yields a function that notes the
    process."""
    BUILD.mkdir(exist_ok=True)
    with open(LOCK, "a+", encoding="ascii") as lock:
        until = time.monotonic() + MOMENT
        while not (is_locked := try_to_lock(lock)) and time.monotonic() < until:
            time.sleep(0.02)
        if not is_locked:
            print(f"process {lock_holder()} works in this checkout already. Wait for it, or use another one: git worktree add FOLDER")
            raise Failed

        def note():
            lock.truncate(0)
            lock.write(str(os.getpid()))
            lock.flush()
        note()
        yield note


def remove_left_over():
    """Removes the files of ended processes from the memory disk."""
    for path in MEMORY_DISK.iterdir():
        if (match := LEFT_OVER.fullmatch(path.name)) and not pathlib.Path("/proc", match.group(1)).exists():
            with contextlib.suppress(OSError):
                shutil.rmtree(path) if path.is_dir() else path.unlink()


def why_no_memory_disk():
    """None if the tests can write to it."""
    if not MEMORY_DISK.is_dir():
        return f"there is no {MEMORY_DISK}"
    remove_left_over()
    if shutil.disk_usage(MEMORY_DISK).free < MEMORY_DISK_BYTES:
        return f"{MEMORY_DISK} has less than {MEMORY_DISK_BYTES >> 30} GiB free"
    needed = MEMORY_DISK_BYTES + RESERVE_BYTES
    return f"less than {needed >> 30} GiB of memory are free" if free_memory() < needed else None


@contextlib.contextmanager
def temporary_folder():
    """TMPDIR on the memory disk, if it has space. Tests of farms write much, and would wait for a disk."""
    if why := why_no_memory_disk():
        print(f"{why}: the tests write to a disk, which takes longer", flush=True)
        yield
        return
    folder = MEMORY_DISK / f"lightmill-{os.getpid()}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    folder.chmod(0o755)  # PostgreSQL's user enters it
    os.environ["TMPDIR"] = str(folder)
    try:
        yield
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        remove_left_over()


def go_to_background(log):
    """Whether this is the background process. Its output goes to `log`."""
    log.parent.mkdir(parents=True, exist_ok=True)
    process = os.fork()
    if process:
        print(f"process {process} runs it; its log is {log.relative_to(ROOT)}.\n"
              f"./test.sh --status says what is done; kill {process} stops it, and the same command continues it.")
        return False
    os.setsid()
    with open(log, "wb") as out, open(os.devnull, "rb") as nothing:
        for number, file in enumerate((nothing, out, out)):
            os.dup2(file.fileno(), number)
    sys.stdout.reconfigure(line_buffering=True)
    return True
