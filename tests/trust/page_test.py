#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/internals/trust.md, which `make trust` writes, has a row for every promise of the program."""
import json
import re
import subprocess
import sys

program, page = sys.argv[1:]
promises = [json.loads(line) for line in subprocess.check_output([program, "--list"], text=True).splitlines()]
with open(page, encoding="utf-8") as file:
    rows = {cells[0]: cells for cells in (re.split(r" ?\| ?", line.strip("|\n ")) for line in file if line.startswith("|"))}
faults = [p["name"] for p in promises if p["name"] not in rows or rows[p["name"]][1] != p["says"]]
print(*(f"{name}: run `make trust`" for name in faults), sep="\n")
sys.exit(1 if faults or not promises else 0)
