"""Configures and builds, and lists what a build folder has.

A *run* is one entry of ctest: a test program, a share of one, or a script.
"""
import json
import subprocess

from process import BUILD, ROOT, Failed, run_logged, show_end_of


def configure(preset):
    """Only where there is no build folder yet, or one without tests: ninja does it by itself from then on."""
    folder = BUILD / preset
    cache = folder / "CMakeCache.txt"
    if (folder / "build.ninja").exists() and "LIGHTMILL_TESTS:BOOL=ON" in cache.read_text():
        return
    log = folder / "configure.log"
    if run_logged(["cmake", "--preset", preset, "-DLIGHTMILL_TESTS=ON"], log) != 0:
        show_end_of(log)
        raise Failed


def build(preset, targets, deadline=None):
    """False if the deadline came first."""
    configure(preset)
    log = BUILD / preset / "build.log"
    code = run_logged(["ninja", "-C", f"build/{preset}", *targets], log, show=r"^FAILED|error:", deadline=deadline)
    if code is None:
        return False
    if code != 0:
        show_end_of(log)
        print(f"the build failed: {log.relative_to(ROOT)}")
        raise Failed
    return True


def runs_of(preset):
    """The runs of a build folder: dicts of name, labels and command."""
    configure(preset)
    listed = subprocess.run(["ctest", "--test-dir", f"build/{preset}", "--show-only=json-v1"], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout
    runs = []
    for test in json.loads(listed)["tests"]:
        labels = next((p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"), [])
        runs.append({"name": test["name"], "labels": labels, "command": test.get("command", [])})
    return runs


def programs_of(preset):
    """Each test program and its source files."""
    lines = (BUILD / preset / "test_programs.txt").read_text().splitlines()
    return {words[0]: words[1:] for words in (line.split() for line in lines)}
