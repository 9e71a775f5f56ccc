"""A reader of a document, who types its commands on a machine that has a network, a home and a folder of its own."""
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from waiting import TIMEOUT_S, wait_until
from processes import FAULTS

# Two commands for exceptions.py, and the environment that the last command has left.
PRELUDE = r'''
first() { python3 -c 'import re, sys; print(re.search(r"\"%s\": ?\"?([^\",}]+)" % sys.argv[1], sys.stdin.read())[1])' "$1"; }
jobs_up_to() {
  local last=$1; shift
  while number=$(lightmill submit scene.json --method path --size 16x16 "$@"); do [ "$number" -lt "$last" ] || return 0; done
  return 1
}
[ ! -e ~/environment ] || { . ~/environment; cd "$PWD"; }
set -a
'''


class Failure(AssertionError):
    """A command that does not do what its document says."""


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", int(port))) == 0


class Reader:
    """Runs the commands in order. The variables that a command exports are set for the next. Programs that run until they are
    stopped continue in the background. A new coordinator replaces the last one."""

    def __init__(self, folder, programs):
        self.folder, self.home, self.programs = folder, folder / "home", []
        self.home.mkdir()
        self.variables = {"HOME": str(self.home), "PATH": f"{programs}:{os.environ['PATH']}", "LANG": "C.UTF-8", "TERM": "dumb",
                          "TMPDIR": str(self.home)}

    def type(self, command):
        words = command.split("  #")[0]
        if re.match(r"lightmill-(server|worker) (?!check)", words):
            self.start(command)
        elif re.match(r"lightmill (watch|top)\b", words):
            self.look(command, re.search(r"-o (\S+)", words))
        else:
            if words.startswith("lightmill-server check"):
                self.stop()
            if re.match(r"lightmill (?!certs|check)", words) or words.startswith("jobs_up_to"):
                self.need_farm()
            self.run(command)

    def bash(self, command, **options):
        """Starts a command, which ends with this test."""
        words = ["setpriv", "--pdeathsig", "KILL", "bash", "-c", f"{PRELUDE}{command}\n"]
        return subprocess.Popen(words, cwd=self.folder, env=self.variables, text=True, stdin=subprocess.DEVNULL,
                                stderr=subprocess.STDOUT, **options)

    def run(self, command):
        run = self.bash(f"{command}\ncode=$?; export -p >~/environment; exit $code", stdout=subprocess.PIPE)
        try:
            output, _ = run.communicate(timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            run.kill()
            raise Failure(f"{command}: it does not end within {TIMEOUT_S} s") from None
        self.judge(command, output, run.returncode, [0])

    def look(self, command, output):
        """Runs a command that shows something until Ctrl-C, and presses Ctrl-C once it has shown it."""
        screen = self.home / "screen"
        with screen.open("w") as out:
            run = self.bash(f"exec {command}", stdout=out)
        shown = self.folder / output[1] if output else screen
        try:
            wait_until(command, lambda: run.poll() is not None or shown.exists() and shown.stat().st_size)
            run.send_signal(signal.SIGINT)
            run.wait(TIMEOUT_S)
        finally:
            run.kill()
        self.judge(command, screen.read_text(), run.returncode, [0, 130])

    def start(self, command):
        if command.startswith("lightmill-server"):
            self.stop()
        log = self.folder / f"terminal-{len(self.programs)}"
        with log.open("w") as out:
            run = self.bash(f"for name in ${{!LIGHTMILL_@}}; do unset $name; done\nexec {command}", stdout=out)
        self.programs.append((command, run, log))
        ports = dict(re.findall(r"--(listen|http|health) \S+:(\d+)", command))
        if command.startswith("lightmill-server"):
            up = lambda: all(map(listens, {"listen": 7350, **ports}.values()))
        else:
            up = lambda: "connected to " in log.read_text()
        wait_until(f"{command} is up", lambda: up() or run.poll() is not None)
        if run.poll() is not None:
            self.stop()

    def need_farm(self):
        if not self.programs:
            self.start("lightmill-server")
            self.start("lightmill-worker --threads 1")

    def stop(self):
        """Stops the programs, workers first, and judges them."""
        programs, self.programs = self.programs[::-1], []
        for _, run, _ in programs:
            run.terminate()
            run.wait(TIMEOUT_S)
        for command, run, log in programs:
            self.judge(command, log.read_text(), run.returncode, [0])

    def kill(self):
        for _, run, _ in self.programs:
            run.kill()
            run.wait(TIMEOUT_S)

    def judge(self, command, output, code, codes):
        if code not in codes or "unknown" in output.lower() or any(fault in output for fault in FAULTS):
            raise Failure(f"{command}\n  exit code {code}. It printed:\n{output[-3000:]}")
