"""The environment of a call: one at a time in a checkout, its folder for temporary files, and the background."""
import contextlib
import fcntl
import os
import pathlib
import re
import shutil
import sys
import time

from process import BUILD, INHERITED, ROOT, Failed, free_memory

LOCK = BUILD / "test.lock"
MEMORY_DISK = pathlib.Path("/dev/shm")
MEMORY_DISK_BYTES = 4 << 30  # required free space
RESERVE_BYTES = 4 << 30  # of memory, for compilers and tests
MOMENT = 1  # second: --status may hold the lock for less
LEFT_OVER = re.compile(r"(?:lightmill|faketime_shm|sem\.faketime_sem)[-_](\d+)")  # libfaketime's files of killed programs too


def try_to_lock(lock, kind):
    with contextlib.suppress(BlockingIOError):
        fcntl.flock(lock, kind | fcntl.LOCK_NB)
        return True
    return False


def lock_holder():
    """What builds or tests in this checkout now, as text, or None."""
    with contextlib.suppress(FileNotFoundError), open(LOCK, encoding="ascii") as lock:
        if not try_to_lock(lock, fcntl.LOCK_SH):
            process = lock.read().strip()
            if not process:  # it has just begun
                return "another command"
            return f"process {process}" if pathlib.Path("/proc", process).exists() else f"a command of the killed process {process}"
    return None


@contextlib.contextmanager
def only_one():
    """Allows one call at a time, because two would overwrite each other's builds and results. Yields a function that notes the
    process. Commands inherit the lock, so they keep it if this process is killed."""
    BUILD.mkdir(exist_ok=True)
    with open(LOCK, "a+", encoding="ascii") as lock:
        until = time.monotonic() + MOMENT
        while not (is_locked := try_to_lock(lock, fcntl.LOCK_EX)) and time.monotonic() < until:
            time.sleep(0.02)
        if not is_locked:
            print(f"{lock_holder() or 'another command'} works in this checkout already. Wait until it ends, or use another checkout: "
                  "git worktree add --detach FOLDER")
            raise Failed

        def note():
            lock.truncate(0)
            lock.write(str(os.getpid()))
            lock.flush()
        note()
        INHERITED.append(lock.fileno())
        try:
            yield note
        finally:
            fcntl.flock(lock, fcntl.LOCK_UN)  # also for what tests have left behind


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
    """Continues in another process. Its output is added to `log`. This one ends, without a release of the lock."""
    log.parent.mkdir(parents=True, exist_ok=True)
    process = os.fork()
    if process:
        print(f"process {process} runs it; its log is {log.relative_to(ROOT)}.\n"
              f"./test.sh --status says what is done; kill {process} stops it, and the same command continues it.", flush=True)
        os._exit(0)
    os.setsid()
    with open(log, "ab") as out, open(os.devnull, "rb") as nothing:
        for number, file in enumerate((nothing, out, out)):
            os.dup2(file.fileno(), number)
    sys.stdout.reconfigure(line_buffering=True)
    print(f"\n######## begun {time.strftime('%Y-%m-%d %H:%M:%S')}")
