#!/usr/bin/env python3
"""Tests the runner with a small project. It must never report a failure as a pass.

  runner_test.py [TEST...] SOURCE-FOLDER TOY-PROGRAM

With SHARD=2/4 in the environment it runs the second quarter of its tests.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

TOY = pathlib.Path(sys.argv.pop()).absolute()
SOURCE = pathlib.Path(sys.argv.pop()).absolute()
TIMEOUT = 120
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
WAITS = """
script(waits "touch '${CMAKE_BINARY_DIR}/begun'; while [ -e '${CMAKE_BINARY_DIR}/begun' ] && [ ! -e '${CMAKE_BINARY_DIR}/go' ]; do sleep 0.01; done
  sh -c 'kill -HUP $$'; test $? = 129" lint)
"""
CMAKE = """
cmake_minimum_required(VERSION 3.25)
project(toy LANGUAGES NONE)
include(cmake/tests.cmake)
enable_testing()

# program(NAME FILTER [LABEL...]): a copy of the toy that runs these tests.
function(program name filter)
  set(file ${CMAKE_BINARY_DIR}/tests/${name})
  add_custom_target(${name}.built COMMAND ${CMAKE_COMMAND} -E copy "TOY" ${file} BYPRODUCTS ${file} VERBATIM)
  add_executable(${name} IMPORTED GLOBAL)
  set_target_properties(${name} PROPERTIES IMPORTED_LOCATION ${file} LIGHTMILL_SOURCES toy_test.cpp)
  lightmill_test_runs(${name} "" "" ${ARGN})
  set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT GTEST_FILTER=${filter})
endfunction()

# script(NAME TEXT [LABEL...]): a run of sh.
function(script name text)
  file(WRITE ${CMAKE_BINARY_DIR}/${name}.sh "${text}")
  lightmill_run(${name} LABELS ${ARGN} COMMAND sh ${CMAKE_BINARY_DIR}/${name}.sh)
endfunction()

add_custom_target(programs)
include(runs.cmake)
lightmill_write_test_programs()
"""
GCOVR = """#!/usr/bin/env python3
import json, pathlib, sys

old = list(pathlib.Path("build/coverage").rglob("*.gcda"))
sys.exit(f"not removed: {old}") if old else None
files = [{"filename": "common/a.cpp", "line_total": 3, "line_covered": 2}, {"filename": "common/b.cpp", "line_total": 1, "line_covered": 1},
         {"filename": "client/c.cpp", "line_total": 4, "line_covered": 0}]
pathlib.Path(sys.argv[sys.argv.index("--json-summary") + 1]).write_text(json.dumps({"files": files}))
"""
DEFAULT = """
program(asan_tests Toy.Passes unit asan)
program(other_tests Toy.Passes unit)
"""
OTHERS = """
foreach(label fuzz simulation threads statistical)
  program(${label}_tests Toy.Passes ${label})
endforeach()
"""


def is_alive(pid):
    try:
        return pathlib.Path("/proc", pid, "stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


class Runner(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        shutil.copytree(SOURCE / "tests" / "runner", self.root / "tests" / "runner", ignore=shutil.ignore_patterns("__pycache__"))
        self.plant("cmake/tests.cmake", (SOURCE / "cmake" / "tests.cmake").read_text())
        self.plant("CMakeLists.txt", CMAKE.replace("TOY", str(TOY)))
        self.plant("toy_test.cpp", (SOURCE / "tests" / "runner" / "toy_test.cpp").read_text())
        self.plant("deploy/setup", "#!/bin/sh\necho $1 >>installed\n").chmod(0o755)
        self.plant(".gitignore", "build\ninstalled\n")
        self.plant_presets({})
        self.git("init", "-q")
        self.commit()

    def plant(self, path, text):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    def end_after(self, seconds):
        """Sets the time that processes have to end."""
        contain = self.root / "tests/runner/contain.py"
        self.plant(contain, contain.read_text().replace("SECONDS_TO_END = 10 ", f"SECONDS_TO_END = {seconds} "))

    def plant_presets(self, variables):
        presets = [{"name": name, "generator": "Ninja", "binaryDir": "${sourceDir}/build/${presetName}", "cacheVariables": variables}
                   for name in ("release", "asan", "ubsan", "tsan", "fuzz", "plain")]
        presets.append({**presets[0], "name": "coverage", "cacheVariables": {"CMAKE_CXX_FLAGS": "--coverage"}})
        self.plant("CMakePresets.json", json.dumps({"version": 6, "configurePresets": presets}))

    def plant_runs(self, text):
        self.plant("runs.cmake", DEFAULT + text)
        self.commit()

    def git(self, *arguments):
        subprocess.run(["git", "-C", self.root, "-c", "user.name=a", "-c", "user.email=a", *arguments], check=True)

    def commit(self):
        self.git("add", ".")
        self.git("commit", "-q", "-m", "a", "--allow-empty")

    def start(self, *arguments, env=None, ignored=()):
        def set_signals():
            for number in SIGNALS:
                signal.signal(number, signal.SIG_IGN if number in ignored else signal.SIG_DFL)
        process = subprocess.Popen([sys.executable, "-B", self.root / "tests" / "runner", *arguments], stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True, env=env, preexec_fn=set_signals)
        self.addCleanup(self.stop, process)
        return process

    def stop(self, process):
        """Ends a runner that a failed test has left, with its commands. Returns its output."""
        process.terminate()
        try:
            return process.communicate(timeout=TIMEOUT)[0]
        finally:
            process.kill()
            process.communicate()

    def end(self, process, timeout=TIMEOUT):
        """Whether it passed, and its output."""
        try:
            said, _ = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            self.fail(f"the runner did not end within {timeout} s:\n{self.stop(process)}")
        return process.returncode == 0, said

    def output_of(self, script):
        """What a Python script with the runner's modules prints."""
        return subprocess.run([sys.executable, "-B", "-c", script], cwd=self.root, env={**os.environ, "PYTHONPATH": "tests/runner"},
                              check=True, capture_output=True, text=True).stdout

    def run_it(self, *arguments):
        return self.end(self.start(*arguments))

    def assert_fails(self, arguments, *parts):
        self.assert_says(False, arguments, *parts)

    def assert_passes(self, arguments, *parts):
        self.assert_says(True, arguments, *parts)

    def assert_says(self, passes, arguments, *parts):
        passed, said = self.run_it(*arguments)
        for part in parts:
            self.assertRegex(said, part)
        self.assertEqual(passed, passes, said)

    def wait_until_no_run(self):
        """The last output of --status."""
        until = time.monotonic() + TIMEOUT
        while "no run is active" not in (said := self.run_it("--status")[1]):
            self.assertLess(time.monotonic(), until, said)
            time.sleep(0.02)
        return said

    def wait_for(self, path):
        until = time.monotonic() + TIMEOUT
        while not (self.root / path).exists():
            self.assertLess(time.monotonic(), until, f"{path} does not come")
            time.sleep(0.01)
        return (self.root / path).read_text()

    def test_a_passing_suite_passes(self):
        self.plant_runs('program(good_tests Toy.Passes unit)\nprogram(long_tests Toy.Passes atlas)\nscript(good.script "exit 0" lint)\n')
        self.assert_passes([], r"\n5 passed, 0 failed, 0 skipped\n")

    def test_readers_run_with_the_address_sanitizer_or_in_both_builds(self):
        self.plant_runs("program(twice_tests Toy.Passes unit asan release)\nprogram(hard_tests Toy.Passes fuzz asan long)\n")
        self.assert_passes([], r"\n4 passed, 0 failed, 0 skipped\n")
        # After the default suite, nothing runs twice in the same build.
        self.assert_passes(["--list"], "release build: other_tests twice_tests\n", "undefined-behaviour sanitizers: asan_tests twice_tests\n",
                           "long: hard_tests: hard_tests\n", "release: readers of untrusted input: asan_tests\n", "asan: unit: other_tests\n",
                           "asan: fuzz: hard_tests\n", "ubsan: unit: asan_tests other_tests twice_tests\n", "ubsan: fuzz: hard_tests\n")
        self.assert_passes(["release: readers of untrusted input"], r"\n1 passed")

    def test_every_kind_of_failure_is_reported(self):
        self.plant_runs("""
            program(fails_tests Toy.Passes:Toy.Fails unit)
            program(crashes_tests Toy.Passes:Toy.Crashes unit)
            program(ends_early_tests Toy.Passes:Toy.EndsTheProgram unit)
            program(matches_nothing_tests None.None unit)
            program(all_off_tests Toy.DISABLED_IsOff unit)
            add_test(NAME missing.program COMMAND none)
            script(too.late "sleep 600" unit)
            set_tests_properties(too.late PROPERTIES TIMEOUT 0.1)
            program(skips_tests Toy.Passes:Toy.IsSkipped unit)
            script(skips.script "exit 77" unit)
            script(lacks.shell "echo zsh is not installed; exit 77" unit)
        """)
        passed, said = self.run_it()
        self.assertFalse(passed)
        listed = said.partition("\nfailed:\n")[2]
        for name in ("Toy.Fails", "Toy.Crashes", "ends_early_tests", "matches_nothing_tests", "all_off_tests", "missing.program",
                     "too.late"):
            self.assertRegex(listed, rf"\n? *{re.escape(name)}\n")
        self.assertRegex(said, r"\nfailed: Toy.Crashes\n    crashes_tests: Subprocess aborted Exception\n(    .*\n)*    .*Toy.Crashes")
        self.assertRegex(said, r"\nlog: build/results/release-build/test.log\n")
        self.assertRegex(said, r"\nskipped:\n(.*\n)*  Toy.IsSkipped: no such tool\n")
        self.assertRegex(said, r"  skips.script: exit code 77\n")
        self.assertRegex(said, r"  lacks.shell: zsh is not installed\n")
        self.assertRegex(said, r"\n5 passed, 7 failed, \d skipped\n")

    def test_a_part_without_tests_fails(self):
        self.plant("runs.cmake", "program(good_tests Toy.Passes unit)\n")
        self.assert_fails([], "nothing is selected", r"\n1 passed, 0 failed, 0 skipped, failed builds: 1")

    def test_a_build_that_fails_leaves_the_other_parts(self):
        self.plant_runs("""
            add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/broken COMMAND false)
            add_custom_target(broken.built DEPENDS ${CMAKE_BINARY_DIR}/broken)
            lightmill_run(needs.broken LABELS unit NEEDS broken COMMAND true)
        """)
        self.assert_fails([], r"\n1 passed, 0 failed, 0 skipped, failed builds: 1")

    def test_a_configuration_that_did_not_end_is_made_again(self):
        self.plant_runs("")
        self.assert_passes(["asan_tests"], r"\n1 passed")
        (self.root / "build/release/build.ninja").unlink()
        self.assert_passes(["asan_tests"], r"\n1 passed")

    def test_a_name_builds_what_it_runs(self):
        self.plant_runs("program(one_tests Toy.Passes unit)\nprogram(two_tests Toy.Passes unit)\n")
        self.assert_passes(["one_tests"], r"\n1 passed")
        self.assertFalse((self.root / "build/release/tests/two_tests").exists())
        self.assert_passes(["unit"], r"\n4 passed")

    def test_names_are_labels_and_presets_too(self):
        self.plant_runs("""
            script(slow.one "touch ${CMAKE_BINARY_DIR}/ran" web long)
            script(lint.long "exit 0" lint)
            script(web.fast "exit 0" e2e)
        """)
        self.assert_passes(["web"], "left out, as long: slow.one", r"\n1 passed")
        self.assertFalse((self.root / "build/release/ran").exists())
        self.assert_passes(["long"], r"\n2 passed")
        self.assertTrue((self.root / "build/release/ran").exists())
        self.assert_passes(["ASAN"], r"programs and scripts: asan_tests\n", r"\nasan: build ", r"\n1 passed")
        self.assertTrue((self.root / "build/asan/tests/asan_tests").exists())
        self.assert_passes(["Web"], r"\n1 passed")
        self.assert_fails(["no_such_name"], "no program, label or test has this name")
        self.assert_fails(["asan", "tsan", "web"], "asan and tsan are different builds")

    def test_the_name_of_a_test_selects_it(self):
        self.plant_runs("")
        # Two programs, and the typed one.
        self.assert_passes(["Toy.Passes"], "Toy.Passes in asan_tests: Toy.Passes, TypedToy.PassesToo\n", r"\n4 passed")
        self.assert_passes(["PassesToo"], r"\n2 passed")
        # As reports write it, with its instance and parameter.
        self.assert_passes(["Few/Toy.Passes/3"], r"\n4 passed")
        self.assert_fails(["Toy.Fails"], r"failed:\n  Toy.Fails")
        self.assert_fails(["EndsTheProgram"], "was not written: Toy.EndsTheProgram has ended the program")
        self.assert_fails(["IsOff"], "names none that is enabled")
        self.assert_fails(["oy.Passes"], "no program, label or test has this name. Did you mean: Toy.Passe")
        self.assertTrue((self.root / "build/results/named").exists())
        self.assert_passes(["passestoo"], r"passestoo in asan_tests: TypedToy.PassesToo\n")
        self.plant("tests/new_test.cpp", "TEST(New, IsNotListed) {}\n")
        self.assert_fails(["IsNotListed"], "IsNotListed: tests/new_test.cpp is in no CMakeLists.txt")
        self.assert_fails(["IsNeverRun"], "no program that was built has a test of this name")

    def test_a_test_that_was_chosen_by_name_takes_a_core_if_it_computes(self):
        self.plant_runs("program(waits_tests Toy.Passes integration)\n")
        self.assert_passes(["Toy.Passes"])
        slots = {}
        for line in (self.root / "build/results/named/tests/CTestTestfile.cmake").read_text().splitlines():
            if match := re.match(r"set_tests_properties\((\w+) ", line):
                slots[match.group(1)] = "RESOURCE_GROUPS cores:1" in line
        self.assertEqual(slots, {"asan_tests": True, "other_tests": True, "waits_tests": False})

    def test_no_piece_has_the_name_of_a_label(self):
        self.plant_runs("program(twice_tests Toy.Passes unit asan release)\nprogram(once_tests Toy.Passes unit)\n")
        self.assert_passes(["release"], r"\n1 passed")
        self.assert_passes(["release build"], r"\n3 passed")
        script = """
import pathlib, re
import pieces

labels = re.search(r"set\\(LIGHTMILL_LABELS (.*)\\)", pathlib.Path("cmake/tests.cmake").read_text()).group(1).split()
print({piece.name for piece in pieces.DEFAULT_PIECES + pieces.OTHER_PIECES} & {*labels, "asan", "tsan", "ubsan"})
"""
        self.assertEqual(self.output_of(script), "set()\n")

    def test_a_failure_before_the_deadline_is_reported(self):
        self.plant_runs('''
            script(a.fails "exit 1" lint)
            script(b.lasts "kill -ALRM $(cat ${CMAKE_SOURCE_DIR}/build/test.lock); sleep 600" lint)
            set_tests_properties(b.lasts PROPERTIES DEPENDS a.fails)
        ''')
        self.assert_fails(["--all", "--minutes", "600"], r"time limit reached: b.lasts had run for \d+ s\n", r"failed:\n  a.fails",
                          r"\nfailed +release build\n")

    def test_an_unfinished_suite_fails(self):
        self.plant_runs('script(lasts "kill -ALRM $(cat ${CMAKE_SOURCE_DIR}/build/test.lock); sleep 600" lint)\n' + OTHERS)
        self.assert_fails(["--all", "--minutes", "600"], r"\nnot reached +release build\n", r"\npieces: \d+ were run, 1 were not reached\n")

    def test_pieces_after_the_deadline_are_not_reached(self):
        self.plant_runs('script(lasts "sleep 600" long)\n')
        self.assert_passes(["--all", "--in-turn", "--minutes", "0.0001"], "not reached +long: lasts", r"\npieces: 0 were run, \d+ were not reached\n")

    def test_in_turn_a_run_passes_if_no_piece_failed(self):
        script = """
import contextlib, io, types
import pieces
from process import Row
from results import Results

def run(seconds, failed=(), rotate=True):
    now = [0]
    deadlines = []

    def do_piece(piece, deadline, others):
        deadlines.append(deadline)
        end = now[0] + seconds[piece.name]
        now[0] = min(end, deadline)
        return [pieces.Outcome(piece.name, Results([Row(piece.name, 1, int(piece.name in failed))], is_late=end > deadline))]
    all_pieces = [pieces.Piece(name, "release") for name in seconds]
    kept = types.SimpleNamespace(done={})
    kept.record = kept.done.update
    pieces.DEFAULT_PIECES, pieces.later_pieces, pieces.in_turn = [], lambda _: all_pieces, lambda each: each
    pieces.State, pieces.do_piece = lambda _: kept, do_piece
    pieces.time = types.SimpleNamespace(monotonic=lambda: now[0])
    with contextlib.redirect_stdout(io.StringIO()):
        passed = pieces.run_all(1, rotate)
    print(passed, deadlines, *kept.done.values(), sep=", ")

run({"a": 20, "b": 90, "c": 1})  # the second is stopped after half of the minute
run({"a": 90, "b": 90, "c": 1})
run({"a": 20, "b": 20}, failed=["b"])
run({"a": 20, "b": 20})
"""
        self.assertEqual(self.output_of(script).splitlines(), [
            "True, [30.0, 50.0, 60], passed, not reached, passed",
            "True, [30.0, 60], not reached, not reached, not reached",
            "False, [30.0, 50.0], passed, failed",
            "True, [30.0, 50.0], passed, passed"])

    def test_the_deadline_ends_a_build(self):
        self.plant_runs("""
            file(WRITE ${CMAKE_BINARY_DIR}/slow.sh "cd '${CMAKE_SOURCE_DIR}'; echo $$ >pid; kill -ALRM $(cat runner); sleep 600")
            add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/slow COMMAND sh ${CMAKE_BINARY_DIR}/slow.sh)
            add_custom_target(slow.built DEPENDS ${CMAKE_BINARY_DIR}/slow)
            lightmill_run(needs.slow LABELS unit NEEDS slow COMMAND true)
        """)
        script = """
import os, pathlib, time
import pieces

pathlib.Path("runner").write_text(str(os.getpid()))
[outcome] = pieces.do_piece(pieces.Piece("one", "release", lambda run: run.name == "needs.slow"), time.monotonic() + 600)
print(outcome.state, [row.part for row in outcome.results.rows])
"""
        self.assertRegex(self.output_of(script), r"\nnot reached \['one: build'\]\n$")
        self.assertFalse(is_alive((self.root / "pid").read_text().strip()))

    def test_tests_write_to_the_memory_disk_if_it_has_space(self):
        script = """
import os, pathlib, subprocess
import session

ended = subprocess.Popen(["true"])
ended.wait()
disk = session.MEMORY_DISK = pathlib.Path("disk")
session.free_memory, session.MEMORY_DISK_BYTES = (lambda: 64 << 30), 1
print(session.why_no_memory_disk())
disk.mkdir()
for name in (f"lightmill-{ended.pid}", "lightmill-1", f"other-{ended.pid}"):
    (disk / name / "inner").mkdir(parents=True)
for name in ("faketime_shm_", "sem.faketime_sem_"):
    (disk / f"{name}{ended.pid}").touch()
os.environ["TMPDIR"] = "before"
with session.temporary_folder():
    folder = pathlib.Path(os.environ["TMPDIR"])
    (folder / "file").touch()
    print(sorted(path.name.replace(str(os.getpid()), "own").replace(str(ended.pid), "ended") for path in disk.iterdir()),
          oct(folder.stat().st_mode & 0o777))
print(folder.exists())
os.environ["TMPDIR"] = "before"
session.free_memory = lambda: 3 << 30
with session.temporary_folder():
    print(os.environ["TMPDIR"])
session.MEMORY_DISK_BYTES = 1 << 60
print(session.why_no_memory_disk())
"""
        self.assertEqual(self.output_of(script).splitlines(), [
            "there is no disk", "['lightmill-1', 'lightmill-own', 'other-ended'] 0o755", "False",
            "less than 4 GiB of memory are free: the tests write to a disk, which takes longer", "before",
            "disk has less than 1073741824 GiB free"])

    def test_coverage_is_counted_by_folder(self):
        self.plant_runs('''
            script(counts "test $LIGHTMILL_LEAVE_MS = 10000" lint)
            program(long_tests Toy.Passes unit long)
            script(deploy.package "exit 1" long)
            lightmill_run(deploy.quickstart LABELS long NEEDS long_tests COMMAND false)
        ''')
        tools = self.root / "build" / "tools"
        tools.mkdir(parents=True)
        for name in ("cmake", "ctest", "git", "ninja", "sh"):
            (tools / name).symlink_to(shutil.which(name))
        (tools / "python3").symlink_to(sys.executable)  # the one in PATH may be a script that needs other tools
        environment = {**os.environ, "PATH": str(tools)}
        # The package brings gcovr.
        self.plant("gcovr", GCOVR).chmod(0o755)
        self.plant("deploy/setup", "#!/bin/sh\necho $1 >>installed\n[ $1 = --tests ] || ${PATH}/cmake -E copy gcovr ${PATH}\n")
        self.plant("build/coverage/old.gcda", "")
        passed, said = self.end(self.start("--coverage", env=environment))
        self.assertTrue(passed, said)
        self.assertRegex(said, r"\n3 passed, 0 failed, 0 skipped\n")
        self.assertEqual((self.root / "installed").read_text(), "--tests\n--coverage\n")
        self.assertEqual([line.split() for line in said.splitlines()[-6:]], [
            ["folder", "lines", "run", "share"], ["common", "4", "3", "75.0%"], ["server", "0", "0", "0.0%"], ["worker", "0", "0", "0.0%"],
            ["client", "4", "0", "0.0%"], ["all", "8", "3", "37.5%"]])
        passed, said = self.end(self.start("--coverage", "--all", env=environment))
        self.assertTrue(passed, said)
        self.assertRegex(said, r"\n4 passed, 0 failed, 0 skipped\n")
        (tools / "gcovr").write_text("#!/bin/sh\necho no data; exit 1\n")
        passed, said = self.end(self.start("--coverage", env=environment))
        self.assertFalse(passed)
        self.assertRegex(said, r"\nno data\n")

    def test_over_many_commits_each_piece_gets_its_turn(self):
        script = """
import pieces, subprocess

for _ in range(60):
    subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a", "commit", "-q", "--allow-empty", "-m", "a"], check=True)
    print(*pieces.in_turn([0, 1, 2, 3, 4]))
"""
        self.assertEqual(set(self.output_of(script).splitlines()), {"0 1 2 3 4", "1 2 3 4 0", "2 3 4 0 1", "3 4 0 1 2", "4 0 1 2 3"})

    def test_finished_pieces_are_remembered(self):
        self.plant_runs('''
            script(flaky "[ -e ${CMAKE_BINARY_DIR}/tried ] || { touch ${CMAKE_BINARY_DIR}/tried; exit 1; }" lint)
            script(lacks.tool "exit 77" long)
        ''' + OTHERS)
        for state in ("failed", "failed, then passed"):
            self.run_it("--all")
            self.assert_passes(["--status"], "no run is active", f"\n{state} +release build\n", "passed +tsan: threads\n",
                               "skipped +long: lacks.tool\n")
        self.assert_fails(["--all"], "failed, then passed +release build\n")

    def test_an_unknown_label_fails(self):
        self.plant_runs('script(new.one "exit 0" uint)\n')
        self.assert_fails(["new.one"], "new.one: unknown label uint")

    def test_missing_tools_are_named(self):
        self.assertEqual(self.end(self.start("asan_tests", env={"PATH": "/nowhere"})), (False, "cmake cannot be run: No such file or directory\n"))

    def test_files_may_have_any_names(self):
        (self.root / os.fsdecode(b"bad\xff.txt")).touch()
        self.assert_passes(["--status"], "no run is active")

    def test_sources_that_change_during_a_run_fail_it(self):
        self.plant_runs('script(edits "echo >>${CMAKE_SOURCE_DIR}/runs.cmake" lint)\n')
        self.assert_fails(["--all"], "The sources have changed")
        self.assert_passes(["--status"], "--all has done nothing with these sources")

    def test_without_git_nothing_can_be_remembered(self):
        self.plant_runs("")
        shutil.rmtree(self.root / ".git")
        for arguments in (["--all"], ["--all", "--background"], ["--status"]):
            self.assert_fails(arguments, "git .*not a git repository", "\n--all, --repeat and --status need a git checkout")
        self.assert_passes(["Toy.Passes"])

    def test_new_runs_and_presets_are_seen(self):
        self.plant_runs("")
        self.assert_passes(["asan_tests"])
        self.plant_runs('script(new.one "test ${VALUE} = 7" lint)\n')
        self.assert_fails(["new.one"], "failed: new.one")
        self.plant_presets({"VALUE": "7"})
        self.assert_passes(["new.one"], r"\n1 passed")

    def test_variables_that_were_set_by_hand_are_those_of_the_preset_again(self):
        self.plant_presets({"VALUE": "7"})
        self.plant_runs('script(new.one "test ${VALUE} = 7" lint)\n')
        self.assert_passes(["new.one"])
        subprocess.run(["cmake", "--preset", "release", "-DVALUE=8"], cwd=self.root, check=True, capture_output=True)
        self.assert_passes(["new.one"], r"\n1 passed")
        # Then nothing is configured again.
        self.assert_passes(["new.one"], r"\n1 passed")
        self.assertIn("ninja: no work to do", (self.root / "build/release/configure.log").read_text())

    def test_a_compiler_is_the_same_by_its_name_and_by_its_path(self):
        script = """
import pathlib, shutil
import builds

pathlib.Path("build/release").mkdir(parents=True)
for line in ("UNINITIALIZED=sh", f"STRING={shutil.which('sh')}", "STRING=bash"):
    pathlib.Path("build/release/CMakeCache.txt").write_text(f"VALUE:{line}\\nOTHER:STRING=1\\n")
    print(builds.settings_of(pathlib.Path("build/release")).splitlines()[2:])
"""
        self.plant_presets({"VALUE": "sh"})
        by_name, by_path, other = self.output_of(script).splitlines()
        self.assertEqual(by_name, by_path)
        self.assertNotEqual(by_name, other)
        self.assertNotIn("OTHER", other)

    def test_a_second_runner_in_one_checkout_is_refused(self):
        self.plant_runs(WAITS)
        first = self.start("waits")
        self.wait_for("build/release/begun")
        self.assert_fails(["asan_tests"], f"process {first.pid} works in this checkout already")
        self.assert_passes(["--status"], rf"process {first.pid} is running\n  programs and scripts \(build/results/named/test.log\), since \d+ s\n")
        self.plant("build/release/go", "")
        self.assertTrue(self.end(first)[0])

    def test_commands_of_a_killed_runner_end_and_keep_a_second_one_away(self):
        self.end_after(3)
        self.plant_runs("""script(stays "trap '' TERM\necho $$ >new; mv new begun; while :; do sleep 0.1; done" lint)""")
        first = self.start("stays")
        pid = self.wait_for("build/release/begun").strip()
        first.kill()
        self.end(first)
        self.assert_fails(["asan_tests"], f"a command of the killed process {first.pid} works in this checkout already")
        self.wait_until_no_run()
        self.assertFalse(is_alive(pid))

    def test_a_runner_that_hangs_fails_its_test_and_is_ended(self):
        self.plant_runs('script(stays "echo $$ >new; mv new begun; sleep 600" lint)\n')
        process = self.start("stays")
        pid = self.wait_for("build/release/begun").strip()
        self.assertRaisesRegex(AssertionError, r"did not end within 0.1 s:\n(.*\n)*interrupted: stays", self.end, process, 0.1)
        self.assertFalse(is_alive(pid))

    def test_an_ignored_hangup_stays_ignored(self):
        self.plant_runs(WAITS)
        process = self.start("waits", ignored=[signal.SIGHUP])
        self.wait_for("build/release/begun")
        process.send_signal(signal.SIGHUP)
        self.plant("build/release/go", "")
        self.assertEqual(self.end(process)[0], True)  # the script ends its own sh with SIGHUP

    def test_a_copy_of_a_checkout_builds_in_its_own_folder(self):
        self.plant_runs('script(leaves.trace "touch \'${CMAKE_BINARY_DIR}/trace\'" lint)\n')
        self.assert_passes(["leaves.trace", "Toy.Passes"])
        (self.root / "build/release/trace").unlink()
        first, self.root = self.root, self.root / "build" / "a copy"
        shutil.copytree(first, self.root, ignore=lambda folder, _: ["a copy"])
        self.assert_passes(["leaves.trace", "Toy.Passes"])
        self.assertTrue((self.root / "build/release/trace").exists())
        self.assertFalse((first / "build/release/trace").exists())

    def test_the_limits_of_control_groups_count(self):
        script = """
import os, pathlib, process, results

process.CONTROL_GROUPS = pathlib.Path("groups")
cores, free = process.cores(), process.free_memory()
os.mkdir("groups")
for name, text in {"cpu.max": "150000 100000", "memory.max": 5 << 30, "memory.current": 3 << 30, "memory.stat": f"inactive_file {1 << 30}"}.items():
    pathlib.Path("groups", name).write_text(str(text))
print(process.cores(), process.free_memory() >> 30, process.at_once(99, 1 << 30))
for name in ("cpu.max", "memory.max"):
    pathlib.Path("groups", name).write_text("max 100000")
print(process.cores() == cores, abs(process.free_memory() - free) < 1 << 30)
process.CORES = results.CORES = 9
process.free_memory = lambda: 10 << 30
print(process.compilers(), *results.slots())
"""
        self.assertEqual(self.output_of(script), "1 3 3\nTrue True\n5 10 9\n")

    def test_the_table_of_long_tests_is_read_whole(self):
        def check(name, row):
            self.plant("table.md", f"| what | piece |\n| --- | --- |\n| `{name}` | long: … |\n\n| program | tests |\n| --- | --- |\n| {row} |\n")
            self.assert_passes(["k4_tests"])
            ended = subprocess.run([sys.executable, "-B", SOURCE / "tests/lint/long_tests_check.py", self.root / "table.md",
                                    self.root / "build/release"], capture_output=True, text=True)
            return ended.returncode, ended.stdout + ended.stderr
        self.plant_runs("""
            lightmill_read_long_tests(${CMAKE_SOURCE_DIR}/table.md)
            program(k4_tests Toy.Passes unit)
            script(slow.one "exit 0" long)
        """)
        self.assertEqual(check("slow.one", "`k4_tests` | `Toy.Crashes:Toy.Fails`")[0], 0)
        code, said = check("slow.two", "`K4_tests` | `Toy.Crashes`")
        self.assertEqual(code, 1)
        for part in ("table.md:7: this row has no program", "is called slow.two\n", "slow.one has the label long, and no row"):
            self.assertIn(part, said)
        self.assertIn("k4_tests has no test Toy.Gone", check("slow.one", "`k4_tests` | `Toy.Gone`")[1])

    def test_errors_of_files_are_one_line(self):
        self.plant_runs("")
        self.plant("build/results", "")
        passed, said = self.run_it("Toy.Passes")
        self.assertFalse(passed)
        self.assertRegex(said, r"\n\./test\.sh: .*build/results.*\n$")

    def test_signals_end_everything(self):
        self.end_after(1)
        for number, first in ((signal.SIGHUP, "trap '' TERM"), (signal.SIGTERM, ""), (signal.SIGINT, "")):
            self.plant_runs(f"""
                foreach(label lint asan)
                  script(stays.${{label}} "{first}\necho $$ $TMPDIR >new; mv new begun; while :; do sleep 0.1; done" ${{label}})
                endforeach()
            """)
            process = self.start()
            begun = [self.root / "build" / preset / "begun" for preset in ("release", "asan")]
            pids = [self.wait_for(file).split() for file in begun]
            process.send_signal(number)
            self.assertRegex(self.end(process)[1], r"\ninterrupted: stays.lint had run for \d+ s\n")
            for file, (pid, folder) in zip(begun, pids):
                self.assertFalse(is_alive(pid))
                self.assertFalse(pathlib.Path(folder).exists())
                file.unlink()

    def test_processes_that_a_test_leaves_fail_the_run_and_are_ended(self):
        self.end_after(1)
        self.plant_runs('''
            script(leaves.one "setsid sleep 600 >/dev/null 2>&1 & echo $! >${CMAKE_BINARY_DIR}/left" lint)
            script(ends.soon "sleep 0.3 >/dev/null 2>&1 &" lint)
        ''')
        self.assert_fails(["leaves.one"], r"\nleft behind: process \d+: sleep 600\n", r"\nfailed:\n  processes were left behind\n")
        self.assertFalse(is_alive((self.root / "build/release/left").read_text().strip()))
        self.assert_passes(["ends.soon"], r"\n1 passed")

    def test_a_signal_ends_the_parts_beside_an_ended_one(self):
        self.plant_runs("""
            script(stays "echo $$ >new; mv new begun; while :; do sleep 0.1; done" asan)
        """)
        process = self.start()
        pid = self.wait_for("build/asan/begun").strip()
        while "tests passed" not in self.wait_for("build/results/release-build/test.log"):
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        self.assertIn("interrupted", self.end(process)[1])
        self.assertFalse(is_alive(pid))

    def test_a_signal_ends_a_command_that_has_just_started(self):
        script = """
import os, pathlib, signal, subprocess, process

class Interrupted(subprocess.Popen):
    def __init__(self, *words, **options):
        super().__init__(*words, **options)
        print(self.pid, flush=True)
        os.kill(os.getpid(), signal.SIGTERM)

subprocess.Popen = Interrupted
process.INTERRUPTS.enable()
process.run_logged(["sleep", "600"], pathlib.Path("log"))
"""
        said = subprocess.run([sys.executable, "-B", "-c", script], cwd=self.root, env={"PYTHONPATH": "tests/runner"},
                              capture_output=True, text=True)
        self.assertIn("KeyboardInterrupt", said.stderr)
        self.assertFalse(is_alive(said.stdout.strip()))

    def test_what_a_command_printed_before_an_interrupt_is_read(self):
        script = """
import pathlib, process

def progress(line):
    print(line)
    if line == "one":
        raise KeyboardInterrupt

try:
    process.run_logged(["sh", "-c", "setsid sleep 600 & echo $! >left; printf 'one\\ntwo\\n'; sleep 600"], pathlib.Path("log"), progress=progress)
except KeyboardInterrupt:
    print(pathlib.Path("log").read_text())
"""
        self.assertEqual(self.output_of(script), "one\ntwo\none\ntwo\n\n")
        self.assertFalse(is_alive((self.root / "left").read_text().strip()))

    def test_a_signal_ends_a_part_that_has_not_begun(self):
        script = """
import os, pathlib, signal, process

def work():
    print("begun", flush=True)

process.INTERRUPTS.enable()
process.INTERRUPTS.is_delayed = True
os.kill(os.getpid(), signal.SIGTERM)
with process.beside(work, pathlib.Path("log")):
    pass
"""
        said = subprocess.run([sys.executable, "-B", "-c", script], cwd=self.root, env={"PYTHONPATH": "tests/runner"},
                              capture_output=True, text=True)
        self.assertIn("KeyboardInterrupt", said.stderr)
        self.assertFalse((self.root / "log").exists())

    def test_it_runs_in_the_background(self):
        self.plant_runs("")
        self.assert_passes(["--repeat", "1", "--background"], "its log is build/repeat/log")
        self.assertRegex(self.wait_until_no_run(), r"\n1 +2 +\d+  \n")

    def test_repeated_runs_are_remembered(self):
        self.plant_runs('script(counts "echo >>${CMAKE_SOURCE_DIR}/build/count" lint)\n')
        for times in (1, 2, 2):
            busy = str(times - 1)
            self.assert_passes(["--repeat", str(times), "--busy", busy], r"\n1 +3 +\d+  \n")
        self.assert_passes(["--status"], r"\n2 with busy loops +3 +\d+  \n")
        self.assertEqual((self.root / "build" / "count").read_text(), "\n\n")

    def test_a_failure_in_one_of_many_runs_stays_with_its_results(self):
        self.plant_runs('''
            script(flaky "[ -e ${CMAKE_BINARY_DIR}/tried ] || { touch ${CMAKE_BINARY_DIR}/tried; echo the reason; exit 1; }" lint)
        ''')
        for _ in range(2):
            self.assert_fails(["--repeat", "2"], r"\n1 +3 +\d+  flaky\n2 +3 +\d+  \n")
        self.assertIn("the reason", (self.root / "build/repeat/failed-1/release-build/test.log").read_text())
        self.assertNotIn("the reason", (self.root / "build/results/release-build/test.log").read_text())

    def test_a_run_whose_build_failed_does_not_count(self):
        self.plant_runs("""
            add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/broken COMMAND false)
            add_custom_target(broken.built DEPENDS ${CMAKE_BINARY_DIR}/broken)
            lightmill_run(needs.broken LABELS unit NEEDS broken COMMAND true)
        """)
        self.assert_fails(["--repeat", "1"], "a build failed: this run does not count")
        self.assertNotRegex(self.run_it("--status")[1], r"\n1 +")

    def test_busy_loops_run_on_each_core_in_the_last_runs(self):
        # The runner is the parent of the loops, and of what runs this script.
        self.plant_runs('''
            script(counts "pgrep -fc -P $(cat ${CMAKE_SOURCE_DIR}/build/test.lock) 'while os.getppid' >>${CMAKE_SOURCE_DIR}/build/count; true" lint)
        ''')
        self.assert_passes(["--repeat", "2", "--busy", "1"])
        self.assertEqual((self.root / "build/count").read_text(), f"0\n{len(os.sched_getaffinity(0))}\n")

    def test_the_log_of_the_background_is_kept(self):
        self.plant_runs('script(fails "exit 1" lint)\n')
        for _ in range(2):
            self.assert_passes(["--repeat", "1", "--background"])
            self.wait_until_no_run()
        log = (self.root / "build/repeat/log").read_text()
        self.assertEqual(log.count("#### begun "), 2)
        self.assertIn("***Failed", log)

    def test_what_a_test_prints_is_not_the_result_of_another(self):
        self.plant_runs('''
            script(a.first "exit 1" lint)
            script(z.last "echo '1/9 Test #9: a.first ....   Passed    0.01 sec'; echo 'Start 9: other'; echo the reason; exit 1" lint)
            set_tests_properties(z.last PROPERTIES DEPENDS a.first)
        ''')
        self.assert_fails([], r"\n2 passed, 2 failed", r"\nfailed: z.last\n(    .*\n)*    the reason\n")

    def test_settings_of_the_caller_do_not_reach_the_tests(self):
        self.plant_runs('script(unset "test -z $ASAN_OPTIONS$CXXFLAGS$PYTHONPATH" lint)\n')
        passed, said = self.end(self.start("unset", env={**os.environ, "ASAN_OPTIONS": "a", "CXXFLAGS": "b", "PYTHONPATH": "c"}))
        self.assertTrue(passed, said)

    def test_wrong_arguments_print_the_usage(self):
        for arguments in (["--repeat", "0"], ["--repeat", "-1"], ["--repeat", "1", "--busy", "2"], ["--backg", "--all"],
                          ["--coverage", "--all", "--background"], ["--minutes", "1"], ["--all", "film"], [""], ["."],
                          ["--all", "--minutes", "0"], ["--all", "--minutes", "nan"]):
            with self.subTest(arguments):
                self.assert_fails(arguments, "usage:")
        self.assertFalse((self.root / "installed").exists())
        self.plant_runs("")
        self.assert_passes(["asan_tests"])
        self.assertEqual((self.root / "installed").read_text(), "--tests\n")


def load_tests(_, suites, __):
    shard, shards = map(int, os.environ.get("SHARD", "1/1").split("/"))
    tests = [test for suite in suites for test in suite][shard - 1::shards]
    if not tests:
        sys.exit("this shard has no tests")
    return unittest.TestSuite(tests)


if __name__ == "__main__":
    unittest.main()
