#!/usr/bin/env python3
"""Checks the units of deploy/systemd: systemd finds no fault, and the programs render within the units' limits of system calls
and memory. systemd need not run.

  systemd_test.py SOURCE-FOLDER BUILD-FOLDER
"""
import ctypes
import pathlib
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import help_text
from waiting import TIMEOUT_S, wait_until
from processes import BackgroundProgram

BUILD = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
BIN = BUILD / "bin"
UNITS = SOURCE / "deploy" / "systemd"
PROGRAMS = ["lightmill-server", "lightmill-worker"]
MOST_EXPOSURE = 15  # in tenths of 100; systemd calls up to 20 OK, and both units have 12

PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
SECCOMP_ALLOW, SECCOMP_EPERM, SECCOMP_KILL = 0x7FFF0000, 0x00050001, 0x80000000
AUDIT_ARCH_X86_64 = 0xC000003E
LOAD, JUMP_EQUAL, JUMP_ANY_BIT, AND, RETURN = 0x20, 0x15, 0x45, 0x54, 0x06
PROT_WRITE, PROT_EXEC = 2, 4
NUMBER, ARCH, THIRD_ARGUMENT = 0, 4, 32  # offsets in struct seccomp_data


def setting(program, name):
    """All values of a setting of the unit, in order."""
    text = (UNITS / f"{program}.service").read_text()
    return re.findall(rf"(?m)^{name}=(.*)$", text)


def calls_of(group):
    """Names of the system calls in a systemd group."""
    run = subprocess.run(["systemd-analyze", "syscall-filter", group], capture_output=True, text=True, check=True)
    calls = set()
    for line in map(str.strip, run.stdout.splitlines()[1:]):
        if line.startswith("@"):
            calls |= calls_of(line)
        elif line and not line.startswith("#"):
            calls.add(line)
    return calls


def allowed_calls(program):
    """System calls that SystemCallFilter allows."""
    allowed = set()
    for line in setting(program, "SystemCallFilter"):
        for group in line.lstrip("~").split():
            calls = calls_of(group) if group.startswith("@") else {group}
            allowed = allowed - calls if line.startswith("~") else allowed | calls
    return allowed


def call_numbers():
    header = pathlib.Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h").read_text()
    return {name: int(number) for name, number in re.findall(r"#define __NR_(\w+) (\d+)", header)}


def filter_program(allowed):
    """A seccomp program like systemd's for SystemCallFilter=, SystemCallErrorNumber=EPERM and MemoryDenyWriteExecute=."""
    def step(code, value, if_true=0, if_false=0):
        return struct.pack("HBBI", code, if_true, if_false, value)
    numbers = call_numbers()
    steps = [step(LOAD, ARCH), step(JUMP_EQUAL, AUDIT_ARCH_X86_64, 1, 0), step(RETURN, SECCOMP_KILL), step(LOAD, NUMBER)]
    both = PROT_WRITE | PROT_EXEC
    steps += [step(JUMP_EQUAL, numbers["mmap"], 0, 5), step(LOAD, THIRD_ARGUMENT), step(AND, both),
              step(JUMP_EQUAL, both, 0, 1), step(RETURN, SECCOMP_EPERM), step(RETURN, SECCOMP_ALLOW)]
    for call in ("mprotect", "pkey_mprotect"):
        steps += [step(JUMP_EQUAL, numbers[call], 0, 4), step(LOAD, THIRD_ARGUMENT), step(JUMP_ANY_BIT, PROT_EXEC, 0, 1),
                  step(RETURN, SECCOMP_EPERM), step(RETURN, SECCOMP_ALLOW)]
    for call in sorted(allowed & numbers.keys() - {"mmap", "mprotect", "pkey_mprotect"}):
        steps += [step(JUMP_EQUAL, numbers[call], 0, 1), step(RETURN, SECCOMP_ALLOW)]
    return b"".join(steps + [step(RETURN, SECCOMP_EPERM)])


class Filter(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("steps", ctypes.c_char_p)]


def confine(steps):
    """Installs the filter in the child before it becomes the program. Its children inherit the filter."""
    libc = ctypes.CDLL(None, use_errno=True)
    program = Filter(len(steps) // 8, steps)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 or libc.prctl(
            PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.byref(program), 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "seccomp")


def start_confined(program, arguments, log):
    steps = filter_program(allowed_calls(program))
    return BackgroundProgram([BIN / program, *arguments], log, preexec_fn=lambda: confine(steps))


def words_of(path, variable):
    """A variable of an EnvironmentFile, also if commented out, split into words like systemd's $NAME."""
    text = re.sub(r"(?m)^#\s*(?=LIGHTMILL_)", "", path.read_text())
    return [word for value in re.findall(rf"(?m)^{variable}=(.*)$", text) for quoted in shlex.split(value) for word in quoted.split()]


@unittest.skipUnless(shutil.which("systemd-analyze"), "no systemd")
class Units(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.place = pathlib.Path(self.folder.name)

    def installed_units(self):
        """Units as installed by the package, but with the built programs."""
        names = {"lightmill-server": ["lightmill-server"], "lightmill-worker": ["lightmill-worker", "lightmill-worker@"]}
        for program, units in names.items():
            text = (UNITS / f"{program}.service").read_text()
            start = f"ExecStart=/usr/bin/{program} "
            self.assertIn(start, text)
            for unit in units:
                path = self.place / f"{unit}.service"
                path.write_text(text.replace(start, f'ExecStart="{BIN}/{program}" '))
                yield path

    def test_systemd_finds_nothing_wrong(self):
        for unit in self.installed_units():
            run = subprocess.run(["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True, check=False)
            self.assertEqual((run.returncode, run.stdout + run.stderr), (0, ""), unit.name)

    def test_exposure_is_low(self):
        for unit in self.installed_units():
            run = subprocess.run(["systemd-analyze", "security", "--offline=true", f"--threshold={MOST_EXPOSURE}", "--no-pager", unit],
                                 capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)

    def test_a_farm_renders_within_the_limits_of_its_units(self):
        port_file, picture, log_path = (self.place / name for name in ("port", "picture.png", "log"))
        server = start_confined("lightmill-server", ["--data", self.place / "data", "--listen", "127.0.0.1:0", "--port-file", port_file,
                                                     "--http", "127.0.0.1:0"], log_path)
        programs = [server]
        try:
            wait_until("the coordinator writes its port", lambda: server.poll() is not None or
                       port_file.exists() and port_file.read_text())
            self.assertTrue(port_file.exists(), log_path.read_text())
            farm = f"127.0.0.1:{port_file.read_text().strip()}"
            programs.append(start_confined("lightmill-worker", ["--server", farm, "--threads", "2"], log_path))
            # Includes textures, which other libraries decode.
            for scene in ("cornell-bench-blocks", "course-default"):
                run = subprocess.run([BIN / "lightmill", "render", SOURCE / "scenes" / f"{scene}.json", "--server", farm, "--spp", "2",
                                      "--size", "64x64", "-o", picture], capture_output=True, text=True, check=False,
                                     timeout=TIMEOUT_S)
                self.assertEqual(run.returncode, 0, run.stderr + log_path.read_text())
            while programs:
                programs.pop().end()
        finally:
            for program in programs:
                program.kill()
                program.wait()

    def test_the_filter_refuses_forbidden_calls(self):
        steps = filter_program(allowed_calls("lightmill-worker"))
        asks = ("import ctypes, mmap\nlibc = ctypes.CDLL(None, use_errno=True)\n"
                "print(libc.chroot(b'/'), ctypes.get_errno())\n"
                "try:\n  mmap.mmap(-1, 4096, prot=mmap.PROT_WRITE | mmap.PROT_EXEC)\nexcept PermissionError:\n  print('refused')\n")
        run = subprocess.run([sys.executable, "-c", asks], capture_output=True, text=True, check=True, preexec_fn=lambda: confine(steps))
        self.assertEqual(run.stdout, "-1 1\nrefused\n")

    def test_a_worker_has_time_to_leave(self):
        # A unit of work takes about a second (--unit-seconds), at most 60, and is sent twice if the coordinator is away.
        self.assertGreaterEqual(int(setting("lightmill-worker", "TimeoutStopSec")[0]), 2 * 60)

    def test_configured_options_exist(self):
        for program, file, variable in (("lightmill-server", "server.conf", "LIGHTMILL_SERVER_OPTIONS"),
                                        ("lightmill-worker", "worker.conf", "LIGHTMILL_WORKER_OPTIONS")):
            options, _ = help_text.options_and_commands(help_text.help_of(BIN, [program]))
            named = {word for word in words_of(UNITS / file, variable) if word.startswith("--")}
            self.assertEqual(named - options, set())
            self.assertIn(f"EnvironmentFile=-/etc/lightmill/{file}", (UNITS / f"{program}.service").read_text())
            self.assertIn(f"${variable}\n", (UNITS / f"{program}.service").read_text())
        # Options that the worker reads itself.
        worker_help = " ".join(" ".join(help_text.help_of(BIN, ["lightmill-worker"])).split())
        for name in re.findall(r"(?m)^#?(LIGHTMILL_\w+)=", (UNITS / "worker.conf").read_text()):
            if name != "LIGHTMILL_WORKER_OPTIONS":
                self.assertRegex(worker_help, rf"\(default: \${name}[,)]")

    def test_both_run_as_users_that_the_packages_create(self):
        for program in PROGRAMS:
            script = (SOURCE / "deploy" / "debian" / program / "postinst").read_text()
            self.assertEqual(setting(program, "User"), re.findall(r"(?m)adduser --system .* (\S+)$", script))


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=2).result
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped else 0)  # 77: this machine lacks something
