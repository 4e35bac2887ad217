# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries of two assets for many poses."""
import os
import signal
import threading
import time

import numpy as np
import pytest
import vps
from conftest import RADIUS, shifted


def turned(angle, translation):
    pose = shifted(*translation)
    c, s = np.cos(angle), np.sin(angle)
    pose[:2, :2] = [[c, -s], [s, c]]
    return pose


def test_spheres_are_as_far_apart_as_their_centres_say(sphere):
    at = np.linspace(0.095, 0.13, 8)
    found = vps.separation(sphere, sphere, [shifted(x, 0, 0) for x in at])
    true = at - 2 * RADIUS
    assert np.allclose(found.distance, true, atol=2e-3)
    assert np.all(found.lower <= true + 1e-3) and np.all(true - 1e-3 <= found.upper)
    assert np.all(found.normal[:, 0] > 0.9), "from the first body to the second"
    assert np.allclose(found.position, [RADIUS, 0, 0], atol=2e-3), "the first body gives the point, as both have as many"


@pytest.mark.parametrize("distance", [0.0, 0.01])
def test_either_body_may_come_first(sphere, cube, distance):
    """The cube has fewer points, so it plays the pointshell in both orders."""
    assert len(cube.points.area) < len(sphere.points.area)
    poses = np.array([turned(angle, (0.09 + 0.01 * angle, 0.02 * angle, 0.01)) for angle in np.linspace(0, 1, 6)])
    one, other = vps.separation(sphere, cube, poses), vps.separation(cube, sphere, np.linalg.inv(poses))
    assert np.allclose(one.distance, other.distance, atol=1e-6) and np.allclose(one.lower, other.lower, atol=1e-6)
    here = np.einsum("nij,nj->ni", poses[:, :3, :3], other.position) + poses[:, :3, 3]
    assert np.allclose(one.position, here, atol=1e-6)
    assert np.allclose(one.normal, -np.einsum("nij,nj->ni", poses[:, :3, :3], other.normal), atol=1e-5)
    a, b = (vps.contacts(*args, distance=distance) for args in ((sphere, cube, poses), (cube, sphere, np.linalg.inv(poses))))
    assert np.array_equal(a.counts, b.counts) and a.counts.sum() > 0 and np.array_equal(a.pose, b.pose)
    assert np.allclose(a.depth, b.depth, atol=1e-6)
    turn = poses[b.pose]
    assert np.allclose(a.position, np.einsum("nij,nj->ni", turn[:, :3, :3], b.position) + turn[:, :3, 3], atol=1e-6)
    assert np.allclose(a.normal, -np.einsum("nij,nj->ni", turn[:, :3, :3], b.normal), atol=1e-5)


@pytest.mark.parametrize("cube_first", [False, True])
def test_a_body_that_holds_another_one_is_not_apart(sphere, cube, cube_first, tmp_path):
    """The cube has fewer points, so it is asked first, and none of them lies in the small ball."""
    sphere.save(tmp_path / "ball.vps.hdf")
    ball = vps.open(tmp_path / "ball.vps.hdf", scale=0.2)
    radius, up = 0.2 * RADIUS, 0.02
    poses = np.array([*(turned(angle, (0, 0, up)) for angle in np.linspace(0, 1, 5)), shifted(0.2, 0, 0)])
    pair = (cube, ball, poses) if cube_first else (ball, cube, np.linalg.inv(poses))
    deepest = 0.05 - up + radius  # the ball's lowest point, from the cube's upper face
    apart, points, few = vps.separation(*pair), vps.contacts(*pair), vps.contacts(*pair, most=4)
    assert np.allclose(apart.distance, [*[-deepest] * 5, 0.15 - radius], atol=2e-3)
    assert np.all(apart.lower <= apart.distance) and np.all(apart.distance <= apart.upper)
    assert np.array_equal(points.counts, [*[len(ball.points.area)] * 5, 0])
    assert np.array_equal(few.counts > 0, [True] * 5 + [False]) and np.all(few.depth[:5] > 0.03)
    for found, pose in ((apart, np.arange(5)), (points, points.pose)):
        at = found.position[:len(pose)] - (poses[pose, :3, 3] if cube_first else 0)
        assert np.allclose(np.linalg.norm(at, axis=1), radius, atol=1e-3), "on the ball"
    upwards = 1 if cube_first else -1  # out of the first body
    assert np.allclose(apart.normal[:5, 2], upwards, atol=0.05)


def test_contacts_of_all_poses_follow_each_other(sphere):
    poses = np.array([shifted(x, 0, 0) for x in (0.2, 0.09, 0.2, 0.02, 0.099)])
    many = vps.contacts(sphere, sphere, poses, threads=3)
    assert many.counts[0] == many.counts[2] == 0 and many.counts[3] > 128, "more than there is room for at first"
    assert many.depth[0] < 0 < many.depth[1] < many.depth[3]
    assert np.array_equal(np.bincount(many.pose, minlength=5), many.counts)
    for i, pose in enumerate(poses):
        one = vps.contacts(sphere, sphere, pose, threads=1)
        assert one.counts == many.counts[i] and np.isscalar(one.depth)
        for name in ("position", "normal", "penetration", "area"):
            assert np.array_equal(getattr(one, name), getattr(many, name)[many.pose == i])
    assert np.all(many.penetration >= 0) and np.all(many.area > 0)
    assert vps.contacts(sphere, sphere, poses, distance=0.005).counts.sum() > many.counts.sum()
    grid = vps.contacts(sphere, sphere, poses[:4].reshape(2, 2, 4, 4))
    assert grid.counts.shape == grid.depth.shape == (2, 2)
    assert vps.contacts(sphere, sphere, np.empty((0, 4, 4))).position.shape == (0, 3)


def test_the_few_contacts_of_a_step(cube, sphere):
    poses = np.array([shifted(0, 0, 0.2), shifted(0, 0, 0.098), shifted(0.01, 0, 0.098)])  # the sphere above the cube
    few = vps.contacts(cube, sphere, poses, most=4)
    assert few.counts[0] == 0 and few.depth[0] == 0 and np.all(few.counts[1:] >= 1) and few.counts.max() <= 4
    assert np.array_equal(np.bincount(few.pose, minlength=3), few.counts)
    for i in (1, 2):
        mine = few.pose == i
        assert few.penetration[mine][0] == few.depth[i] == few.penetration[mine].max()
        assert few.depth[i] == pytest.approx(0.002, abs=3e-4), "the points alone find 0.9 mm"
        assert few.normal[mine][0][2] > 0.99, "into the sphere"
    swapped = vps.contacts(sphere, cube, np.linalg.inv(poses), most=4)
    assert np.array_equal(swapped.counts, few.counts) and np.allclose(swapped.normal, -few.normal, atol=1e-6)
    assert np.allclose(swapped.position + poses[few.pose, :3, 3], few.position, atol=1e-6)
    assert vps.contacts(cube, sphere, poses[:2].reshape(2, 1, 4, 4), most=1).counts.shape == (2, 1)
    assert vps.contacts(cube, sphere, np.empty((0, 4, 4)), most=3).position.shape == (0, 3)
    for bad in (0, 1025, -1):
        with pytest.raises((ValueError, TypeError)):
            vps.contacts(cube, sphere, poses, most=bad)


def test_more_poses_than_one_block(sphere):
    poses = np.broadcast_to(shifted(0.099, 0, 0), (1100, 4, 4))
    found = vps.contacts(sphere, sphere, poses)
    assert np.all(found.counts == found.counts[0]) and found.counts[0] > 0
    assert len(found.pose) == found.counts.sum() and found.pose[-1] == 1099


def test_a_flying_sphere_arrives(sphere):
    impact = vps.time_of_impact(sphere, sphere, shifted(0.2, 0, 0), velocity=[-1, 0, 0])
    assert impact.hit and impact.finished
    assert 0.1 - 0.01 < impact.time <= 0.1 + 1e-3
    assert impact.separation.distance == pytest.approx(0, abs=0.01)
    past = vps.time_of_impact(sphere, sphere, shifted(0.2, 0, 0), velocity=[0, -1, 0], angular_velocity=[1, 2, 3])
    assert not past.hit and past.finished and past.time == 1
    near = vps.time_of_impact(sphere, sphere, shifted(0.2, 0, 0), velocity=[-1, 0, 0], distance=0.02)
    assert near.time == pytest.approx(impact.time - 0.02, abs=2e-3)


def test_queries_can_be_interrupted(sphere):
    """Of more poses than a minute suffices for: bodies in the same place take longest."""
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        vps.separation(sphere, sphere, np.tile(np.eye(4), (2_000_000, 1, 1)), threads=1)
    assert time.monotonic() - begin < 30


def test_many_queries_are_those_of_few(sphere, cube):
    """They are asked part by part."""
    poses = np.array([turned(0.01 * n, (0.08 + 1e-5 * n, 0, 0)) for n in range(700)])
    ones = [vps.contacts(sphere, cube, poses[n:n + 1]) for n in range(0, 700, 50)]
    all_at_once = vps.contacts(sphere, cube, poses)
    assert [one.counts[0] for one in ones] == list(all_at_once.counts[::50])
    assert np.array_equal(vps.separation(sphere, cube, poses).distance[::50],
                          [vps.separation(sphere, cube, poses[n:n + 1]).distance[0] for n in range(0, 700, 50)])
    points = np.linspace([0.06, 0, 0], [0.1, 0.01, 0], 700)
    assert np.array_equal(sphere.distance(points)[::50], [sphere.distance(p[None])[0] for p in points[::50]])
    hits = sphere.ray(points, np.tile([-1.0, 0, 0], (700, 1)), 1.0)
    assert np.array_equal(hits.distance[::50], [sphere.ray(p, [-1.0, 0, 0], 1.0).distance for p in points[::50]])
