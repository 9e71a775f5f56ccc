"""Builds and runs the programs, labels or tests whose names match."""
import dataclasses
import difflib
import pathlib
import re
import shutil

from builds import build, files_of, programs_of, runs_of
from process import BUILD, ROOT, Stopwatch, output_of
from results import Results, print_end, run_tests

SANITIZERS = {"asan": "asan", "tsan": "threads", "ubsan": "asan"}  # presets, and the labels of the runs that gain most from them


def words_of(name):
    return f".{name.lower().replace('_', '.')}."


def runs_with(name, runs):
    """Runs with this label, or with these words in their names. Long ones only if the name is `long`, or if there are no
    others."""
    name = name.lower()
    found = [run for run in runs if name in run.labels or words_of(name) in words_of(run.name)]
    short = [run for run in found if "long" not in run.labels]
    if name == "long" or not short:
        return found
    if len(short) < len(found):
        print("left out, as long: " + ", ".join(run.name for run in found if run not in short))
    return short


def tests_of(source):
    """The names (Suite.Name) of the tests in a file."""
    macro = r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\)"
    return [".".join(found) for found in re.findall(macro, pathlib.Path(source).read_text(), re.M)]


def named_tests(sources, name):
    """Tests in these files with `name` in their names, from the start of a word such as Order in MergeOrder. It may be written as in
    reports: Instance/Suite.Name/parameter. Or it is one of the files, and all its tests are meant."""
    if name.endswith(".cpp"):
        return [test for source in sources if f"/{source}".endswith(f"/{name}") for test in tests_of(source)]
    name = re.sub(r"^(?:\w+/)?(\w+)(?:/\w+)?\.(\w+)(?:/.*)?$", r"\1.\2", name).lower()
    return [test for source in sources for test in tests_of(source)
            if any(test[start:].lower().startswith(name) for start in word_starts(test))]


def word_starts(test):
    return [0, *(match.start() + 1 for match in re.finditer(r"[a-z0-9._](?=[A-Z0-9])|[A-Z](?=[A-Z][a-z])|[._](?=[a-z])", test))]


def unknown(name, runs, programs):
    """Says that nothing has this name, and what it may mean."""
    listed = {source for sources in programs.values() for source in sources}
    for file in sorted((ROOT / "tests").rglob("*_test.cpp")):
        if str(file) not in listed and named_tests([str(file)], name):
            return f"{file.relative_to(ROOT)} is in no CMakeLists.txt, or needs a program that is not found on this machine"
    tests = [test for sources in programs.values() for source in sources for test in tests_of(source)]
    known = {word for run in runs for word in [run.name, *run.name.split("."), *run.labels]}
    beginnings = {test[start:start + len(name)] for test in tests for start in word_starts(test)}
    close = difflib.get_close_matches(name, sorted(known), 3, 0.6) or difflib.get_close_matches(name, sorted(beginnings), 3, 0.8)
    return "no program, label or test has this name." + (f" Did you mean: {', '.join(close)}?" if close else "")


def filter_of(tests):
    """GoogleTest's name. A parameterised test has a prefix and a suffix, and a typed one its type between suite and name."""
    patterns = []
    for suite, name in (test.split(".") for test in tests):
        patterns += [f"{suite}.{name}", f"*/{suite}.{name}/*", f"{suite}/*.{name}", f"*/{suite}/*.{name}"]
    return ":".join(patterns)


def tests_in(program, preset, tests):
    """The filter of these tests, or None if the program has none of them (not compiled or not instantiated)."""
    pattern = filter_of(tests)
    listed = output_of([BUILD / preset / "tests" / program, "--gtest_list_tests", f"--gtest_filter={pattern}"])
    return pattern if re.search(r"^  \S", listed, re.M) else None


def write_filtered(folder, preset, runs, filters):
    """Makes a folder for ctest with these programs and their filters. Returns its runs."""
    folder.mkdir(parents=True)
    filtered, lines = [], []
    for program, pattern in filters.items():
        run = next(run for run in runs if run.name.split(".")[0] == program)
        environment = {name: value for name, value in run.environment.items() if "SHARD" not in name}
        environment |= {"GTEST_FILTER": pattern, "GTEST_OUTPUT": f"xml:{folder}/reports/{program}.xml"}
        filtered.append(dataclasses.replace(run, name=program, environment=environment))
        settings = ";".join(f"{name}={value}" for name, value in environment.items())
        lines += [f'add_test({program} "{BUILD / preset / "tests" / program}")',
                  f'set_tests_properties({program} PROPERTIES TIMEOUT {run.timeout:.0f} ENVIRONMENT "{settings}"'
                  f'{" RESOURCE_GROUPS cores:1" if run.computes else ""})']
    (folder / "CTestTestfile.cmake").write_text("\n".join(lines))
    return filtered


def run_named(words):
    words = [word.lower() if word.lower() in SANITIZERS else word for word in words]
    presets = [word for word in words if word in SANITIZERS] or ["release"]
    if len(presets) > 1:
        print(f"{' and '.join(presets)} are different builds: run one after the other")
        return False
    [preset] = presets
    watch, folder = Stopwatch(), BUILD / "results" / "named"
    runs, programs = runs_of(preset), programs_of(preset)
    chosen, tests_of_names = [], {}
    for name in [word for word in words if word not in SANITIZERS] or [SANITIZERS[preset]]:
        found = runs_with(name, runs)
        chosen += [run for run in found if run not in chosen]
        if not found:
            tests_of_names[name] = {program: tests for program, files in programs.items() if (tests := named_tests(files, name))}
        if not found and not tests_of_names[name]:
            print(f"{name}: {unknown(name, runs, programs)}")
            return False
        for program, tests in tests_of_names.get(name, {}).items():
            print(f"{name} in {program}: {', '.join(tests)}", flush=True)
    if chosen:
        print("programs and scripts: " + ", ".join(run.name for run in chosen), flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    build(preset, files_of(chosen) + sorted({f"tests/{program}" for tests in tests_of_names.values() for program in tests}),
          folder / "build.log")
    filters = {}
    for name, tests in tests_of_names.items():
        found = {program: pattern for program in tests if (pattern := tests_in(program, preset, tests[program]))}
        if not found:
            print(f"{name}: no program that was built has a test of this name.")
            return False
        for program, pattern in found.items():
            filters[program] = ":".join([pattern, *([filters[program]] if program in filters else [])])
    results = Results(rows=[watch.row(f"{preset}: build")])
    if chosen:
        results.add(run_tests(BUILD / preset, chosen, folder, "programs and scripts"))
    if filters:
        test_folder = folder / "tests"
        results.add(run_tests(test_folder, write_filtered(test_folder, preset, runs, filters), test_folder, "tests"))
    print_end(results, watch)
    return not results.failed
