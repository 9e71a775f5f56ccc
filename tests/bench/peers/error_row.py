#!/usr/bin/env python3
"""A row of a table of pictures beside a reference.

  tests/bench/peers/error_row.py NAME ERROR.json [LOG]

ERROR.json is what `lightmill error --json` prints. LOG is what `lightmill render` printed: its notices are the last column.
"""
import json
import os
import re
import sys

name, error, *logs = sys.argv[1:]
with open(error, encoding="utf-8") as file:
    numbers = json.load(file)
columns = [name, *(f"{ratio:.4f}" for ratio in numbers["energy_ratio_rgb"]), f"{numbers['rel_mse']:.4f}", f"{numbers['flip']:.3f}"]
for log in logs:
    with open(log, encoding="utf-8") as file:
        notices = [line[6:].strip() for line in file if line.startswith("note: ")]
    folders = os.path.dirname(os.path.abspath(log)) + os.sep
    kept = [re.sub(r"\S*/scenes/\S*?([^/\s]+:\d+: )", r"\1", notice.replace(folders, "")) for notice in notices
            if not notice.startswith("left out: Sampler, Integrator")]
    columns.append("; ".join(dict.fromkeys(kept)))
print("| " + " | ".join(columns) + " |")
