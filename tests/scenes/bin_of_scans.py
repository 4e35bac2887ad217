#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes scans and drops them into a bin. The scans are those of the shared folder; without it the Stanford bunny and two models."""
import argparse
import pathlib
import subprocess


def meshes(shared, models):
    """Names, files, options of the bake, and how many of each to drop."""
    scans = sorted(shared.glob("scenes/ycb_tabletop/ycb_objects/*/textured_simple_reoriented.obj"))
    if scans:
        return [(scan.parent.name, scan, [], 1) for scan in scans]
    return [("bunny_1mm", models / "bunny.obj", ["--scale", "0.0775"], 4),
            ("horse", models / "horse.3ds", ["--scale", "0.1", "--repair", "fill"], 4),
            ("asteroid", models / "asteroid-high.3ds", ["--scale", "0.04"], 4)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vpsbake", type=pathlib.Path, required=True)
    parser.add_argument("--scene", type=pathlib.Path, required=True, help="the program bin_drop")
    parser.add_argument("--shared", type=pathlib.Path, required=True, help="folder of scenes/ycb_tabletop; may be absent")
    parser.add_argument("--models", type=pathlib.Path, required=True, help="folder of bunny.obj, horse.3ds and asteroid-high.3ds")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="motion to write; assets lie beside it")
    options = parser.parse_args()
    kinds = []
    for name, mesh, how, count in meshes(options.shared, options.models):
        asset = options.output.parent / f"{name}.vps.hdf"
        subprocess.run([options.vpsbake, mesh, *how, "--voxel", "1mm", "-o", asset], check=True)
        kinds.append((asset, count))
    bodies = [asset for turn in range(max(count for _, count in kinds)) for asset, count in kinds if turn < count]
    subprocess.run([options.scene, options.output, *bodies], check=True)


if __name__ == "__main__":
    main()
