#!/usr/bin/env python3
"""A farm on a Slurm cluster whose nodes are network namespaces of this machine: nodes that are lost and cut off, a coordinator
that moves to a new process, and workers that come and go with the work. Each film has to have the bits of an undisturbed one.

  slurm_test.py [--full] SOURCE-FOLDER BUILD-FOLDER

Without --full, only a lost node. Exit code 77 where Slurm is not installed (deploy/setup --tests) or this is not root."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from cluster import Cluster, CONTROLLER, run, wait_until

FULL = "--full" in sys.argv
if FULL:
    sys.argv.remove("--full")
BUILD = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
BIN = BUILD / "bin"
SLURM = SOURCE / "deploy" / "slurm"
SCENE = SOURCE / "scenes" / "cornell-bench-blocks.json"
WORKER = "lightmill-worker"
SKIPPED = 77


class SlurmTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-slurm-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.cluster = cls.enterClassContext(Cluster(cls.folder, nodes=4))
        cls.farm = cls.folder / "farm"
        lightmill = BIN / "lightmill"
        run(lightmill, "certs", "init", cls.farm)
        run(lightmill, "certs", "server", cls.farm, "n1")
        run(lightmill, "certs", "worker", cls.farm, "worker")
        run(lightmill, "certs", "person", cls.farm, "person", "--roles", "view,submit,operate")
        cls.environment = {"LIGHTMILL_FARM": str(cls.farm), "LIGHTMILL_BIN": str(BIN), "LIGHTMILL_DATA": str(cls.folder / "data"),
                           "USER": "root", "HOME": str(cls.folder)}
        cls.cluster.call("sbatch", "--nodelist=n1", SLURM / "coordinator.sbatch", "--lease-seconds", "5",
                         environment=cls.environment)
        cls.wait_for_coordinator()

    # The farm.

    @classmethod
    def ask(cls, *arguments, check=True):
        """What the command line says as JSON."""
        server = ["--server", "n1:7350", "--tls-ca", cls.farm / "ca.pem", "--tls-cert", cls.farm / "person.pem"]
        said = cls.cluster.call(BIN / "lightmill", *arguments, *server, "--json", environment=cls.environment, check=check)
        return json.loads(said or "{}")

    @classmethod
    def wait_for_coordinator(cls):
        wait_until("the coordinator answers", lambda: "jobs" in cls.ask("jobs", check=False), 60)

    def start_workers(self, count, *options):
        self.cluster.call("sbatch", f"--array=1-{count}", "--cpus-per-task=1", *options, SLURM / "worker.sbatch",
                          environment=self.environment)
        wait_until("the workers are there", lambda: len(self.workers()) == count, 60)

    def workers(self):
        return [worker for worker in self.ask("workers")["workers"] if worker["connected"]]

    def slurm_jobs(self):
        return self.cluster.jobs(WORKER)

    def submit(self, seed, samples):
        return str(self.ask("submit", SCENE, "--size", "128x128", "--method", "path", "--seed", seed, "--spp", samples)["id"])

    def done(self, job):
        return self.ask("show", job)["fraction_done"]

    def wait_for(self, job, share):
        wait_until(f"{share:.0%} of job {job}", lambda: self.done(job) >= share, 120)

    def expect_quiet_film(self, job, seed, samples):
        wait_until(f"job {job} is done", lambda: self.ask("show", job)["state"] == "done", 240)
        film = self.ask("fetch", job, "-o", self.folder / f"{job}.exr")["film_hash"]
        quiet = json.loads(run(BIN / "lightmill", "render", SCENE, "--size", "128x128", "--method", "path", "--seed", seed, "--spp",
                               samples, "-o", self.folder / f"quiet-{job}.exr", "--json",
                               env={**os.environ, "HOME": str(self.folder)}))
        self.assertEqual(film, quiet["film_hash"])

    def tearDown(self):
        """The workers leave as they are cancelled, and say so."""
        self.cluster.call("scancel", "--name", WORKER)
        wait_until("no worker is left", lambda: not self.slurm_jobs() and not self.workers(), 60)

    # What happens to it.

    def test_a_lost_node_costs_nothing(self):
        self.start_workers(2)
        places = {node: job for job, _, node, _ in self.slurm_jobs()}
        job = self.submit(1, 1500)
        self.wait_for(job, 0.1)
        lost = sorted(places)[-1]
        self.cluster.kill_all_of(lost)
        wait_until("Slurm starts the worker again", lambda: any(
            number == places[lost] and again == 1 for number, _, _, again in self.slurm_jobs()), 60)
        self.expect_quiet_film(job, 1, 1500)
        self.cluster.start_node(lost)
        wait_until("the node is back", lambda: self.cluster.states()[lost] in ("idle", "mixed"), 60)

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_a_worker_that_slurm_takes_for_lost_and_runs_again_does_no_harm(self):
        self.start_workers(1, "--nodelist=n4")
        job = self.submit(2, 4000)
        self.wait_for(job, 0.05)
        self.cluster.set_link("n4", "down")
        wait_until("Slurm gives the node up", lambda: self.cluster.states()["n4"].startswith("down"), 60)
        pids = run("ip", "netns", "pids", self.cluster.namespace("n4")).split()
        running = [pathlib.Path(f"/proc/{pid}/comm").read_text().strip() for pid in pids]
        self.assertIn("lightmill-worke", running, "it works on")
        self.start_workers(1)  # elsewhere; the other one's results come when its link is back
        before = self.done(job)
        wait_until("others go on", lambda: self.done(job) > before, 60)
        self.cluster.set_link("n4", "up")
        self.expect_quiet_film(job, 2, 4000)
        wait_until("the node is back", lambda: self.cluster.states()["n4"] in ("idle", "mixed"), 60)

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_a_coordinator_whose_node_is_lost_goes_on_when_it_is_back(self):
        self.start_workers(2)
        job = self.submit(3, 1500)
        self.wait_for(job, 0.2)
        self.cluster.kill_all_of("n1")
        wait_until("Slurm gives the node up", lambda: self.cluster.states()["n1"].startswith("down"), 60)
        self.cluster.start_node("n1")
        wait_until("it is started again", lambda: "jobs" in self.ask("jobs", check=False), 240)
        self.assertGreater(self.done(job), 0.1, "what was rendered is there")
        self.expect_quiet_film(job, 3, 1500)

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_as_many_workers_run_as_are_wanted(self):
        log = self.folder / "autoscale.log"
        environment = {**self.environment, "LIGHTMILL_SERVER": "n1:7350", "LIGHTMILL_TLS_CA": str(self.farm / "ca.pem"),
                       "LIGHTMILL_TLS_CERT": str(self.farm / "person.pem")}
        scaler = self.cluster.spawn(CONTROLLER, SLURM / "autoscale", "--max", "3", "--interval", "0.5", "--patience", "4",
                                    "--lightmill", BIN / "lightmill", SLURM / "worker.sbatch", "--cpus-per-task=1",
                                    output=log, environment=environment)
        self.addCleanup(scaler.kill)
        self.addCleanup(lambda: print(log.read_text()))  # shown by who runs this if it fails
        time.sleep(2)
        self.assertEqual(self.slurm_jobs(), [], "nothing is wanted")
        small, large = self.submit(4, 300), self.submit(5, 200_000)
        wait_until("the most that it may start", lambda: len(self.workers()) == 3, 120)
        self.assertEqual(len(self.slurm_jobs()), 3)
        self.expect_quiet_film(small, 4, 300)
        self.ask("cancel", large)
        wait_until("none is wanted any more", lambda: not self.slurm_jobs() and not self.workers(), 60)
        more = self.submit(6, 300)
        wait_until("one comes", self.slurm_jobs, 60)
        self.expect_quiet_film(more, 6, 300)
        scaler.send_signal(signal.SIGTERM)
        self.assertEqual(scaler.wait(30), 0, log.read_text())
        said = log.read_text()
        self.assertIn("ends: ", said)
        self.assertNotIn("all stays as it is", said)


def interrupt(*_):
    raise KeyboardInterrupt  # the one exception that ends a run of tests


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, interrupt)
    missing = [program for program in ("slurmctld", "slurmd", "sbatch", "munged") if not shutil.which(program)]
    if missing or os.geteuid() != 0:
        print("skipped:", f"without {', '.join(missing)}; deploy/setup --tests installs Slurm" if missing else "this is not root")
        sys.exit(SKIPPED)
    sys.exit(0 if unittest.main(exit=False, verbosity=2).result.wasSuccessful() else 1)
