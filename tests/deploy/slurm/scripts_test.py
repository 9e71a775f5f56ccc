#!/usr/bin/env python3
"""The scripts of deploy/slurm without Slurm: the programs and arguments that they start, and the decisions of autoscale.
Stand-ins for Slurm's programs and Lightmill's record how they are called.

  scripts_test.py SOURCE-FOLDER
"""
import argparse
import importlib.machinery
import importlib.util
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from waiting import TIMEOUT_S, wait_until

SOURCE = pathlib.Path(sys.argv.pop()).absolute()
SLURM = SOURCE / "deploy" / "slurm"


def load(path):
    loader = importlib.machinery.SourceFileLoader("autoscale", str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    sys.modules[loader.name] = module
    loader.exec_module(module)
    return module


autoscale = load(SLURM / "autoscale")


class Scripts(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.farm, self.bin, self.calls = self.folder / "farm", self.folder / "bin", self.folder / "calls"
        self.bin.mkdir()
        self.calls.touch()
        self.environment = {"PATH": f"{self.bin}:{os.environ['PATH']}", "HOME": str(self.folder), "USER": "ada",
                            "LIGHTMILL_FARM": str(self.farm), "LIGHTMILL_DATA": "/data"}
        self.stand_in("lightmill-worker")
        self.stand_in("scontrol")
        self.stand_in("squeue", "case $* in *--jobs=7*) echo RUNNING ;; *--jobs=8*) echo COMPLETING ;; "
                                "*) echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1 ;; esac")

    def stand_in(self, name, action="", first=""):
        """Runs `first` before the call is recorded, and `action` after it."""
        path = self.bin / name
        path.write_text(f'#!/bin/bash\n{first}\necho "{name} $*" >>{self.calls}\n{action}\n')
        path.chmod(0o755)

    def called(self, program):
        lines = self.calls.read_text().splitlines()
        return [line.split(" ", 1)[1] for line in lines if line.split()[0] == program]

    def start(self, *options, job="9", node="n1", **more):
        """Starts the coordinator's script and everything it starts in their own process group."""
        process = subprocess.Popen(["bash", SLURM / "coordinator.sbatch", *options], start_new_session=True,
                                   env={**self.environment, "SLURM_JOB_ID": job, "SLURMD_NODENAME": node}, **more)
        self.addCleanup(process.wait)
        self.addCleanup(self.kill_all, process)
        return process

    @staticmethod
    def kill_all(process):
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass

    def coordinator(self, *options, **more):
        """A script whose coordinator runs and ends on SIGTERM."""
        self.stand_in("lightmill-server", "while :; do /bin/sleep 0.05; done", first="trap 'exit 0' TERM")
        before = len(self.called("lightmill-server"))
        process = self.start(*options, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
        self.addCleanup(process.stdout.close)
        wait_until("the coordinator starts", lambda: len(self.called("lightmill-server")) > before)
        return process

    def cancelled(self, process):
        """Signals all processes of a job, like Slurm."""
        os.killpg(process.pid, signal.SIGTERM)
        return process.wait(TIMEOUT_S)

    def addresses(self):
        return {path.name: path.read_text().strip() for path in (self.farm / "coordinators").iterdir()}

    def test_a_coordinator_keeps_its_state_in_a_folder_unless_options_name_another(self):
        for options in [(), ("--store", "postgres://db/farm"), ("--store=postgres://db/farm",), ("--data", "/other")]:
            self.assertEqual(self.cancelled(self.coordinator(*options)), 0)
        said = " ".join(("--listen", "0.0.0.0:7350"))
        self.assertEqual(self.called("lightmill-server"), [
            f"{said} --data /data", f"{said} --store postgres://db/farm", f"{said} --store=postgres://db/farm",
            f"{said} --data /other"])
        self.assertEqual(self.called("scontrol"), [])

    def test_both_of_a_pair_have_an_address_and_ended_ones_have_none(self):
        (self.farm / "coordinators").mkdir(parents=True)
        for job in ("7", "8", "6"):  # running, completing, long gone
            (self.farm / "coordinators" / job).write_text(f"n{job}:7350\n")
        self.cancelled(self.coordinator("--store", "postgres://db/farm"))
        self.assertEqual(self.addresses(), {"7": "n7:7350", "9": "n1:7350"})
        subprocess.run(["bash", SLURM / "worker.sbatch", "--more"], check=True,
                       env={**self.environment, "SLURM_JOB_ID": "5", "SLURM_CPUS_ON_NODE": "2"})
        self.assertEqual(self.called("lightmill-worker"), ["--server n7:7350,n1:7350 --threads 2 --name slurm-5-0.0 --more"])
        self.cancelled(self.coordinator(node="n2"))
        self.assertEqual(self.addresses(), {"9": "n2:7350"}, "one state, one coordinator")

    def test_an_address_stays_while_slurm_does_not_answer(self):
        (self.farm / "coordinators").mkdir(parents=True)
        (self.farm / "coordinators" / "6").write_text("n6:7350\n")
        self.stand_in("squeue", "echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1")
        self.cancelled(self.coordinator("--store", "postgres://db/farm"))
        self.assertEqual(set(self.addresses()), {"6", "9"})

    def test_a_coordinator_is_requeued_when_its_time_is_up(self):
        process = self.coordinator()
        process.send_signal(signal.SIGUSR1)
        self.assertEqual(process.wait(TIMEOUT_S), 0)
        self.assertEqual(self.called("scontrol"), ["requeue 9"])

    def test_a_coordinator_that_cannot_start_ends(self):
        self.stand_in("lightmill-server", "exit 1")
        run = subprocess.run(["bash", SLURM / "coordinator.sbatch"], check=False, timeout=TIMEOUT_S,
                             env={**self.environment, "SLURM_JOB_ID": "9", "SLURMD_NODENAME": "n1"})
        self.assertEqual(run.returncode, 1)
        self.assertEqual(len(self.called("lightmill-server")), 1)

    def test_a_coordinator_retries_while_its_database_is_away(self):
        self.stand_in("sleep")
        self.stand_in("lightmill-server", f'[ "$(grep -c ^lightmill-server {self.calls})" -ge 3 ] || exit 1; while :; do /bin/sleep 0.05; done',
                      first="trap 'exit 0' TERM")
        process = self.start("--store", "postgres://db/farm")
        wait_until("three starts", lambda: len(self.called("lightmill-server")) == 3)
        self.assertEqual(self.called("sleep"), ["2", "4"], "seconds between them")
        self.assertEqual(self.cancelled(process), 0)
        self.assertEqual(len(self.called("lightmill-server")), 3)

    def test_a_coordinator_that_waits_for_its_database_ends_on_a_signal(self):
        self.stand_in("sleep", '[ "$1" != 8 ] || exec /bin/sleep 1000')
        self.stand_in("lightmill-server", "exit 1")
        process = self.start("--store=postgres://db/farm")
        stat = pathlib.Path(f"/proc/{process.pid}/stat")
        wait_until("the third sleep", lambda: self.called("sleep") == ["2", "4", "8"] and
                   stat.read_text().rpartition(")")[2].startswith(" S"))
        process.send_signal(signal.SIGUSR1)
        self.assertEqual(process.wait(TIMEOUT_S), 1)
        self.assertEqual(self.called("scontrol"), ["requeue 9"])

    def started_worker(self, **more):
        """The environment of the started worker."""
        self.stand_in("lightmill-worker", f"env | grep ^LIGHTMILL_ >{self.folder}/environment")
        subprocess.run(["bash", SLURM / "worker.sbatch"], check=True, env={
            **self.environment, "SLURM_JOB_ID": "5", "SLURM_CPUS_ON_NODE": "2", "LIGHTMILL_SERVER": "n1:7350", **more})
        return dict(line.split("=", 1) for line in (self.folder / "environment").read_text().splitlines())

    def test_a_worker_enrols_without_the_credentials_of_its_submitter(self):
        self.farm.mkdir()
        own = {"LIGHTMILL_TLS_CA": "/ada/ca.pem", "LIGHTMILL_TLS_CERT": "/ada/ada.pem", "LIGHTMILL_TLS_KEY": "/ada/ada.key",
               "LIGHTMILL_TOKEN": "lightmill_1", "LIGHTMILL_TOKEN_FILE": "/ada/token"}
        self.assertEqual({name: value for name, value in self.started_worker(**own).items() if name in own}, own,
                         "a farm without certificates")
        (self.farm / "ca.pem").touch()
        variables = self.started_worker(**own)
        self.assertEqual({name: variables.get(name) for name in [*own, "LIGHTMILL_ENROL_FILE", "LIGHTMILL_STATE"]}, {
            **dict.fromkeys(own), "LIGHTMILL_TLS_CA": f"{self.farm}/ca.pem", "LIGHTMILL_ENROL_FILE": f"{self.farm}/worker.enrol",
            "LIGHTMILL_STATE": "/var/tmp/lightmill-worker-ada"})
        self.assertEqual(self.started_worker(LIGHTMILL_STATE="/scratch")["LIGHTMILL_STATE"], "/scratch")

    def test_a_worker_without_a_coordinator_says_what_to_do(self):
        run = subprocess.run(["bash", SLURM / "worker.sbatch"], check=False, capture_output=True, text=True,
                             env={**self.environment, "SLURM_JOB_ID": "5"})
        self.assertEqual((run.returncode, run.stdout), (1, ""))
        self.assertRegex(run.stderr, r"^\S*/coordinators has no address: start coordinator.sbatch")


class FakeSlurm:
    """Jobs as squeue lists them, and a coordinator that wants this many workers."""

    def __init__(self):
        self.wanted = 0
        self.jobs = {}  # id: [state, begin, end, reason]
        self.arrays = 0

    def __call__(self, command):
        return {"lightmill": self.lightmill, "squeue": self.squeue, "sbatch": self.sbatch, "scancel": self.scancel}[command[0]](command)

    def lightmill(self, _):
        return f"{self.wanted}\n"

    def squeue(self, _):
        return "".join(f"{job} {state} 2030-01-01T00:00:00 {begin} {end} {reason}\n"
                       for job, (state, begin, end, reason) in self.jobs.items())

    def sbatch(self, command):
        self.arrays += 1
        count = int(next(word for word in command if word.startswith("--array=")).split("-")[-1])
        for task in range(count):
            self.jobs[f"{self.arrays}_{task + 1}"] = ["PENDING", "N/A", "N/A", "Resources"]
        return f"{self.arrays}\n"

    def scancel(self, command):
        for job in command[1:]:
            self.jobs[job] = ["CANCELLED", "2030-01-01T00:00:00", "2030-01-01T00:00:01", "None"]

    def all(self, state, seconds=0, reason="None"):
        """Moves all jobs of the last array to this state."""
        for job in self.jobs:
            if job.startswith(f"{self.arrays}_"):
                end = f"2030-01-01T00:{seconds // 60:02}:{seconds % 60:02}"
                self.jobs[job] = [state, "2030-01-01T00:00:00", end if state not in ("PENDING", "RUNNING") else "N/A", reason]


class Options(unittest.TestCase):
    def test_options_that_would_submit_forever_are_refused(self):
        script = str(SLURM / "worker.sbatch")
        for arguments in (["--name", "a,b", script], ["--name", "", script], [script, "--job-name=farm"], [script, "-J", "farm"],
                          [script, "--array", "1-9"], ["--interval", "nan", script], ["--scale-down-delay", "inf", script], [str(SLURM)]):
            with self.assertRaises(SystemExit) as ended, mock.patch("sys.stderr"):
                autoscale.options_of(arguments)
            self.assertEqual(ended.exception.code, 2, arguments)
        self.assertEqual(autoscale.options_of([script, "--account=film", "-p", "cpu"]).sbatch, ["--account=film", "-p", "cpu"])


class Autoscale(unittest.TestCase):
    def setUp(self):
        self.slurm = FakeSlurm()
        self.said = []
        self.enterContext(mock.patch.object(autoscale, "output_of", self.slurm))
        self.enterContext(mock.patch.object(autoscale, "say", self.said.append))
        self.enterContext(mock.patch.dict(os.environ, {"LIGHTMILL_SERVER": "farm:7350"}))
        options = argparse.Namespace(min=0, max=4, scale_down_delay=120, name="lightmill-worker", lightmill="lightmill", script="w", sbatch=[])
        self.scaler = autoscale.Scaler(options)
        self.now = 0

    def look(self, seconds=15):
        """Calls it every 15 s for this long."""
        for _ in range(seconds // 15):
            self.now += 15
            self.scaler.look(self.now)

    def test_workers_come_and_go_with_the_work(self):
        self.slurm.wanted = 3
        self.look()
        self.slurm.all("RUNNING")
        self.look(600)
        self.assertEqual(self.slurm.arrays, 1)
        self.slurm.wanted = 1
        self.look(120)
        self.assertEqual([state for state, *_ in self.slurm.jobs.values()], ["RUNNING"] * 3, "not yet")
        self.look(15)
        self.assertEqual([state for state, *_ in self.slurm.jobs.values()], ["RUNNING", "CANCELLED", "CANCELLED"], "the youngest")
        self.slurm.wanted = 2
        self.look()
        self.assertEqual(self.slurm.arrays, 2, "that it cancelled some is no reason to wait")

    def test_workers_that_fail_at_once_are_started_less_and_less_often(self):
        self.slurm.wanted = 3
        for _ in range(3600 // 15):
            self.look()
            self.slurm.all("FAILED", seconds=2, reason="NonZeroExitCode")
        self.assertEqual(self.slurm.arrays, 14)  # after 0, 30, 60, 120, 240 and then every 300 s, plus the time of queries
        self.assertIn("jobs that ended within a minute of their start, or are held: 3 (1_1: FAILED; see its log). "
                      "No submissions for 30 s", self.said)
        self.assertTrue(self.said[-1].endswith("No submissions for 300 s") or self.said[-2].endswith("No submissions for 300 s"))
        self.look(300)
        self.slurm.all("RUNNING")
        self.look(1200)
        self.slurm.all("FAILED", seconds=1200)
        arrays = self.slurm.arrays
        self.look()
        self.assertEqual(self.slurm.arrays, arrays + 1, "they ran long enough")
        self.slurm.all("COMPLETED", seconds=10)
        self.look()
        self.assertTrue(self.said[-1].endswith("No submissions for 30 s"), "it started again")

    def test_held_workers_do_not_count(self):
        self.slurm.wanted = 2
        self.look()
        for state, reason in [("PENDING", "JobHeldUser"), ("REQUEUE_HOLD", "None"), ("PENDING", "launch failed requeued held")]:
            arrays = self.slurm.arrays
            self.slurm.all(state, reason=reason)
            self.look(30)
            self.assertEqual(self.slurm.arrays, arrays, f"a pause: {reason}")
            self.look(300)
            self.assertEqual(self.slurm.arrays, arrays + 1, reason)
        self.slurm.wanted = 0
        self.look(600)
        self.assertEqual(self.slurm.jobs["1_1"][0], "PENDING", "the holder of the job decides")

    def test_earlier_failures_do_not_count(self):
        self.slurm.wanted = 1
        self.slurm.jobs["77"] = ["FAILED", "2030-01-01T00:00:00", "2030-01-01T00:00:01", "NonZeroExitCode"]
        self.look()
        self.assertEqual(self.slurm.arrays, 1)


if __name__ == "__main__":
    sys.exit(0 if unittest.main(exit=False, verbosity=2).result.wasSuccessful() else 1)
