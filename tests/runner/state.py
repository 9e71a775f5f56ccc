"""Results that are kept between calls. A change of the sources starts a new record."""
import hashlib
import json
import os
import subprocess

from process import ROOT, Failed, fail_to_run


def git(*arguments):
    try:
        said = subprocess.run(["git", *arguments], cwd=ROOT, check=False, capture_output=True)
    except OSError as error:
        fail_to_run(["git"], error)
    if said.returncode != 0:
        print(f"git {' '.join(arguments)}: {said.stderr.decode(errors='replace').strip()}\n"
              "--all, --repeat and --status need a git checkout, because they remember results by it. Names of tests do not.")
        raise Failed
    return said.stdout


def sources_id():
    """Names the current sources, uncommitted changes included."""
    digest = hashlib.sha256(git("rev-parse", "HEAD^{tree}") + git("diff", "--no-ext-diff", "--no-textconv", "--no-color", "--binary", "HEAD"))
    for name in git("ls-files", "--others", "--exclude-standard", "-z").split(b"\0"):
        file = ROOT / os.fsdecode(name)
        if name and file.is_file():
            digest.update(name + file.read_bytes())
    return digest.hexdigest()


class State:
    """`done` has the finished runs with their results. It is kept in a file for the sources that it was read for."""

    def __init__(self, path):
        self.path, self.sources = path, sources_id()
        try:
            kept = json.loads(path.read_text())
        except (OSError, ValueError):
            kept = {}
        self.done = kept["done"] if kept.get("sources") == self.sources else {}

    def record(self, done):
        if sources_id() != self.sources:
            print("\nThe sources have changed since this began: it stops, and does not remember what it did last.")
            raise Failed
        self.done.update(done)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self.path.with_suffix(".new")
        temporary.write_text(json.dumps({"sources": self.sources, "done": self.done}, indent=1))
        temporary.replace(self.path)
