"""Builds and runs the programs, labels or tests whose names match."""
import difflib
import pathlib
import re
import subprocess
import time

from builds import build, programs_of, runs_of
from process import BUILD
from results import run_tests


def named_tests(sources, name):
    """Tests (Suite.Name) in these files whose names contain `name`."""
    found = []
    for source in sources:
        for suite, test in re.findall(r"^TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\)", pathlib.Path(source).read_text(), re.M):
            if name.lower() in f"{suite}.{test}".lower():
                found.append(f"{suite}.{test}")
    return found


def run_named(names):
    begun = time.monotonic()
    preset = "release"
    runs, programs = runs_of(preset), programs_of(preset)
    chosen, filters = [], {}
    for name in names:
        matching = [run for run in runs if name.lower() in re.split(r"[._]", run["name"].lower()) or name == run["name"]
                    or run["name"].startswith(name + ".")]
        matching = matching or [run for run in runs if name in run["labels"]]
        if matching:
            plain = [run for run in matching if "long" not in run["labels"]]
            chosen += plain or matching
            continue
        hits = {program: tests for program, files in programs.items() if (tests := named_tests(files, name))}
        if not hits:
            known = sorted({word for run in runs for word in [run["name"], *run["labels"]]})
            close = difflib.get_close_matches(name, known, 3, 0.4)
            print(f"{name}: no program, label or test has this name." + (f" Near to it: {', '.join(close)}." if close else ""))
            return False
        for program, tests in hits.items():
            filters.setdefault(program, []).extend(tests)
    targets = {pathlib.Path(run["command"][0]).name for run in chosen if run["command"]} & set(programs)
    scripts = [run for run in chosen if run["command"] and pathlib.Path(run["command"][0]).name not in programs]
    build(preset, sorted(targets | set(filters)) + (["all_tests"] if scripts else []))
    passed, tests = True, 0
    if chosen:
        select = "|".join(re.escape(run["name"]) for run in chosen)
        _, total = run_tests(preset, ("-R", f"^({select})$"))
        tests, passed = total.tests, total.failed == 0
    for program, found in filters.items():
        # A parameterised test has a prefix and a suffix.
        pattern = ":".join(f"{test}:*/{test}/*" for test in found)
        tests += len(found)
        passed &= subprocess.run([str(BUILD / preset / "tests" / program), f"--gtest_filter={pattern}"], cwd=BUILD / preset,
                                 check=False).returncode == 0
    print(f"{'passed' if passed else 'FAILED'}: {tests} tests, {time.monotonic() - begun:.0f} s with the build")
    return passed
