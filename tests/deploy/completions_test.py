#!/usr/bin/env python3
"""Compares the offers of the built shell completions with the output of --help.

  completions_test.py BUILD-FOLDER
"""
import os
import pathlib
import pty
import re
import select
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import help_text
from waiting import TIMEOUT_S

BUILD = pathlib.Path(sys.argv.pop(1)).absolute()
BIN = BUILD / "bin"
SHARE = BUILD / "share"

PROMPT = "@@@ "
CLEAR, CLEARED = "\x15echo do''ne\n", f"done.*{PROMPT}"  # discards the typed line

BASH_QUESTIONS = r"""
source "$1"
shift
complete -p "$1" >/dev/null || exit 1
compopt() { :; }
ask() {
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  COMPREPLY=()
  "_$1"
  printf '%s\n' "${COMPREPLY[@]}" ==
}
"""


def all_bash_offers(questions, folder=None):
    """Offers of one bash for the last word of each question about a program: a list of sets."""
    script = SHARE / "bash-completion" / "completions" / questions[0][0]
    asks = "".join(f"ask {shlex.join(words)}\n" for words in questions)
    run = subprocess.run(["bash", "--norc", "-c", BASH_QUESTIONS + asks, "bash", script, questions[0][0]], capture_output=True, text=True,
                         check=True, timeout=TIMEOUT_S, cwd=folder)
    assert run.stderr == "", run.stderr
    return [{line for line in part.splitlines() if line} for part in run.stdout.split("==\n")[:-1]]


def bash_offers(words, folder=None):
    [offers] = all_bash_offers([words], folder)
    return offers


def fish_offers(lines, folder=None):
    """Offers of fish at the end of each line: a list of sets."""
    script = SHARE / "fish" / "vendor_completions.d" / f"{lines[0].split()[0]}.fish"
    asks = "".join(f"echo '=='; complete -C '{line}'\n" for line in lines)
    with tempfile.TemporaryDirectory() as home:
        run = subprocess.run(["fish", "--no-config", "-c", f"source {script}\n{asks}"], capture_output=True, text=True, check=True,
                             timeout=TIMEOUT_S, cwd=folder or home, env={**os.environ, "HOME": home})
    assert run.stderr == "", run.stderr
    return [{offer.split("\t")[0] for offer in part.splitlines() if offer} for part in run.stdout.split("==\n")[1:]]


class Zsh:
    """A zsh in its own terminal, with only these completions and zsh's own."""

    def __enter__(self):
        self.home = tempfile.TemporaryDirectory()
        pid, self.terminal = pty.fork()
        if pid == 0:
            os.chdir(self.home.name)
            os.execvpe("zsh", ["zsh", "-f"], {"HOME": self.home.name, "PATH": f"{BIN}:/usr/bin:/bin", "TERM": "dumb"})
        self.pid = pid
        self.ask(f"fpath=({SHARE}/zsh/vendor-completions $fpath); autoload -Uz compinit; compinit -u; PS1='@''@@ '; unsetopt zle_bracketed_paste; "
                 "setopt no_list_beep; LISTMAX=9999; COLUMNS=300; LINES=500\n", PROMPT)
        return self

    def __exit__(self, *_):
        os.close(self.terminal)
        os.waitpid(self.pid, 0)
        self.home.cleanup()

    def ask(self, keys, until, timeout=TIMEOUT_S):
        """Types keys, and returns the terminal's output up to a match. After a command, wait for the prompt: before it the
        terminal would take ^D and ^U itself."""
        os.write(self.terminal, keys.encode())
        shown, end = "", time.monotonic() + timeout
        while not re.search(until, shown, re.DOTALL):
            left = end - time.monotonic()
            if left <= 0 or not select.select([self.terminal], [], [], left)[0]:
                raise AssertionError(f"no {until!r} in what zsh shows for {keys!r}:\n{shown}")
            shown += os.read(self.terminal, 65536).decode(errors="replace")
        return shown


class Completions(unittest.TestCase):
    def test_bash_offers_what_help_lists(self):
        for program in help_text.PROGRAMS:
            all_commands = list(help_text.all_commands(BIN, [program]))
            offers = iter(all_bash_offers([[*words, end] for words, _, _ in all_commands for end in ("-", "")]))
            for words, options, commands in all_commands:
                with self.subTest(words=words):
                    self.assertEqual(next(offers), options)
                    named = next(offers)
                    if commands:
                        self.assertEqual(named, set(commands))

    def test_bash_completes_words_values_and_files(self):
        self.assertEqual(bash_offers(["lightmill", "sub"]), {"submit"})
        self.assertEqual(bash_offers(["lightmill", "render", "--view", "f"]), {"filmic"})
        self.assertEqual(bash_offers(["lightmill", "render", "--view", "=", "f"]), {"filmic"})
        self.assertEqual(bash_offers(["lightmill", "jobs", "--server", ""]), set())
        with tempfile.TemporaryDirectory() as folder:
            for name in ("scene one.json", "other"):
                (pathlib.Path(folder) / name).touch()
            (pathlib.Path(folder) / "scenes").mkdir()
            self.assertEqual(bash_offers(["lightmill", "render", "sc"], folder), {"scene one.json", "scenes"})
            self.assertEqual(bash_offers(["lightmill-server", "--data", ""], folder), {"scenes"})
            self.assertEqual(bash_offers(["lightmill", "cancel", ""], folder), set(), "a job's number is no file")

    def test_bash_takes_no_value_for_a_command(self):
        self.assertEqual(bash_offers(["lightmill", "workers", "--server", "drain", "qu"]), {"quarantine"})

    def test_bash_completes_after_an_omitted_value(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "film.exr").touch()
            self.assertEqual(bash_offers(["lightmill", "watch", "--tev", "-o", "f"], folder), {"film.exr"})
            self.assertEqual(bash_offers(["lightmill", "watch", "--tev", "farm:1", "-o", "f"], folder), {"film.exr"})
            self.assertIn("--openjd", bash_offers(["lightmill", "watch", "--tev", "--o"]))
            self.assertEqual(bash_offers(["lightmill", "watch", "--tev", ""], folder), set())

    @unittest.skipUnless(shutil.which("fish"), "no fish")
    def test_fish_offers_what_help_lists(self):
        for program in help_text.PROGRAMS:
            all_commands = list(help_text.all_commands(BIN, [program]))
            lines = [f"{' '.join(words)} {end}" for words, _, _ in all_commands for end in ("-", "--", "")]
            offers = iter(fish_offers(lines))
            for words, options, commands in all_commands:
                with self.subTest(words=words):
                    offered = {name for name in next(offers) | next(offers) if re.fullmatch(r"-\w|--[\w-]+", name)}
                    self.assertEqual(offered, options)
                    named = next(offers)
                    if commands:
                        self.assertEqual(named, set(commands))

    @unittest.skipUnless(shutil.which("fish"), "no fish")
    def test_fish_completes_values_and_takes_none_for_a_command(self):
        values, quarantine = fish_offers(["lightmill render --view ", "lightmill workers --server drain qu"])
        self.assertEqual(values, {"plain", "filmic"})
        self.assertEqual(quarantine, {"quarantine"})

    @unittest.skipUnless(shutil.which("fish"), "no fish")
    def test_fish_completes_after_an_omitted_value(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "film.exr").touch()
            files, options = fish_offers(["lightmill watch --tev -o f", "lightmill watch --tev --open"], folder)
        self.assertEqual(files, {"film.exr"})
        self.assertEqual(options, {"--openjd"})

    @unittest.skipUnless(shutil.which("zsh"), "no zsh")
    def test_zsh_completes_after_an_omitted_value(self):
        with Zsh() as zsh:
            (pathlib.Path(zsh.home.name) / "film.exr").touch()
            for value in ("", "farm:1 "):
                self.assertIn("film.exr", zsh.ask(f"lightmill watch --tev {value}-o fi\t", r"film\.exr"))
                zsh.ask(CLEAR, CLEARED)

    @unittest.skipUnless(shutil.which("zsh"), "no zsh")
    def test_zsh_offers_what_help_lists(self):
        with Zsh() as zsh:
            self.assertIn("submit", zsh.ask("lightmill sub\t", "lightmill submit"))
            zsh.ask(CLEAR, CLEARED)
            for program in help_text.PROGRAMS:
                for words, options, commands in help_text.all_commands(BIN, [program]):
                    with self.subTest(words=words):
                        # ^D lists without inserting anything.
                        shown = zsh.ask(f"{' '.join(words)} -\x04", "--help") + zsh.ask(CLEAR, CLEARED)
                        self.assertEqual({name for name in options if not re.search(rf"(?<![\w-]){name}(?![\w-])", shown)}, set())
                        if commands:
                            shown = zsh.ask(f"{' '.join(words)} \x04", commands[0]) + zsh.ask(CLEAR, CLEARED)
                            self.assertEqual({name for name in commands if not re.search(rf"(?m)^{name}\s", shown)}, set())

    @unittest.skipUnless(shutil.which("shellcheck"), "no shellcheck")
    def test_bash_scripts_are_in_order(self):
        scripts = [SHARE / "bash-completion" / "completions" / program for program in help_text.PROGRAMS]
        run = subprocess.run(["shellcheck", *scripts], capture_output=True, text=True, check=False)
        self.assertEqual(run.stdout, "")


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=2).result
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped else 0)  # 77: this machine lacks something
