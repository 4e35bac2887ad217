# SPDX-License-Identifier: GPL-3.0-or-later
"""Assets that the tests share, each baked once."""
import os
from pathlib import Path

import numpy as np
import pytest
import vps

MESHES = Path(os.environ["VPS_SAMPLE_MESHES"])
RADIUS = 0.05  # of icosphere.obj [m]


def read_obj(name):
    lines = [line.split() for line in (MESHES / name).read_text().splitlines()]
    vertices = np.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    faces = np.array([[corner.split("/")[0] for corner in line[1:4]] for line in lines if line[:1] == ["f"]], int) - 1
    return vertices, faces


@pytest.fixture(scope="session")
def sphere():
    return vps.bake(MESHES / "icosphere.obj", voxel=4e-3)


@pytest.fixture(scope="session")
def cube():
    """100 mm, with few points: less than the sphere has."""
    return vps.bake(MESHES / "cube.obj", voxel=5e-3, alpha=4)


@pytest.fixture(scope="session")
def layers():
    return vps.bake(MESHES / "cube.obj", voxel=10e-3, layers=True, scaled=False)


@pytest.fixture()
def points():
    return np.random.default_rng(0).uniform(-0.07, 0.07, (5000, 3))


def shifted(*translation):
    pose = np.eye(4)
    pose[:3, 3] = translation
    return pose
