"""Configures and builds, and lists the contents of a build folder."""
import dataclasses
import json
import os
import pathlib
import re
import shutil
import time

from process import BUILD, ROOT, Failed, compilers, doing, output_of, run_logged, show_end_of, show_progress


@dataclasses.dataclass(frozen=True)
class Run:
    """One entry of ctest: a test program, a shard of one, or a script."""
    name: str
    labels: tuple
    files: tuple  # targets of ninja that it needs
    environment: dict
    timeout: float  # seconds
    computes: bool  # takes one of the cores of tests that compute

    @property
    def report(self):
        """The file with the tests that it ran. None for a script."""
        output = self.environment.get("GTEST_OUTPUT")
        return output and pathlib.Path(output.removeprefix("xml:"))


def settings_of(folder):
    """What a build folder was configured with: its checkout, the presets, and the cached values of the variables that they set. CMake
    stores a program by its name or by its path, and changes that."""
    presets = (ROOT / "CMakePresets.json").read_text()
    names = {name for preset in json.loads(presets)["configurePresets"] for name in preset.get("cacheVariables", ())}
    cache = folder / "CMakeCache.txt"
    lines = cache.read_text().splitlines() if cache.exists() else []
    values = dict(match.groups() for line in lines if (match := re.match(r"(\w+):\w+=(.*)", line)) and match.group(1) in names)
    return "\n".join([str(ROOT), presets, *sorted(f"{name}={shutil.which(value) or value}" for name, value in values.items())])


def configure(preset):
    """Updates the build folder from its CMake files and CMakePresets.json. A copy of a checkout's build folder starts again. So does
    one whose variables were set by hand, or whose last configuration did not end."""
    folder = BUILD / preset
    used = folder / "used_settings"
    command = ["ninja", "-C", f"build/{preset}", "build.ninja"]
    if not used.exists() or used.read_text() != settings_of(folder) or not (folder / "build.ninja").exists():
        (folder / "CMakeCache.txt").unlink(missing_ok=True)
        command = ["cmake", "--preset", preset]
    log = folder / "configure.log"
    show_progress(f"configuring {preset}")
    if run_logged(command, log) != 0:
        show_end_of(log)
        print(f"{' '.join(command)} failed: {log.relative_to(ROOT)}")
        raise Failed
    used.write_text(settings_of(folder))


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
        with doing(f"build of {preset} ({log.relative_to(ROOT)})"):
            code = run_logged(["ninja", "-j", str(compilers()), "-C", f"build/{preset}", *targets], log, r"^FAILED", Steps(), deadline)
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
                        properties.get("TIMEOUT", 600), "RESOURCE_GROUPS" in properties))
    return runs


def files_of(runs):
    return sorted({file for run in runs for file in run.files})


def programs_of(preset):
    """Each test program with its source files."""
    lines = (BUILD / preset / "test_programs.txt").read_text().splitlines()
    return {words[0]: words[1:] for words in (line.split("\t") for line in lines)}
