#!/usr/bin/env python3
"""A farm on a Slurm cluster whose nodes are network namespaces of this machine. Each film must have the bits of an undisturbed one.

  slurm_test.py [--full] SOURCE-FOLDER BUILD-FOLDER

Without --full, it tests only a lost node and a cancelled worker. Exit code 77 if Slurm is not installed (deploy/setup --tests)
or the user is not root."""
import collections
import json
import os
import pathlib
import re
import shutil
import signal
import sys
import tempfile
import unittest

from cluster import Cluster, CONTROLLER, run, wait_until
from waiting import TIMEOUT_S
from postgres import start_postgres
from processes import expect_no_fault

FULL = "--full" in sys.argv
if FULL:
    sys.argv.remove("--full")
BUILD = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
BIN = BUILD / "bin"
SLURM = SOURCE / "deploy" / "slurm"
SCENE = SOURCE / "scenes" / "cornell-bench-blocks.json"
COORDINATOR, WORKER = "lightmill-coordinator", "lightmill-worker"
PORT = 7350
SKIPPED = 77


class Farm:
    """Certificates in a folder, coordinators on nodes, and workers."""

    def __init__(self, cluster, name, nodes):
        self.cluster = cluster
        self.folder = cluster.folder / name
        self.server = ",".join(f"{node}:{PORT}" for node in nodes)
        lightmill = BIN / "lightmill"
        run(lightmill, "certs", "init", self.folder)
        run(lightmill, "certs", "server", self.folder, *nodes)
        run(lightmill, "certs", "person", self.folder, "person", "--roles", "view,submit,operate")
        run(lightmill, "certs", "person", self.folder, "admin", "--roles", "admin")
        self.environment = {"LIGHTMILL_FARM": str(self.folder), "LIGHTMILL_BIN": str(BIN),
                            "LIGHTMILL_DATA": str(cluster.folder / f"{name}-data"),
                            "LIGHTMILL_STATE": str(cluster.folder / f"{name}-workers"), "USER": "root", "HOME": str(cluster.folder)}

    def batch(self, *arguments):
        """The job's number."""
        return self.cluster.call("sbatch", "--parsable", *arguments, environment=self.environment).strip()

    def start_coordinator(self, node, *options):
        return self.batch(f"--nodelist={node}", SLURM / "coordinator.sbatch", "--lease-seconds", "5", *options)

    def coordinator_log(self, number):
        log = self.cluster.folder / f"{COORDINATOR}-{number}.log"
        return log.read_text() if log.exists() else ""

    def ask(self, *arguments, check=True, who="person"):
        """The command line's output as JSON."""
        server = ["--server", self.server, "--tls-ca", self.folder / "ca.pem", "--tls-cert", self.folder / f"{who}.pem"]
        said = self.cluster.call(BIN / "lightmill", *arguments, *server, "--json", environment=self.environment, check=check)
        return json.loads(said or "{}")

    def answers(self):
        return "jobs" in self.ask("jobs", check=False)

    def let_workers_enrol(self, count):
        """Creates a token that this many machines can use, and returns its id."""
        return self.ask("tokens", "create", "worker", "--enrol", count, "--out", self.folder / "worker.enrol", who="admin")["id"]

    def enrolled(self):
        """Names that workers have enrolled with."""
        return [token["name"] for token in self.ask("tokens", who="admin")["tokens"] if "enrolled_by" in token]

    def start_workers(self, count, *options, worker_options=()):
        there = len(self.workers())
        self.batch(f"--array=1-{count}", "--cpus-per-task=1", *options, SLURM / "worker.sbatch", *worker_options)
        wait_until("the workers are there", lambda: len(self.workers()) == there + count)

    def workers(self):
        """Names of connected workers."""
        return [worker["name"] for worker in self.ask("workers")["workers"] if worker["connected"]]

    def worker_log(self, name):
        """The log, also of workers that the same job started before."""
        job, task = re.search(r"slurm-(\d+)-(\d+)\.\d+$", name).groups()
        return (self.cluster.folder / f"{WORKER}-{job}_{task}.log").read_text()

    def has_drained(self, name):
        """Whether the worker finished its units when it was last asked to drain."""
        return "leaving: drained" in self.worker_log(name).rpartition("draining: ")[2]

    def submit(self, seed, samples):
        return str(self.ask("submit", SCENE, "--size", "128x128", "--method", "path", "--seed", seed, "--spp", samples)["id"])

    def show(self, job):
        return self.ask("show", job)

    def done(self, job):
        return self.show(job)["fraction_done"]

    def wait_for(self, job, share):
        wait_until(f"{share:.0%} of job {job}", lambda: self.done(job) >= share)


class SlurmTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-slurm-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.cluster = cls.enterClassContext(Cluster(cls.folder, nodes=4))
        cls.farm = Farm(cls.cluster, "farm", ["n1"])
        cls.coordinator = cls.farm.start_coordinator("n1")
        wait_until("the coordinator answers", cls.farm.answers)
        cls.farm.let_workers_enrol(8)  # more than run at once, on nodes that share one disk

    def slurm_jobs(self):
        return self.cluster.jobs(WORKER)

    def expect_quiet_film(self, job, seed, samples, farm=None):
        farm = farm or self.farm
        wait_until(f"job {job} is done", lambda: farm.show(job)["state"] == "done", 1800)
        film = farm.ask("fetch", job, "-o", self.folder / f"{job}.exr")["film_hash"]
        quiet = json.loads(run(BIN / "lightmill", "render", SCENE, "--size", "128x128", "--method", "path", "--seed", seed, "--spp",
                               samples, "-o", self.folder / f"quiet-{job}.exr", "--json",
                               env={**os.environ, "HOME": str(self.folder)}))
        self.assertEqual(film, quiet["film_hash"])

    def expect_drained(self, names, farm=None):
        for name in names:
            self.assertTrue((farm or self.farm).has_drained(name), (farm or self.farm).worker_log(name))

    def cancel_workers(self, farm):
        """Workers leave and say so when they are cancelled, before Slurm kills them."""
        names = farm.workers()
        self.cluster.call("scancel", "--name", WORKER)
        wait_until("no worker is left", lambda: not self.slurm_jobs() and not farm.workers())
        self.expect_drained(names, farm)

    def expect_no_crash(self):
        for log in self.folder.glob("lightmill-*.log"):
            expect_no_fault(log)
        self.assertEqual(self.cluster.call("squeue", "--noheader", "--array", "--states=FAILED,OUT_OF_MEMORY", "--format=%i %j %T"), "")

    def tearDown(self):
        self.cancel_workers(self.farm)
        self.expect_no_crash()

    # Faults.

    def test_a_lost_node_costs_nothing(self):
        self.farm.start_workers(2)
        places = {node: job for job, _, node, _ in self.slurm_jobs()}
        job = self.farm.submit(1, 250)
        self.farm.wait_for(job, 0.1)
        lost = sorted(places)[-1]
        self.cluster.kill_all_of(lost)
        wait_until("Slurm starts the worker again", lambda: any(
            number == places[lost] and again == 1 for number, _, _, again in self.slurm_jobs()))
        self.expect_quiet_film(job, 1, 250)
        self.cluster.start_node(lost)
        wait_until("the node is back", lambda: self.cluster.states()[lost] in ("idle", "mixed", "allocated"))

    def test_a_cancelled_worker_returns_the_units_it_had_not_begun(self):
        self.farm.start_workers(2)
        job = self.farm.submit(7, 1000)
        self.farm.wait_for(job, 0.1)
        before = self.farm.workers()
        self.cluster.call("scancel", self.slurm_jobs()[0][0])
        wait_until("it leaves", lambda: len(self.slurm_jobs()) == 1)
        shown = self.farm.show(job)
        self.assertLess(shown["fraction_done"], 1)
        self.assertEqual(shown["counters"]["leases_lost"], 0)
        self.expect_drained(set(before) - set(self.farm.workers()))
        self.expect_quiet_film(job, 7, 1000)
        identities = {name.rpartition("/")[0] for name in before}
        self.assertEqual(len(identities), 2, before)
        self.assertLessEqual(identities, set(self.farm.enrolled()))

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_a_worker_that_slurm_runs_twice_does_no_harm(self):
        self.farm.start_workers(1, worker_options=["--log-level", "debug"])
        [name] = self.farm.workers()
        [(number, _, cut, _)] = self.slurm_jobs()
        job = self.farm.submit(2, 4000)
        self.farm.wait_for(job, 0.05)
        self.cluster.set_link(cut, "down")
        wait_until("Slurm runs it again elsewhere", lambda: any(
            (again, state) == (1, "RUNNING") and node != cut for _, state, node, again in self.slurm_jobs()), 180)
        self.assertEqual([each for each, *_ in self.slurm_jobs()], [number])
        pids = run("ip", "netns", "pids", self.cluster.namespace(cut)).split()
        running = [pathlib.Path(f"/proc/{pid}/comm").read_text().strip() for pid in pids]
        self.assertIn(WORKER[:15], running, "the first one works on")
        before = self.farm.done(job)
        wait_until("the second one renders", lambda: self.farm.done(job) > before)
        self.cluster.set_link(cut, "up")
        self.expect_quiet_film(job, 2, 4000)
        rendered = collections.Counter(re.findall(rf"(job {job}, samples \S+ \S+ tile \d+) is rendered", self.farm.worker_log(name)))
        self.assertGreater(rendered.most_common(1)[0][1], 1, "both rendered some of it")
        wait_until("the node is back", lambda: self.cluster.states()[cut] in ("idle", "mixed", "allocated"))

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_a_coordinator_resumes_when_its_lost_node_is_back(self):
        self.farm.start_workers(2)
        job = self.farm.submit(3, 1500)
        self.farm.wait_for(job, 0.2)
        self.cluster.kill_all_of("n1")
        wait_until("Slurm gives the node up", lambda: self.cluster.states()["n1"].startswith("down"))
        self.cluster.start_node("n1")
        wait_until("it is started again", self.farm.answers, 240)
        self.assertGreater(self.farm.done(job), 0.1, "what was rendered is there")
        self.expect_quiet_film(job, 3, 1500)

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_a_worker_whose_time_is_up_returns_the_units_it_had_not_begun(self):
        self.farm.start_workers(1)
        stays = self.farm.workers()
        self.farm.start_workers(1, "--time=2")  # Slurm signals it one to two minutes before
        leaves = set(self.farm.workers()) - set(stays)
        job = self.farm.submit(8, 4000)
        wait_until("the worker whose time is up leaves", lambda: len(self.slurm_jobs()) == 1, 180)
        self.expect_drained(leaves)
        self.assertEqual(self.farm.show(job)["counters"]["leases_lost"], 0)
        self.expect_quiet_film(job, 8, 4000)
        self.assertEqual(self.farm.workers(), stays)

    def set_coordinators_time(self, minutes):
        self.cluster.call("scontrol", "update", f"JobId={self.coordinator}", f"TimeLimit={minutes}")

    def coordinators_restarts(self):
        return self.cluster.jobs(COORDINATOR)[0][3]

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_a_coordinator_whose_time_is_up_comes_back(self):
        self.farm.start_workers(2)
        workers = sorted(self.farm.workers())
        job = self.farm.submit(10, 4000)
        self.farm.wait_for(job, 0.05)
        before = self.coordinators_restarts()
        shown = self.cluster.call("scontrol", "show", "job", self.coordinator)
        hours, minutes = map(int, re.search(r"RunTime=(\d+):(\d+):", shown).groups())
        self.addCleanup(self.set_coordinators_time, "UNLIMITED")
        self.set_coordinators_time(60 * hours + minutes + 2)
        wait_until("it is queued again", lambda: self.coordinators_restarts() == before + 1, 180)
        self.set_coordinators_time("UNLIMITED")
        wait_until("it is started again", self.farm.answers, 180)
        self.assertIn("the time limit is reached: the job is requeued", self.farm.coordinator_log(self.coordinator))
        self.expect_quiet_film(job, 10, 4000)
        self.assertEqual(sorted(self.farm.workers()), workers)

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_the_standby_coordinator_takes_over(self):
        store = start_postgres(self.cluster)
        pair = Farm(self.cluster, "pair", ["n2", "n3"])
        first = pair.start_coordinator("n2", "--store", store)
        wait_until("the first one answers", pair.answers)
        second = pair.start_coordinator("n3", "--store", store)
        self.addCleanup(self.cluster.call, "scancel", first, second)
        wait_until("the second one is on standby", lambda: "on standby" in pair.coordinator_log(second))
        pair.let_workers_enrol(1)
        pair.start_workers(1, "--nodelist=n4")
        job = pair.submit(9, 1500)
        pair.wait_for(job, 0.1)
        self.cluster.kill_all_of("n2")
        wait_until("the second one takes over", pair.answers)
        before = pair.done(job)
        self.assertGreater(before, 0.05, "what was rendered is there")
        wait_until("the worker has found it", lambda: pair.done(job) > before)
        self.expect_quiet_film(job, 9, 1500, pair)
        self.cluster.start_node("n2")
        wait_until("the first one is started again, and is on standby", lambda: "on standby" in pair.coordinator_log(first), 180)
        self.cluster.call("scancel", second)  # it says that it ends, and the standby takes over at once
        wait_until("the first one is at work again", pair.answers)
        self.assertTrue(pair.coordinator_log(second).rstrip().endswith("stopped"), pair.coordinator_log(second))
        third = pair.start_coordinator("n3", "--store", store)
        self.addCleanup(self.cluster.call, "scancel", third)
        files = pair.folder / "coordinators"
        wait_until("those of ended jobs have no address",
                   lambda: {file.name for file in files.iterdir()} == {first, third})
        self.cancel_workers(pair)

    def start_autoscale(self, log, *options):
        """It asks the coordinator through a script, which notes each time in `asked`."""
        self.asked, script = self.folder / "asked", self.folder / "ask"
        self.asked.write_text("")
        script.write_text(f'#!/bin/sh\necho >>{self.asked}\nexec {BIN}/lightmill "$@"\n')
        script.chmod(0o755)
        scaler = self.cluster.spawn(CONTROLLER, SLURM / "autoscale", "--interval", "0.5", "--scale-down-delay", "4", "--lightmill", script,
                                    *options, SLURM / "worker.sbatch", "--cpus-per-task=1", output=log,
                                    environment=self.farm.environment)
        self.addCleanup(scaler.kill)
        return scaler

    def end_autoscale(self, scaler, log):
        scaler.send_signal(signal.SIGTERM)
        self.assertEqual(scaler.wait(TIMEOUT_S), 0, log.read_text())
        self.assertIn("ends. Workers left running", log.read_text())

    @unittest.skipUnless(FULL, "takes minutes: --full")
    def test_as_many_workers_run_as_are_wanted(self):
        log = self.folder / "autoscale.log"
        self.addCleanup(lambda: print(log.read_text()))  # shown if the test fails
        scaler = self.start_autoscale(log, "--max", "3")
        wait_until("it has acted a few times", lambda: len(self.asked.read_text()) > 3)
        self.assertEqual(self.slurm_jobs(), [], "nothing is wanted")
        small, long = self.farm.submit(4, 300), self.farm.submit(5, 24000)
        wait_until("the most that it may start", lambda: len(self.farm.workers()) == 3)
        self.assertEqual(len(self.slurm_jobs()), 3)
        # Each worker that could render counts as wanted. So fewer are wanted during a job only if the maximum is lower.
        self.end_autoscale(scaler, log)
        before = self.farm.workers()
        scaler = self.start_autoscale(log, "--max", "1")
        wait_until("two of them leave", lambda: len(self.slurm_jobs()) == 1)
        shown = self.farm.show(long)
        self.assertEqual((shown["state"], shown["counters"]["leases_lost"]), ("running", 0))
        [left] = self.farm.workers()
        self.expect_drained(set(before) - {left})
        self.expect_quiet_film(small, 4, 300)
        self.expect_quiet_film(long, 5, 24000)
        wait_until("none is wanted any more", lambda: not self.slurm_jobs() and not self.farm.workers())
        more = self.farm.submit(6, 300)
        wait_until("one comes", self.slurm_jobs)
        self.expect_quiet_film(more, 6, 300)
        self.end_autoscale(scaler, log)
        self.assertNotIn("cannot scale now: ", log.read_text())
        self.assertNotIn("ended within a minute", log.read_text())


def interrupt(*_):
    raise KeyboardInterrupt  # the only exception that ends a test run


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, interrupt)
    missing = [program for program in ("slurmctld", "slurmd", "sbatch", "munged") if not shutil.which(program)]
    if missing or os.geteuid() != 0:
        print("skipped:", f"without {', '.join(missing)}; deploy/setup --tests installs Slurm" if missing else "this is not root")
        sys.exit(SKIPPED)
    sys.exit(0 if unittest.main(exit=False, verbosity=2).result.wasSuccessful() else 1)
