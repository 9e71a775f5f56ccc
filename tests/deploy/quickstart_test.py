#!/usr/bin/env python3
"""Runs quickstart.sh in a copy of the sources, as in a fresh clone: it builds, renders, and leaves nothing running. Takes minutes,
and needs root to install packages, else exit code 77.

  quickstart_test.py SOURCE-FOLDER BUILD-FOLDER
"""
import fcntl
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

from waiting import wait_until

BUILD = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
PHASES = ["packages, download", "packages, installation", "build", "farm", "picture"]


def copy_sources(folder):
    """Copies the files that git tracks, as they are now."""
    listed = subprocess.run(["git", "-C", SOURCE, "ls-files", "-z"], check=True, capture_output=True).stdout
    packed = subprocess.run(["tar", "-C", SOURCE, "--null", "--files-from=-", "--create"], input=listed, check=True, capture_output=True)
    subprocess.run(["tar", "-C", folder, "--extract"], input=packed.stdout, check=True)


def processes_of(folder):
    """Ids of the processes whose programs are in the folder."""
    found = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if pathlib.Path(os.readlink(process / "exe")).is_relative_to(folder):
                found.append(process.name)
        except OSError:
            pass  # it has ended, or is the kernel's
    return found


class Quickstart(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = pathlib.Path(folder.name).resolve()
        copy_sources(cls.root)
        cls.addClassCleanup(cls.quickstart, "--stop")
        cls.first = cls.quickstart("--once")

    @classmethod
    def quickstart(cls, *arguments):
        """Its exit code and output, without the caller's environment."""
        run = subprocess.run([cls.root / "quickstart.sh", *arguments], env={}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return run.returncode, run.stdout

    def test_all_phases_pass_and_have_their_seconds(self):
        code, said = self.first
        self.assertEqual(code, 0, said)
        self.assertEqual(re.findall(r"(?m)^([a-z, ]+) \.\.\.$", said), PHASES)
        self.assertEqual(re.findall(r"(?m)^([a-z, ]+): \d+ s$", said), PHASES)
        self.assertRegex(said, r"\nbuild \.\.\.\n(build: \d+ of \d+\n)*page: ready \d+ s after the start of the build\n")
        self.assertNotRegex(said, r"[\r\x1b]")

    def test_the_picture_is_that_of_the_command_line(self):
        here, lightmill = self.root / "here.exr", BUILD / "bin" / "lightmill"
        subprocess.run([lightmill, "render", SOURCE / "scenes/cornell-bench-blocks.json", "--local", "--spp", "128", "-o", here],
                       check=True, capture_output=True)
        compared = subprocess.run([lightmill, "error", self.root / "cornell-box.exr", here, "--json"], check=True, capture_output=True)
        self.assertEqual(json.loads(compared.stdout)["max_abs"], 0)
        self.assertEqual((self.root / "cornell-box.png").read_bytes()[:4], b"\x89PNG")

    def test_nothing_keeps_running(self):
        self.assertEqual(processes_of(self.root), [])

    def test_a_port_in_use_is_replaced(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            script = (self.root / "quickstart.sh").read_text()
            self.assertIn("127.0.0.1:7350", script)
            (self.root / "quickstart.sh").write_text(script.replace("127.0.0.1:7350", f"127.0.0.1:{other.getsockname()[1]}"))
            code, said = self.quickstart("--once")
        self.assertEqual(code, 0, said)
        self.assertIn("is in use. The farm listens on free ports instead.", said)
        self.assertEqual(processes_of(self.root), [])

    def test_a_signal_ends_the_build(self):
        for file in (self.root / "build" / "release" / "client").rglob("*.o"):
            file.unlink()
        process = subprocess.Popen([self.root / "quickstart.sh", "--once"], env={"CCACHE_DISABLE": "1"}, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True)
        self.addCleanup(process.kill)
        ninja = self.root / "build" / "quickstart.ninja"
        wait_until("ninja runs", ninja.exists)
        process.send_signal(signal.SIGTERM)
        said, _ = process.communicate()
        self.assertEqual(process.returncode, 130, said)
        self.assertNotIn("build: ", said.partition("build ...")[2])
        with open(self.root / "build" / "test.lock", encoding="ascii") as lock:  # the compilers have ended
            fcntl.flock(lock, fcntl.LOCK_EX)

    def test_the_build_folder_of_another_clone_is_configured_again(self):
        cache = self.root / "build" / "release" / "CMakeCache.txt"
        cache.write_text(cache.read_text().replace(f"HOME_DIRECTORY:INTERNAL={self.root}\n", "HOME_DIRECTORY:INTERNAL=/nowhere\n"))
        code, said = self.quickstart("--once")
        self.assertEqual(code, 0, said)
        self.assertIn(f"HOME_DIRECTORY:INTERNAL={self.root}\n", cache.read_text())

    def test_a_farm_of_older_programs_is_restarted_and_stays(self):
        run, server = self.root / ".lightmill" / "quickstart", self.root / "build" / "release" / "bin" / "lightmill-server"
        self.addCleanup(self.quickstart, "--stop")
        old = subprocess.Popen([server, "--data", self.root / ".lightmill", "--listen", "127.0.0.1:0", "--port-file", run / "port",
                                "--http", "127.0.0.1:0", "--http-port-file", run / "http"], stderr=subprocess.DEVNULL)
        self.addCleanup(old.kill)
        (run / "server.pid").write_text(str(old.pid))
        new = shutil.copy2(server, f"{server}.new")
        os.replace(new, server)
        code, said = self.quickstart("--once")
        self.assertEqual(code, 0, said)
        self.assertIn("It is restarted", said)
        self.assertIn("The farm keeps running", said)
        self.assertEqual(old.wait(), 0)
        self.assertEqual(len(processes_of(self.root)), 2)


if __name__ == "__main__":
    if os.geteuid() != 0:
        print("quickstart_test.py: needs root")
        sys.exit(77)
    unittest.main()
