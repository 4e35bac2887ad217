#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the paper's experiments and writes tables and figures beside the paper's own numbers. See `make paper`."""
import argparse
import json
import os
import subprocess
import sys

import figures
from page import page

# Uses the benchmarks' description of the machine.
sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "bench"))
from bench_bake import machine  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", required=True, help="paper_runs")
    parser.add_argument("--mesh", required=True, help="the closed bunny")
    parser.add_argument("--scale", type=float, default=1.0, help="metres per unit of the mesh")
    parser.add_argument("--work", default=".", help="folder for assets, hulls and the numbers")
    parser.add_argument("-o", "--output", required=True, help="existing folder for README.md and the figures")
    arguments = parser.parse_args()

    load = os.getloadavg()[0]
    numbers = os.path.join(arguments.work, "paper.json")
    subprocess.run([arguments.runs, arguments.mesh, "--scale", str(arguments.scale), "--work", arguments.work,
                    "--json", numbers], check=True)
    with open(numbers, encoding="utf-8") as file:
        measured = json.load(file)
    measured["machine"] = machine()
    measured["load"] = load
    measured["busy"] = load > 0.3 * os.cpu_count()
    figures.write(measured, arguments.output)
    with open(os.path.join(arguments.output, "README.md"), "w", encoding="utf-8") as file:
        file.write(page(measured))


if __name__ == "__main__":
    main()
