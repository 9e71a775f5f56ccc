"""Checks that tests/long_tests.md names all tests that run only with --all, and that each of its filters matches a test. A renamed
test does not return to the default suite.

  long_tests_check.py TABLE BUILD-FOLDER
"""
import json
import pathlib
import re
import subprocess
import sys


def tables_of(text):
    """The rows of each table, with the numbers of their lines."""
    rows = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.startswith("|")]
    heads = [i for i, (_, line) in enumerate(rows) if line.startswith("| ---")]
    return [rows[head + 1:end] for head, end in zip(heads, [*(head - 1 for head in heads[1:]), None])]


def long_runs_of(folder):
    listed = subprocess.run(["ctest", "--test-dir", folder, "--show-only=json-v1"], check=True, capture_output=True, text=True).stdout
    return {test["name"] for test in json.loads(listed)["tests"]
            for each in test.get("properties", []) if each["name"] == "LABELS" and "long" in each["value"]}


def main():
    table, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    programs, others = tables_of(table.read_text())
    wrong, named = [], {name for _, line in programs if "| long: " in line for name in re.findall(r"`([^`]+)`", line.split("|")[1])}
    for number, line in others:
        row = re.match(r"\| `([a-z0-9_]+)` \| `([^`]+)` \|", line)  # as in cmake/tests.cmake
        if not row:
            wrong.append(f"{table.name}:{number}: this row has no program and filter, so CMake does not read it")
            continue
        named.add(f"{row.group(1)}.long")
        for pattern in row.group(2).split(":"):
            listed = subprocess.run([folder / "tests" / row.group(1), "--gtest_list_tests", f"--gtest_filter={pattern}"], check=True,
                                    capture_output=True, text=True).stdout
            if not re.search(r"^  \S", listed, re.M):
                wrong.append(f"{table.name}:{number}: {row.group(1)} has no test {pattern}")
    runs = long_runs_of(folder)
    wrong += [f"{table.name}: nothing with the label long is called {name}" for name in sorted(named - runs)]
    wrong += [f"{table.name}: {name} has the label long, and no row" for name in sorted(runs - named)]
    print("\n".join(wrong) or "all long tests have a row, and each filter matches a test")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
