#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays the nut on its bolt baked and made of convex pieces, and writes both as one motion with its assets."""
import argparse
import json
import pathlib
import subprocess

from trajectory import read_trajectory

APART = 0.03  # m, between the two bolts
VOXEL = "0.15mm"  # as in the scene


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vpsbake", type=pathlib.Path, required=True)
    parser.add_argument("--scene", type=pathlib.Path, required=True, help="the program nut_on_bolt")
    parser.add_argument("--meshes", type=pathlib.Path, required=True, help="folder of bolt.obj and nut.obj")
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True, help="motion to write; assets lie beside it")
    options = parser.parse_args()
    folder = options.output.parent
    for name in ("bolt", "nut"):
        subprocess.run([options.vpsbake, options.meshes / f"{name}.obj", "--voxel", VOXEL, "-o", folder / f"{name}.vps.hdf"],
                       check=True)
    plays = []
    for hulls in ([], ["--hulls"]):
        trajectory = folder / f"nut_on_bolt{''.join(hulls)}.txt"
        # With convex pieces the scene fails its conditions: that is what the motion shows.
        run = subprocess.run([options.scene, "sample", *hulls, "--trajectory", trajectory], capture_output=True, text=True,
                             check=False)
        if not hulls:
            print(run.stdout, end="")
            run.check_returncode()
        plays.append(read_trajectory(trajectory)[1])
    motion = {"format": "vps-motion 1", "title": "A nut on its bolt: baked, and made of convex pieces", "up": "z",
              "bodies": [{"name": f"{part}, {how}", "asset": f"{part}.vps.hdf"}
                         for how in ("baked", "16 convex pieces") for part in ("bolt", "nut")],
              "times": [time for time, _ in plays[0]],
              "poses": [baked + [[x + APART, *rest] for x, *rest in pieces] for (_, baked), (_, pieces) in zip(*plays)]}
    options.output.write_text(json.dumps(motion))


if __name__ == "__main__":
    main()
