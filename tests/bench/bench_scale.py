#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes a mesh of many triangles and a grid of many voxels, and prints time and memory as Markdown. See `make bench-scale`."""
import argparse
import json
import os
import sys
import tempfile

from measured_run import measured_run
from subdivide import write_subdivided

PARTS = 5  # of every edge: 25 triangles for each


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        model = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), "unknown")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return f"{model}, {os.cpu_count()} logical cores, {memory / 2**30:.0f} GiB"


def bake(vpsbake, mesh, scale, resolution, folder):
    # The machine's load before the run, which is printed, as other programs may be running.
    load = os.getloadavg()[0]
    run = measured_run([vpsbake, mesh, "--scale", str(scale), "--resolution", str(resolution), "--json", "-o",
                        os.path.join(folder, "scale.vps.hdf")])
    if run.code != 0:
        sys.exit(f"{resolution} voxels failed with {run.code}: {run.err.strip()}")
    print(f"{resolution} voxels: {run.seconds:.1f} s", file=sys.stderr)
    return run, json.loads(run.out), load


def tables(results):
    lines = ["| case | triangles | grid, voxels | points | asset, MB | predicted, GB | peak, GB | time, s | CPU, s | load before |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for name, (run, j, load) in results.items():
        grid = " x ".join(map(str, j["plan"]["dims"]))
        lines.append(f"| {name} | {j['mesh']['triangles']:,} | {grid} | {j['pointshell']['points']:,} | {j['bytes'] / 1e6:.1f} | "
                     f"{j['plan']['predicted_memory_bytes'] / 1e9:.2f} | {run.peak_bytes / 1e9:.2f} | {run.seconds:.1f} | "
                     f"{run.cpu_seconds:.1f} | {load:.1f} |")
    stages = list(next(iter(results.values()))[1]["seconds"])
    lines += ["", "| stage, s | " + " | ".join(results) + " |", "|---|" + "---|" * len(results)]
    for stage in stages:
        lines.append(f"| {stage} | " + " | ".join(f"{j['seconds'][stage]:.2f}" for _, j, _ in results.values()) + " |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vpsbake", required=True)
    parser.add_argument("--mesh", required=True, help="OBJ of triangles")
    parser.add_argument("--scale", type=float, default=1, help="metres per number of the mesh")
    parser.add_argument("--work", default=".", help="existing folder for meshes and assets, deleted afterwards")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=arguments.work) as folder:
        many = os.path.join(folder, "many.off")
        write_subdivided(arguments.mesh, PARTS, many)
        results = {"many triangles": bake(arguments.vpsbake, many, arguments.scale, 1024, folder),
                   "many voxels": bake(arguments.vpsbake, arguments.mesh, arguments.scale, 2048, folder)}
    print("\n".join([machine(), ""] + tables(results)))


if __name__ == "__main__":
    main()
