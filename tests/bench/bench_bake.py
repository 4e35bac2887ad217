#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes a mesh with vpsbake and with OpenVDB's meshToVolume in turn, and prints Markdown tables. See `make bench`."""
import argparse
import json
import os
import statistics
import sys
import tempfile

from measured_run import measured_run

TARGET = 0.5
VOXELS_MM = (0.5, 0.25)
# Options of the bake, by what --fields takes.
FIELDS = {"all": ["--fields", "layers,scaled,real"], "default": []}


def measure(command):
    run = measured_run(command)
    if run.code != 0:
        sys.exit(f"{command[0]} failed with {run.code}: {run.err.strip()}")
    return run, json.loads(run.out)


def run_pairs(arguments, voxel_mm, folder):
    """One (vpsbake, OpenVDB) pair of runs per round."""
    asset = os.path.join(folder, "bench.vps.hdf")
    bake = [arguments.vpsbake, arguments.mesh, "--scale", str(arguments.scale), "--voxel", f"{voxel_mm}mm",
            *FIELDS[arguments.fields], "--json", "-o", asset]
    peer = [arguments.peer, arguments.mesh, str(arguments.scale), str(voxel_mm / 1000)]
    pairs = []
    for number in range(arguments.rounds + 1):
        # The first program alternates, so that a machine that slows down or warms up favours neither.
        if number % 2:
            theirs, ours = measure(peer), measure(bake)
        else:
            ours, theirs = measure(bake), measure(peer)
        # The first round only fills the page cache.
        if number > 0:
            pairs.append((ours, theirs))
        print(f"{voxel_mm} mm, round {number} of {arguments.rounds}: {ours[0].seconds:.2f} s, "
              f"OpenVDB {theirs[0].seconds:.2f} s", file=sys.stderr)
    return pairs


def ratio_row(work, ours, theirs):
    ratios = [a / b for a, b in zip(ours, theirs)]
    return (f"| {work} | {statistics.median(ours):.2f} | {statistics.median(theirs):.2f} | "
            f"{statistics.median(ratios):.2f} ({min(ratios):.2f}-{max(ratios):.2f}) | {TARGET} |")


def ratio_table(pairs_of):
    lines = ["| work | vpsbake, median s | OpenVDB, median s | ratio, median (min-max) | target |",
             "|---|---|---|---|---|"]
    for voxel, pairs in pairs_of.items():
        whole = [ours.seconds for (ours, _), _ in pairs]
        without_import = [ours.seconds - j["seconds"]["import"] for (ours, j), _ in pairs]
        convert = [j["mesh_to_volume"] for _, (_, j) in pairs]
        lines.append(ratio_row(f"{voxel} mm, whole commands, import on both sides", whole,
                               [theirs.seconds for _, (theirs, _) in pairs]))
        lines.append(ratio_row(f"{voxel} mm, import on neither side", without_import, convert))
        lines.append(ratio_row(f"{voxel} mm, whole vpsbake against meshToVolume alone", whole, convert))
    return lines


def usage_table(pairs_of):
    lines = ["| | vpsbake, processor s | OpenVDB, processor s | vpsbake, peak MB | OpenVDB, peak MB | asset, MB |",
             "|---|---|---|---|---|---|"]
    for voxel, pairs in pairs_of.items():
        def median(value, side):
            return statistics.median(value(pair[side]) for pair in pairs)
        cells = [f"{median(lambda r: r[0].cpu_seconds, side):.2f}" for side in (0, 1)]
        cells += [f"{median(lambda r: r[0].peak_bytes / 1e6, side):.0f}" for side in (0, 1)]
        cells.append(f"{median(lambda r: r[1]['bytes'] / 1e6, 0):.1f}")
        lines.append(f"| {voxel} mm | " + " | ".join(cells) + " |")
    return lines


def stage_table(pairs_of):
    lines = ["| stage, median s | " + " | ".join(f"{voxel} mm" for voxel in pairs_of) + " |",
             "|---|" + "---|" * len(pairs_of)]
    stages = list(next(iter(pairs_of.values()))[0][0][1]["seconds"])
    for stage in stages:
        cells = [f"{statistics.median(j['seconds'][stage] for (_, j), _ in pairs):.3f}" for pairs in pairs_of.values()]
        lines.append(f"| {stage} | " + " | ".join(cells) + " |")
    # Stages run side by side.
    def critical(j):
        return sum(j["seconds"][stage] for stage in j["critical_path"])
    cells = [f"{statistics.median(critical(j) for (_, j), _ in pairs):.3f}" for pairs in pairs_of.values()]
    lines.append("| critical path | " + " | ".join(cells) + " |")
    return lines


def machine():
    model = "unknown processor"
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        for line in file:
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    cores = os.cpu_count()
    return f"{model}, {cores} core{'' if cores == 1 else 's'}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vpsbake", required=True)
    parser.add_argument("--peer", required=True, help="openvdb_peer")
    parser.add_argument("--mesh", required=True)
    parser.add_argument("--scale", type=float, default=1.0, help="metres per unit of the mesh")
    parser.add_argument("--fields", choices=FIELDS, default="all", help="of the asset: all three, or the default")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--work", default=".", help="existing folder for the asset, deleted afterwards")
    arguments = parser.parse_args()

    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(dir=arguments.work) as folder:
        pairs_of = {voxel: run_pairs(arguments, voxel, folder) for voxel in VOXELS_MM}

    _, (_, peer) = next(iter(pairs_of.values()))[0]
    print(f"{machine()}; {peer['triangles']:,} triangles; {arguments.fields} fields; "
          f"{arguments.rounds} rounds, each side in turn.")
    # Other load slows down the program that uses more cores more.
    if load > 0.3 * os.cpu_count():
        print(f"The machine was busy, with a load of {load:.1f} before the first round: not a clean measurement.")
    print()
    for table in (ratio_table, usage_table, stage_table):
        print("\n".join(table(pairs_of)) + "\n")


if __name__ == "__main__":
    main()
