#!/usr/bin/env python3
"""Reads the metrics of a real coordinator with Prometheus' own library, and checks that the dashboard and the alerts use
existing metrics.

  metrics_test.py SOURCE-FOLDER BUILD-FOLDER
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import urllib.request

import yaml
from prometheus_client.parser import text_string_to_metric_families

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from waiting import TIMEOUT_S, wait_until
from processes import BackgroundProgram

BUILD = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
BIN = BUILD / "bin"
ALERTS = SOURCE / "deploy" / "prometheus" / "alerts.yml"
DASHBOARD = SOURCE / "deploy" / "grafana" / "lightmill.json"
SIDE, SAMPLES = 64, 96
TILE_BYTES = SIDE * SIDE * 6 * 4  # a node of one tile: two sums of three floats a pixel


def expressions():
    """All expressions of the alerts and the dashboard, by their place."""
    found = {rule["alert"]: rule["expr"] for group in yaml.safe_load(ALERTS.read_text())["groups"] for rule in group["rules"]}
    for panel in json.loads(DASHBOARD.read_text())["panels"]:
        for target in panel["targets"]:
            found[f"{panel['title']}, {target['refId']}"] = target["expr"]
    return found


class MetricsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-metrics-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        port, page = cls.folder / "port", cls.folder / "http-port"
        cls.start("lightmill-server", "--data", cls.folder / "data", "--listen", "127.0.0.1:0", "--port-file", port, "--http",
                  "127.0.0.1:0", "--http-port-file", page)
        wait_until("the coordinator listens", lambda: port.exists() and page.exists())
        cls.server = f"127.0.0.1:{port.read_text().strip()}"
        cls.address = f"http://127.0.0.1:{page.read_text().strip()}"
        cls.before = cls.read()
        cls.start("lightmill-worker", "--server", cls.server, "--threads", "1")
        submitted = cls.lightmill("render", SOURCE / "scenes" / "cornell-bench-blocks.json", "--size", f"{SIDE}x{SIDE}", "--spp",
                                  SAMPLES, "--method", "path", "-o", cls.folder / "a.exr")
        cls.job = cls.lightmill("show", submitted["id"])
        cls.after = cls.read()

    @classmethod
    def start(cls, program, *arguments):
        process = BackgroundProgram([BIN / program, *arguments, "--log-level", "warn"], cls.folder / f"{program}.log")
        cls.addClassCleanup(process.end)

    @classmethod
    def lightmill(cls, *arguments):
        run = subprocess.run([BIN / "lightmill", *map(str, arguments), "--server", cls.server, "--json"], capture_output=True,
                             text=True, check=False)
        if run.returncode != 0:
            raise AssertionError(run.stdout + run.stderr)
        return json.loads(run.stdout)

    @classmethod
    def read(cls):
        """{(name, labels): value} of all samples, and the families."""
        with urllib.request.urlopen(f"{cls.address}/metrics", timeout=TIMEOUT_S) as answer:
            cls.content_type = answer.headers["Content-Type"]
            families = list(text_string_to_metric_families(answer.read().decode()))
        cls.families = families
        return {(sample.name, tuple(sorted(sample.labels.items()))): sample.value
                for family in families for sample in family.samples}

    def value(self, name, **labels):
        return self.after[name, tuple(sorted(labels.items()))]

    def test_it_is_prometheus_text(self):
        self.assertEqual(self.content_type, "text/plain; version=0.0.4; charset=utf-8")
        for family in self.families:
            self.assertIn(family.type, ("counter", "gauge", "histogram"), family.name)
            self.assertTrue(family.documentation.endswith("."), family.name)
            self.assertTrue(family.samples, family.name)
            self.assertRegex(family.name, r"^(lightmill|process)_[a-z_]+$")
            for sample in family.samples:
                self.assertNotIn("job", sample.labels, "jobs come and go: a series for each would never end")

    def test_counters_show_what_the_farm_did(self):
        self.assertEqual(self.value("lightmill_pixel_samples_total"), SIDE * SIDE * SAMPLES)
        merged = self.job["counters"]["results_merged"]
        self.assertEqual(self.value("lightmill_results_total", outcome="merged"), merged)
        self.assertGreaterEqual(self.value("lightmill_leases_granted_total"), merged, "of one tile each")
        self.assertGreaterEqual(self.value("lightmill_received_bytes_total", what="results"), merged * TILE_BYTES)
        self.assertEqual(self.value("lightmill_first_picture_seconds_count"), 1)
        took = (self.job["finished_unix_ms"] - self.job["submitted_unix_ms"]) / 1000
        self.assertTrue(0 < self.value("lightmill_first_picture_seconds_sum") <= took)
        self.assertGreaterEqual(self.value("lightmill_commit_seconds_count"), 2, "of the job, and of its end")
        self.assertGreater(self.value("lightmill_commit_seconds_sum"), 0)
        self.assertGreaterEqual(self.value("lightmill_sent_bytes_total", what="films"), TILE_BYTES, "for the file")

    def test_gauges_show_the_state_of_the_farm(self):
        for state in ("queued", "running", "paused", "failed", "cancelled"):
            self.assertEqual(self.value("lightmill_jobs", state=state), 0, state)
        self.assertEqual(self.value("lightmill_jobs", state="done"), 1)
        self.assertEqual(self.value("lightmill_workers", state="idle"), 1)
        self.assertEqual(self.value("lightmill_workers", state="rendering"), 0)
        self.assertEqual(self.value("lightmill_worker_threads"), 1)
        self.assertEqual(self.value("lightmill_wanted_workers"), 0)
        self.assertEqual(self.value("lightmill_queue_pixel_samples"), 0)
        self.assertEqual(self.value("lightmill_leases"), 0)
        self.assertEqual(self.value("lightmill_storing"), 1)
        self.assertEqual(self.before["lightmill_workers", (("state", "idle"),)], 0, "before there was one")
        self.assertGreater(self.value("process_open_fds"), 3)
        self.assertGreater(self.value("process_max_fds"), self.value("process_open_fds"))
        self.assertGreater(self.value("process_resident_memory_bytes"), 1 << 20)

    def test_counters_only_grow_and_buckets_are_cumulative(self):
        again = self.read()
        for family in self.families:
            for sample in family.samples if family.type in ("counter", "histogram") else []:
                key = sample.name, tuple(sorted(sample.labels.items()))
                self.assertGreaterEqual(again[key], self.after[key], key)
            buckets = [sample.value for sample in family.samples if sample.name.endswith("_bucket")]
            self.assertEqual(buckets, sorted(buckets), family.name)
            if buckets:
                self.assertEqual(buckets[-1], again[f"{family.name}_count", ()])

    def test_waiting_jobs_are_a_queue(self):
        job = self.lightmill("submit", SOURCE / "scenes" / "cornell-bench-blocks.json", "--size", f"{SIDE}x{SIDE}", "--spp",
                             10_000_000, "--method", "path")["id"]
        wait_until("it is rendered", lambda: self.read()["lightmill_workers", (("state", "rendering"),)] == 1)
        now = self.read()
        self.assertGreater(now["lightmill_queue_pixel_samples", ()], SIDE * SIDE * 9_000_000)
        self.assertEqual(now["lightmill_jobs", (("state", "running"),)], 1)
        self.assertGreaterEqual(now["lightmill_wanted_workers", ()], 1)
        self.assertGreaterEqual(now["lightmill_leases", ()], 1)
        self.lightmill("delete", job, "--cancel")
        wait_until("nothing waits", lambda: self.read()["lightmill_queue_pixel_samples", ()] == 0)

    def test_dashboard_and_alerts_use_existing_metrics(self):
        known = {name for name, _ in self.after}
        states = {(name, label, value) for name, labels in self.after for label, value in labels}
        for where, expression in expressions().items():
            names = re.findall(r"\b((?:lightmill|process)_[a-z_]+)", re.sub(r'"[^"]*"', '""', expression))
            self.assertTrue(names or "up{" in expression, where)
            for name in names:
                self.assertIn(name, known, where)
            for name, label, values in re.findall(r'(\w+)\{(?:instance=~"\$instance",)?(state|outcome|what)=~?"([^"]*)"', expression):
                for value in values.split("|"):
                    self.assertIn((name, label, value), states, where)

    def test_prometheus_accepts_all_expressions(self):
        self.assertTrue(shutil.which("promtool"), "promtool is in Debian's package prometheus: deploy/setup --tests")
        rules = {"groups": [{"name": "all", "rules": [
            {"record": f"panel:{i}", "expr": expression.replace("$instance", ".*").replace("$__rate_interval", "1m")}
            for i, expression in enumerate(expressions().values())]}]}
        every = self.folder / "expressions.yml"
        every.write_text(json.dumps(rules))
        for command in (["check", "rules", ALERTS, every], ["test", "rules", pathlib.Path(__file__).parent / "alerts_test.yml"]):
            run = subprocess.run(["promtool", *map(str, command)], capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        with urllib.request.urlopen(f"{self.address}/metrics", timeout=TIMEOUT_S) as answer:
            run = subprocess.run(["promtool", "check", "metrics"], input=answer.read(), capture_output=True, check=False)
        self.assertEqual(run.returncode, 0, (run.stdout + run.stderr).decode())


if __name__ == "__main__":
    sys.exit(0 if unittest.main(exit=False, verbosity=2).result.wasSuccessful() else 1)
