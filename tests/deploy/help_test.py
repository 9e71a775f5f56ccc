#!/usr/bin/env python3
"""Checks that no line of --help and of `lightmill help` is wider than its terminal.

  help_test.py PROGRAMS
"""
import fcntl
import os
import pathlib
import pty
import re
import struct
import subprocess
import sys
import termios
import unittest

import help_text

BIN = pathlib.Path(sys.argv.pop(1)).absolute()


def printed(columns, program, *words, code=0):
    """What the command prints on a terminal that is so wide."""
    terminal, end = pty.openpty()
    fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    with subprocess.Popen([BIN / program, *words], stdin=subprocess.DEVNULL, stdout=end, stderr=end, env={**os.environ, "NO_COLOR": "1"}) as run:
        os.close(end)
        output = b""
        try:
            while part := os.read(terminal, 65536):
                output += part
        except OSError:  # the program has closed its end
            pass
        os.close(terminal)
    assert run.returncode == code, output
    return output.decode().splitlines()


class Help(unittest.TestCase):
    def assert_fits(self, *command):
        for columns in (60, 80, 140):
            with self.subTest(command=command, columns=columns):
                lines = printed(columns, *command)
                self.assertGreater(len(lines), 3)
                self.assertEqual([line for line in lines if len(line) > columns], [])

    def test_every_command_fits(self):
        for program in help_text.PROGRAMS:
            for words, _, _ in help_text.all_commands(BIN, [program]):
                self.assert_fits(*words, "--help")

    def test_every_topic_fits(self):
        topics = re.findall(r"^  ([a-z-]+)  ", "\n".join(help_text.help_of(BIN, ["lightmill", "help"])).split("a topic:")[1], re.MULTILINE)
        self.assertGreater(len(topics), 5)
        for topic in topics:
            self.assert_fits("lightmill", "help", topic)

    def test_every_command_ends_with_an_example(self):
        for program in help_text.PROGRAMS:
            for words, _, _ in help_text.all_commands(BIN, [program]):
                with self.subTest(command=words):
                    self.assertRegex(printed(100, *words, "--help")[-1], f"^  {' '.join(words)}\\b")

    def test_messages_break_between_words(self):
        wide, narrow = (printed(columns, "lightmill", "render", "box.json", "--size", "0x0", code=2) for columns in (200, 60))
        self.assertGreater(len(wide[0]), 60)
        self.assertEqual([line for line in narrow if len(line) > 60], [])
        self.assertEqual(" ".join(narrow), " ".join(wide))


if __name__ == "__main__":
    unittest.main()
