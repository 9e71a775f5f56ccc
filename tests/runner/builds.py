"""Configures and builds, and lists the contents of a build folder."""
import dataclasses
import json
import os
import pathlib
import re
import time

from process import BUILD, ROOT, Failed, compilers, output_of, run_logged, show_end_of, show_progress


@dataclasses.dataclass(frozen=True)
class Run:
    """One entry of ctest: a test program, a shard of one, or a script."""
    name: str
    labels: tuple
    files: tuple  # targets of ninja that it needs
    environment: dict
    timeout: float  # seconds

    @property
    def report(self):
        """The file with the tests that it ran. None for a script."""
        output = self.environment.get("GTEST_OUTPUT")
        return output and pathlib.Path(output.removeprefix("xml:"))


def configure(preset):
    """Updates the build folder from its CMake files and CMakePresets.json. A copy of a checkout's build folder starts again."""
    folder = BUILD / preset
    used, now = folder / "used_presets", f"{ROOT}\n{(ROOT / 'CMakePresets.json').read_text()}"
    command = ["ninja", "-C", f"build/{preset}", "build.ninja"]
    if not used.exists() or used.read_text() != now:
        (folder / "CMakeCache.txt").unlink(missing_ok=True)
        command = ["cmake", "--preset", preset]
    log = folder / "configure.log"
    show_progress(f"configuring {preset}")
    if run_logged(command, log) != 0:
        show_end_of(log)
        print(f"{' '.join(command)} failed: {log.relative_to(ROOT)}")
        raise Failed
    used.write_text(now)


class Steps:
    """Ninja's steps so far, and how long the others may take."""

    def __init__(self):
        self.begun = time.monotonic()

    def __call__(self, line):
        match = re.match(r"\[([1-9]\d*)/(\d+)\] ", line)
        if not match:
            return None
        done, steps = map(int, match.groups())
        minutes = (time.monotonic() - self.begun) / done * (steps - done) / 60
        return f"built {done} of {steps} steps, about {minutes:.0f} min left"


def build(preset, targets, log, deadline=None):
    """Returns False if the deadline came first."""
    configure(preset)
    code = 0
    if targets:  # without targets ninja would build everything
        code = run_logged(["ninja", "-j", str(compilers()), "-C", f"build/{preset}", *targets], log, r"^FAILED|error:", Steps(), deadline)
    if code:
        show_end_of(log)
        print(f"the build failed: {log.relative_to(ROOT)}")
        raise Failed
    return code == 0


def runs_of(preset):
    configure(preset)
    listed = output_of(["ctest", "--test-dir", f"build/{preset}", "--show-only=json-v1"])
    runs = []
    for test in json.loads(listed)["tests"]:
        properties = {each["name"]: each["value"] for each in test.get("properties", [])}
        runs.append(Run(test["name"], tuple(properties.get("LABELS", [])),
                        tuple(os.path.relpath(file, BUILD / preset) for file in properties.get("REQUIRED_FILES", [])),
                        dict(each.split("=", 1) for each in properties.get("ENVIRONMENT", [])),
                        properties.get("TIMEOUT", 600)))
    return runs


def files_of(runs):
    return sorted({file for run in runs for file in run.files})


def programs_of(preset):
    """Each test program with its source files."""
    lines = (BUILD / preset / "test_programs.txt").read_text().splitlines()
    return {words[0]: words[1:] for words in (line.split("\t") for line in lines)}
