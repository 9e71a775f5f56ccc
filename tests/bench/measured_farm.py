"""A private coordinator and worker, and the cost of jobs: CPU seconds of coordinator, worker and clients."""
import contextlib
import json
import os
import pathlib
import subprocess
import sys
import time

PROGRAMS = pathlib.Path(__file__).resolve().parents[2] / "build/release/bin"
TICK = os.sysconf("SC_CLK_TCK")


def cpu_seconds(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def lightmill(*words):
    """The command line's output, as text."""
    return subprocess.run([PROGRAMS / "lightmill", *map(str, words)], check=True, capture_output=True, text=True).stdout


class Farm:
    def __init__(self, address, processes):
        self.server = ["--server", address]
        self.processes = processes

    def render(self, scene, *words):
        """Submits a job and waits for its end. Returns its id, CPU seconds and wall seconds."""
        client = sum(os.times()[2:4])
        cpu, wall = sum(map(cpu_seconds, self.processes)), time.monotonic()
        job = str(json.loads(lightmill("submit", scene, *self.server, "--json", *words))["id"])
        lightmill("watch", job, *self.server, "--json")
        cpu, wall = sum(map(cpu_seconds, self.processes)) - cpu, time.monotonic() - wall
        return job, cpu + sum(os.times()[2:4]) - client, wall

    def fetch(self, job, picture):
        lightmill("fetch", job, *self.server, "-o", picture)

    def show(self, job):
        return json.loads(lightmill("show", job, *self.server, "--json"))


@contextlib.contextmanager
def farm(folder, threads):
    """A Farm in a folder. It ends with the block."""
    port_file = folder / "port"
    port_file.unlink(missing_ok=True)
    with open(folder / "farm.log", "w", encoding="utf-8") as log:
        server = subprocess.Popen([PROGRAMS / "lightmill-server", "--data", folder / "data", "--listen", "127.0.0.1:0",
                                   "--port-file", port_file], stdout=log, stderr=log)
        worker = None
        try:
            while not port_file.exists():
                if server.poll() is not None:
                    sys.exit(f"the coordinator ended, see {folder / 'farm.log'}")
                time.sleep(0.01)
            address = f"127.0.0.1:{port_file.read_text().strip()}"
            worker = subprocess.Popen([PROGRAMS / "lightmill-worker", "--server", address, "--threads", str(threads)],
                                      stdout=log, stderr=log)
            yield Farm(address, (server, worker))
        finally:
            for process in filter(None, (worker, server)):
                process.terminate()
                process.wait()
