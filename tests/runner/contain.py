"""Runs a command, and ends what it leaves.

  contain.py COMMAND [ARGUMENT...]

All processes below the command are below this one too, also those with a session of their own and those whose parent has ended. When
the command ends, they have ten seconds to end. Those that go on are named and ended, and the exit code is 120. On SIGTERM, or when the
caller ends, all are ended.
"""
import contextlib
import ctypes
import os
import pathlib
import signal
import subprocess
import sys
import time

SECONDS_TO_END = 10  # before the next signal
LEFT_BEHIND = 120  # exit code
SET_PDEATHSIG, SET_CHILD_SUBREAPER = 1, 36  # of prctl(2)


class Stopped(Exception):
    """SIGTERM has come."""


def stop(*_):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise Stopped


def processes_below():
    """Those that have not ended."""
    children, found, parents = {}, [], [os.getpid()]
    for pid in map(int, filter(str.isdigit, os.listdir("/proc"))):
        with contextlib.suppress(OSError):  # it has just ended
            state, parent = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:2]
            if state not in "ZX":
                children.setdefault(int(parent), []).append(pid)
    while parents:
        below = children.get(parents.pop(), [])
        found += below
        parents += below
    return found


def wait_until_none():
    """Returns the processes that have not ended in time."""
    until = time.monotonic() + SECONDS_TO_END
    while (left := processes_below()) and time.monotonic() < until:
        take_exit_codes()
        time.sleep(0.02)
    return left


def take_exit_codes():
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def end_all():
    for number in (signal.SIGTERM, signal.SIGKILL):
        for pid in processes_below():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)
        if not wait_until_none():
            break


def command_of(pid):
    with contextlib.suppress(OSError):
        return pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").replace("\0", " ").strip()
    return "which has just ended"


def end_with_parent():
    """SIGTERM comes when the parent ends."""
    ctypes.CDLL(None).prctl(SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)


def main():
    ctypes.CDLL(None).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0)  # orphans become children of this process
    command = None
    try:
        signal.signal(signal.SIGTERM, stop)
        end_with_parent()
        command = subprocess.Popen(sys.argv[1:], close_fds=False)
        pid = 0
        while pid != command.pid:
            pid, status = os.waitpid(-1, 0)
        left = wait_until_none()
        for pid in left:
            print(f"left behind: process {pid}: {command_of(pid)}", flush=True)
        end_all()
    except Stopped:
        if command is not None:
            command.send_signal(signal.SIGTERM)  # first, so that it does not report the others' deaths
        end_all()
        return 128 + signal.SIGTERM
    code = os.waitstatus_to_exitcode(status)
    return LEFT_BEHIND if left else code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main())
