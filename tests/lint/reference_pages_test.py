#!/usr/bin/env python3
"""Checks that reference_pages.py finds stale pages, and mends them.

  reference_pages_test.py ROOT PROGRAMS
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAMS = pathlib.Path(sys.argv.pop()).absolute()
ROOT = pathlib.Path(sys.argv.pop()).absolute()
SCRIPT = pathlib.Path(__file__).parent / "reference_pages.py"


class ReferencePages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lightmill-reference-")
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for part in ("docs/reference", "client/web/public"):
            shutil.copytree(ROOT / part, self.root / part)

    def run_script(self, *options):
        run = subprocess.run([sys.executable, "-B", SCRIPT, self.root, PROGRAMS, *options], capture_output=True, text=True)
        return run.returncode, run.stdout + run.stderr

    def test_a_stale_page_fails_until_it_is_written_again(self):
        pages = {name: self.root / "docs/reference" / name for name in ("command-line.md", "metrics.md", "http-api.md", "methods.md", "exr.md")}
        for line, page in (("| `--spp N` |", pages["command-line.md"]), ("| `lightmill_storing` |", pages["metrics.md"]),
                           ("| GET `/api/v1/jobs/{id}` |", pages["http-api.md"]), ("| `vcm` |", pages["methods.md"]),
                           ("| `albedo` |", pages["exr.md"])):
            text = page.read_text()
            self.assertIn(line, text)
            page.write_text(text.replace(line, line.replace("` |", "s` |")))
        code, output = self.run_script()
        self.assertEqual(code, 1, output)
        for name in pages:
            self.assertIn(f"docs/reference/{name}", output)
        self.assertIn("tests/lint/reference_pages.py . build/release/bin --write", output)
        self.assertEqual(self.run_script("--write")[0], 0)
        self.assertEqual(self.run_script()[0], 0)

    def test_a_page_without_its_part_fails(self):
        page = self.root / "docs/reference/metrics.md"
        page.write_text(page.read_text().replace("<!-- end -->", ""))
        code, output = self.run_script()
        self.assertNotEqual(code, 0, output)
        self.assertIn("metrics.md has no part `metrics`", output)


if __name__ == "__main__":
    unittest.main()
