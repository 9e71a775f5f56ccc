#!/usr/bin/env python3
"""Checks how completions, manual pages and the reference show each kind of entry of a program.

  describe_test.py SOURCE-FOLDER
"""
import dataclasses
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(sys.argv.pop(1)) / "deploy/describe"))

import commands  # noqa: E402
import man  # noqa: E402
import markdown  # noqa: E402
import zsh  # noqa: E402


def option(*names, value="", text="", **more):
    fields = {"default": "", "variable": "", "group": "Options", "required": False, "repeats": False, "value_optional": False}
    return commands.Option(names=names, value=value, text=text, **{**fields, **more})


def command(words, about, options=(), below=(), **more):
    fields = {"footer": "", "usage": f"Usage: {words} [OPTIONS]", "positions": (), "needs_command": False}
    return commands.Command(words=words, about=about, options=tuple(options), commands=tuple(below), **{**fields, **more})


HELP = option("-h", "--help", text="print this help")
COLOUR = option("--color", value="red|dark-blue", text="its colour", variable="MILL_COLOR")
GRAIN = option("GRAIN", value="FILE", text="what's ground", required=True)
MILL = option("--mill", value="HOST:PORT", text="where (without a value: here)", value_optional=True)
TIMES = option("-n", "--times", value="INT", text="how often: [1:9]", repeats=True)


def mill(about="Make it fine.", **more):
    """A program with one of each kind of entry."""
    grind = command("mill grind", about, [HELP, MILL, TIMES, COLOUR], positions=(GRAIN,))
    return command("mill", "Grinds things. Finely.", [HELP, COLOUR], [grind, *more.pop("others", ())], **more)


class Describe(unittest.TestCase):
    def test_values_name_what_completes_them(self):
        for value, choices in {"FILE|NAME": "file", "DIR": "folder", "plain|filmic": ["plain", "filmic"], "HOST:PORT": None, "N": None, "A|B": None,
                               "word": None, "": None}.items():
            self.assertEqual(option("--x", value=value).choices, choices, value)

    def test_an_optional_value_is_in_brackets(self):
        self.assertEqual(MILL.shown_value, "[HOST:PORT]")
        self.assertIn("\\fB\\-\\-mill\\fR \\fI[HOST:PORT]\\fR\nwhere (without a value: here)\n", man.page_of(mill(), "1.0", ""))
        self.assertIn("'(--mill)'--mill='[where (without a value\\: here)]::HOST\\:PORT: '", zsh.page(mill()))

    def test_manual_pages_escape_troff(self):
        page = man.page_of(mill(".start\n\n  kept -as\n  lines\n\nafter \\ `it's` and `"), "1.0", "2026-11-23")
        self.assertIn('.TH MILL 1 "2026-11-23" "Lightmill 1.0"', page)
        self.assertIn("\nmill \\- Grinds things\n", page)
        self.assertIn("\n\\&.start\n.PP\n.nf\n  kept \\-as\n  lines\n.fi\n.PP\nafter \\e \\fBit\\(aqs\\fR and \\(ga\n", page)
        self.assertIn(".SH ENVIRONMENT\n.TP\n\\fBMILL_COLOR\\fR\nas \\fB\\-\\-color\\fR\n", page)

    def test_markdown_has_a_table_for_each_group(self):
        red = dataclasses.replace(COLOUR, text="its colour, such as <red> or *blue*", required=True)
        grind = command("mill grind", "Make it fine.", [TIMES, dataclasses.replace(MILL, group="Access")], positions=(GRAIN,))
        page = markdown.page(command("mill", "Grinds.", [red], [grind], footer="Two lines\nof text.\n\n  mill grind wheat\n"))
        self.assertIn("## mill\n\nGrinds.\n\n```text\nUsage: mill [OPTIONS]\n```\n", page)
        self.assertIn("| `--color red\\|dark-blue` | its colour, such as \\<red> or \\*blue\\* (must be given); or `$MILL_COLOR` |\n", page)
        self.assertIn("Two lines of text.\n\n```text\nmill grind wheat\n```\n", page)
        self.assertIn("### mill grind\n\nMake it fine.\n", page)
        self.assertIn("| Argument | |\n| --- | --- |\n| `GRAIN` | what's ground |\n", page)
        self.assertIn("| Options | |\n| --- | --- |\n| `-n, --times INT...` | how often: [1:9] |\n\n| Access | |\n", page)

    def test_an_option_of_three_commands_is_described_once(self):
        field = option("--field", value="N", text="the field")
        page = markdown.page(mill(others=[command(f"mill {name}", "Work.", [HELP, field]) for name in ("sow", "reap", "thresh")]))
        row = "| `--field N` | the field |\n"
        self.assertEqual(page.count(row), 1)
        self.assertGreater(page.find(row), page.find("### Options of several commands\n"))
        self.assertIn("### mill sow\n\nWork.\n\n```text\nUsage: mill sow [OPTIONS]\n```\n\n[Also](#options-of-several-commands): `--help`, `--field`.\n", page)

    def test_zsh_text_is_quoted(self):
        script = zsh.page(mill())
        self.assertIn("'*'{-n+,--times=}'[how often\\: \\[1\\:9\\]]:", script)
        self.assertIn("':GRAIN:_files'", script)
        self.assertIn("'(--color)'--color='[its colour]:red|dark-blue:(red dark-blue)'", script)


if __name__ == "__main__":
    unittest.main()
