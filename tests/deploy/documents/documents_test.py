#!/usr/bin/env python3
"""Types the shell commands of the README, docs/guide and docs/operate, on a farm of real processes. Each must end with exit code 0.
exceptions.py names those that cannot run here. The pictures are smaller than shipped.

  documents_test.py SOURCE-FOLDER PROGRAMS
"""
import fnmatch
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import exceptions
from commands import commands
from reader import Reader

INSIDE = "LIGHTMILL_TEST_MACHINE"  # set in the namespaces of this test
SIDE = 32
PROGRAMS = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
DOCUMENTS = sorted(str(path.relative_to(SOURCE)) for pattern in ("README.md", "docs/guide/*.md", "docs/operate/*.md")
                   for path in SOURCE.glob(pattern))


def matches(entry, document, command):
    return fnmatch.fnmatchcase(document, entry[0]) and fnmatch.fnmatchcase(command, entry[1])


def word(text):
    return re.compile(rf"(?<![\w-]){re.escape(text)}(?![\w-])")


def typed(document, command):
    """The command with its placeholders replaced by the reader's values."""
    for where, text, own in exceptions.WORDS:
        if fnmatch.fnmatchcase(document, where):
            code, comment, rest = command.partition("  #")
            command = word(text).sub(lambda _: own, code) + comment + rest
    return command


def steps(document):
    """The commands that a reader of the document types, in order."""
    for command in commands((SOURCE / document).read_text()):
        if not any(matches(entry, document, command) for entry in exceptions.SKIPPED):
            for entry in exceptions.BEFORE:
                if matches(entry, document, command):
                    yield from entry[2].splitlines()
            yield typed(document, command)


def prepare(folder):
    """The files that a reader has: the shipped scenes and experiments, and a model of each kind."""
    shutil.copytree(SOURCE / "scenes", folder / "scenes", ignore=shutil.ignore_patterns("models"))
    shutil.copytree(SOURCE / "docs" / "experiments", folder / "docs" / "experiments")
    for file in folder.glob("scenes/*.json"):
        scene = json.loads(file.read_text())
        scene["film"] |= {"width": SIDE, "height": SIDE}
        file.write_text(json.dumps(scene))
    for file in folder.glob("docs/experiments/*.json"):
        file.write_text(json.dumps(json.loads(file.read_text()) | {"width": 8, "height": 8}))
    for file in folder.glob("scenes/assets/Cornell*"):
        shutil.copy(file, folder)
    guide = (SOURCE / "docs/guide/scenes.md").read_text()
    scene = json.loads(re.search(r"^```json\n(.*?)^```", guide, re.MULTILINE | re.DOTALL)[1])
    scene["film"] = {"width": SIDE, "height": SIDE}
    for name in ("scene.json", "model.json"):
        (folder / name).write_text(json.dumps(scene))
    shutil.copy(SOURCE / "scenes/assets/cube.obj", folder / "model.obj")
    shutil.copy(SOURCE / "tests/fuzz/seeds/gltf/all.glb", folder / "model.glb")


class Documents(unittest.TestCase):
    def reader(self):
        folder = tempfile.TemporaryDirectory(prefix="lightmill-reader-")
        self.addCleanup(folder.cleanup)
        prepare(pathlib.Path(folder.name))
        return Reader(pathlib.Path(folder.name), PROGRAMS)

    def test_commands_work(self):
        for document in DOCUMENTS:
            typing = list(steps(document))
            if not typing:
                continue
            with self.subTest(document):
                reader = self.reader()
                try:
                    for command in typing:
                        reader.type(command)
                    reader.stop()
                except AssertionError as failure:
                    raise self.failureException(f"{document}: {failure}") from None
                finally:
                    reader.kill()

    def test_planted_faults_are_found(self):
        for command in ("false", "lightmill certs nonsense", "lightmill-server --nonsense", "echo Unknown word", "lightmill watch 7"):
            with self.subTest(command):
                reader = self.reader()
                try:
                    self.assertRaises(AssertionError, reader.type, command)
                finally:
                    reader.kill()

    def test_every_exception_has_its_command(self):
        all_commands = [(document, command) for document in DOCUMENTS for command in commands((SOURCE / document).read_text())]
        for entry in exceptions.SKIPPED + exceptions.BEFORE:
            with self.subTest(entry=entry):
                self.assertTrue(any(matches(entry, *each) for each in all_commands), "no such command")
        for entry in exceptions.WORDS:
            with self.subTest(entry=entry):
                self.assertTrue(any(fnmatch.fnmatchcase(document, entry[0]) and word(entry[1]).search(command)
                                    for document, command in all_commands), "no such word")


def enter_machine():
    """Runs this test again with a network of its own, where each machine of the documents is this one."""
    hosts = "".join(f"127.0.0.1 {name}\n" for name in ["localhost", *exceptions.MACHINES])
    with tempfile.NamedTemporaryFile("w", suffix=".hosts") as file:
        file.write(hosts)
        file.flush()
        inside = 'ip link set lo up && mount --bind "$0" /etc/hosts && exec "$@"'
        unshare = ["unshare", "--map-root-user", "--net", "--mount", "--fork", "--kill-child"]
        if subprocess.run([*unshare, "true"], capture_output=True).returncode:
            print("no namespaces here (unshare)")
            return 77
        return subprocess.run([*unshare, "sh", "-c", inside, file.name, sys.executable, "-B", __file__, SOURCE, PROGRAMS],
                              env={**os.environ, INSIDE: "1"}).returncode


if __name__ == "__main__":
    if INSIDE in os.environ:
        unittest.main()
    sys.exit(enter_machine())
