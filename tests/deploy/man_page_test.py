#!/usr/bin/env python3
"""Checks the built manual pages: they name everything that --help lists, and formatters find no fault.

  man_page_test.py SOURCE-FOLDER BUILD-FOLDER
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

import help_text

SOURCES = pathlib.Path(sys.argv.pop(1)).absolute()
BUILD = pathlib.Path(sys.argv.pop(1)).absolute()
BIN = BUILD / "bin"


def page_path(program):
    return BUILD / "share" / "man" / "man1" / f"{program}.1"


def sections_of(program):
    """{title: text} of sections and subsections, without troff's markup."""
    text = re.sub(r"\\f[BIR]|\\&", "", page_path(program).read_text()).replace("\\-", "-")
    parts = re.split(r"(?m)^\.S[HS] (.*)$", text)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


class ManPages(unittest.TestCase):
    def test_name_every_command_and_option(self):
        for program in help_text.PROGRAMS:
            sections = sections_of(program)
            # The program's own options are in a section and its groups, before COMMANDS.
            titles = list(sections)
            own = "".join(sections[title] for title in titles[:titles.index("COMMANDS")] if title) if "COMMANDS" in titles \
                else "".join(sections.values())
            for words, options, _ in help_text.all_commands(BIN, [program]):
                text = own if len(words) == 1 else sections[" ".join(words[1:])] + own
                with self.subTest(words=words):
                    self.assertEqual({name for name in options if not re.search(rf"(?<![\w-]){name}(?![\w-])", text)} - {"-h"}, set())

    def test_a_later_section_describes_shared_options(self):
        sections = sections_of("lightmill")
        titles = list(sections)
        shared = "".join(sections[title] for title in titles[titles.index("OPTIONS OF SEVERAL COMMANDS"):])
        for text in sections.values():
            for also in re.findall(r"Described below: (.*)\.$", text, re.MULTILINE):
                for name in also.split(", "):
                    self.assertRegex(shared, rf"(?m)^\.TP\n(-\w, )?{name}( |$)")

    @unittest.skipUnless(shutil.which("mandoc"), "no mandoc")
    def test_mandoc_finds_nothing(self):
        for program in help_text.PROGRAMS:
            # The build has no date, so that it is the same every day. Packages have dates.
            page = subprocess.run([sys.executable, "-B", SOURCES / "deploy/describe", BIN / program, "man"],
                                  env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}, capture_output=True, check=True).stdout
            self.assertIn(b' 1 "2023-11-14" "Lightmill ', page)
            run = subprocess.run(["mandoc", "-Tlint", "-Wwarning"], input=page, capture_output=True, check=False)
            self.assertEqual((run.returncode, run.stdout, run.stderr), (0, b"", b""))

    @unittest.skipUnless(shutil.which("groff"), "no groff")
    def test_groff_finds_nothing(self):
        for program in help_text.PROGRAMS:
            run = subprocess.run(["groff", "-ww", "-man", "-Kutf8", "-Tutf8", "-z", page_path(program)], capture_output=True, check=True)
            self.assertEqual(run.stderr, b"")


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=2).result
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped else 0)  # 77: this machine lacks something
