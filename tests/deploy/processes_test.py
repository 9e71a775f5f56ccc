#!/usr/bin/env python3
"""Crashes of a test's programs fail the test, and ends that the test causes do not."""
import pathlib
import re
import signal
import sys
import tempfile
import unittest

from waiting import wait_until
from processes import FAULTS_OF_PROGRAMS, BackgroundProgram


class Crashes(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def shell(self, commands):
        program = BackgroundProgram(["sh", "-c", commands], self.folder / "log")
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        return program

    def ended(self, commands):
        program = self.shell(commands)
        wait_until("it ends", lambda: program.poll() is not None)
        return program

    def test_a_signal_that_the_test_did_not_send_fails_it(self):
        self.assertRaisesRegex(AssertionError, "ended with -11", self.ended("kill -SEGV $$").end)

    def test_an_exit_code_fails_the_test(self):
        self.assertRaisesRegex(AssertionError, "ended with 3", self.ended("exit 3").end)

    def test_a_fault_in_the_log_fails_the_test(self):
        self.assertRaisesRegex(AssertionError, "check failed: samples > 0",
                               self.ended("echo 'film.cpp:7: check failed: samples > 0'").end)

    def test_tests_in_all_languages_know_the_same_faults(self):
        tests = pathlib.Path(__file__).parents[1]
        for file, declaration in ((tests / "support/process.cpp", "std::array kFaults{"), (tests / "e2e/farm.mjs", "const kFaults = [")):
            words = file.read_text().partition(declaration)[2].partition(";")[0]
            self.assertEqual(tuple(re.findall(r"[\"']([^\"']+)[\"']", words)), FAULTS_OF_PROGRAMS, file)

    def test_ends_that_the_test_causes_are_no_crashes(self):
        self.ended("exit 0").end()
        for sent in (signal.SIGTERM, signal.SIGKILL):
            self.shell("exec sleep 1000").end(sent)


if __name__ == "__main__":
    sys.exit(0 if unittest.main(exit=False, verbosity=2).result.wasSuccessful() else 1)
