# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the trajectories that the scenes' programs write."""
import pathlib


def read_trajectory(path):
    """Bodies as (kind, numbers, word), frames as (time, poses)."""
    bodies, frames = [], []
    for line in pathlib.Path(path).read_text().splitlines():
        words = line.split()
        if words[0] == "mesh":
            bodies.append(("mesh", [], " ".join(words[1:])))
        elif words[0] == "box":
            bodies.append(("box", [float(w) for w in words[1:4]], words[4]))
        elif words[0] == "frame":
            frames.append((float(words[1]), []))
        else:
            frames[-1][1].append([float(w) for w in words])
    return bodies, frames
