"""Checks that each filter in tests/long_tests.md matches a test, so that a renamed test does not return to the default suite.

  long_tests_check.py TABLE FOLDER-OF-TEST-PROGRAMS
"""
import pathlib
import re
import subprocess
import sys


def main():
    table, programs = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    wrong = []
    for number, line in enumerate(table.read_text().splitlines(), 1):
        row = re.match(r"\| `([a-z_]+)` \| `([^`]+)` \|", line)
        for pattern in row.group(2).split(":") if row else []:
            listed = subprocess.run([programs / row.group(1), "--gtest_list_tests", f"--gtest_filter={pattern}"], check=True,
                                    capture_output=True, text=True).stdout
            if not re.search(r"^  \S", listed, re.M):
                wrong.append(f"{table.name}:{number}: {row.group(1)} has no test {pattern}")
    print("\n".join(wrong) or "each filter matches a test")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
