# SPDX-License-Identifier: GPL-3.0-or-later
"""Queries of one asset for arrays of points and rays."""
import gc
import threading
import time

import numpy as np
import pytest
import vps
from conftest import RADIUS


def test_distances_are_those_of_the_sphere(sphere, points):
    true = np.linalg.norm(points, axis=-1) - RADIUS
    distance = sphere.distance(points)
    near = np.abs(true) < 1.5 * sphere.voxel_size  # where the certificate holds
    facets = 1e-4  # the mesh lies inside the sphere
    assert np.all(np.abs(distance - true)[near] <= sphere.certificate.bound + facets)
    sure = np.abs(true) > sphere.certificate.bound + facets
    assert np.array_equal(distance[sure] < 0, true[sure] < 0)
    assert distance.dtype == np.float32


@pytest.mark.parametrize("threads", [0, 1, 3])
def test_threads_do_not_change_results(sphere, points, threads):
    assert np.array_equal(sphere.distance(points, threads=threads), sphere.distance(points, threads=1))
    assert np.array_equal(sphere.closest_point(points, threads=threads).position, sphere.closest_point(points).position)


def test_leading_dimensions_are_those_of_the_result(sphere, points):
    expected = sphere.distance(points)
    assert np.array_equal(sphere.distance(points.reshape(50, 100, 3)), expected.reshape(50, 100))
    assert sphere.gradient(points.reshape(50, 100, 3)).shape == (50, 100, 3)
    one = sphere.distance(points[7])
    assert np.isscalar(one) and one == expected[7]
    assert sphere.gradient([0.0, 0, 1]).shape == (3,)
    assert sphere.closest_point(points[7]).position.shape == (3,)
    assert sphere.distance(np.empty((0, 3))).shape == (0,)
    assert sphere.ray(np.empty((0, 3)), [0, 0, 1]).hit.shape == (0,)
    assert sphere.closest_point(np.empty((4, 0, 3))).position.shape == (4, 0, 3)


def test_any_strides_and_types_give_the_same(sphere, points):
    expected = sphere.distance(points)
    single = points.astype(np.float32)
    read_only = single.copy()
    read_only.flags.writeable = False
    wide = np.zeros((len(points), 7), np.float32)
    wide[:, 2:5] = single
    for same in (single, read_only, wide[:, 2:5], np.asfortranarray(points), np.asfortranarray(single),
                 single.astype(">f4"), single.astype(np.longdouble), points.tolist()):
        assert np.array_equal(sphere.distance(same), expected)
    assert np.array_equal(sphere.distance(single[::-3]), expected[::-3])
    assert np.array_equal(sphere.distance(np.broadcast_to(single[3], (9, 3))), np.full(9, expected[3]))
    misaligned = np.frombuffer(b"\0" + single.tobytes(), np.uint8)[1:].view(np.float32).reshape(-1, 3)
    assert np.array_equal(sphere.distance(misaligned), expected)
    assert sphere.distance([0, 0, 1]) == sphere.distance([0.0, 0.0, 1.0])  # integers


def test_the_gradient_is_that_of_the_distance(sphere, points):
    shell = points[np.abs(np.linalg.norm(points, axis=-1) - RADIUS) < sphere.voxel_size]
    gradient = sphere.gradient(shell)
    assert np.allclose(np.linalg.norm(gradient, axis=-1), 1, atol=1e-3)
    out = shell / np.linalg.norm(shell, axis=-1, keepdims=True)
    assert np.median(np.sum(gradient * out, axis=-1)) > 0.99


def test_closest_points_lie_on_the_surface(sphere, points):
    found = sphere.closest_point(points)
    at = found.position[found.converged]
    assert found.converged.mean() > 0.95
    assert np.all(np.abs(np.linalg.norm(at, axis=-1) - RADIUS) < 2 * sphere.certificate.bound)
    assert np.array_equal(found.inside, sphere.distance(points) <= 0)
    true = np.abs(np.linalg.norm(points, axis=-1) - RADIUS)
    assert np.all(found.lower <= true + 1e-4) and np.all(true <= found.upper + 1e-4)


def test_rays_hit_the_sphere(sphere):
    y = np.linspace(-0.08, 0.08, 33)
    origins = np.stack([np.full(33, -0.2), y, np.zeros(33)], axis=-1)
    hits = sphere.ray(origins, [2.0, 0, 0])
    through = np.abs(y) < 0.95 * RADIUS
    assert np.all(hits.hit[through]) and not np.any(hits.hit[np.abs(y) > 1.05 * RADIUS])
    true = 0.2 - np.sqrt(RADIUS**2 - y[through] ** 2)
    assert np.allclose(hits.distance[through], true, atol=4 * sphere.certificate.bound)
    assert np.all(np.isinf(hits.distance[~hits.hit])) and np.all(np.isnan(hits.position[~hits.hit]))
    assert np.all(hits.normal[through][:, 0] < 0)
    assert not np.any(sphere.ray(origins, [2.0, 0, 0], 0.1).hit)
    one = sphere.ray([-0.2, 0, 0], [1, 0, 0])
    assert one.hit and one.position.shape == (3,)
    assert sphere.ray(origins[:, None], np.eye(3)).hit.shape == (33, 3)  # all pairs


def test_points_share_memory_and_outlive_the_asset(sphere):
    with vps.open(bytes(sphere._bytes)) as asset:
        points = asset.points
        assert np.shares_memory(points.position, asset.points.position)
        assert np.shares_memory(points.position.base, points.area.base)
        with pytest.raises(ValueError):
            points.position[0] = 0
    del asset
    gc.collect()
    assert np.allclose(np.linalg.norm(points.position, axis=-1), RADIUS, atol=1e-3)
    assert np.isclose(points.area.sum(), 4 * np.pi * RADIUS**2, rtol=0.02)
    assert np.all(np.sum(points.position * points.inward_normal, axis=-1) < 0)


def test_facts(sphere, cube):
    assert np.allclose(cube.bounds, [[-0.05] * 3, [0.05] * 3])
    assert cube.volume == pytest.approx(1e-3) and cube.surface_area == pytest.approx(0.06)
    mass = cube.mass_properties(2000)
    assert mass.mass == pytest.approx(2)
    assert np.allclose(mass.centre_of_mass, 0, atol=1e-12)
    assert np.allclose(mass.inertia, np.eye(3) * 2 * 0.1**2 / 6)
    certificate = sphere.certificate
    assert certificate.field == "scaled" and 0 < certificate.rms <= certificate.max <= certificate.bound
    assert "5000" not in repr(cube) and "100 x 100 x 100 mm" in repr(cube)


def test_a_scale_multiplies_lengths(sphere, points):
    with vps.open(bytes(sphere._bytes), scale=3) as large:
        with pytest.raises(ValueError, match="scale of 3"):
            large.save("large.vps.hdf")
        assert large.scale == 3 and large.voxel_size == pytest.approx(3 * sphere.voxel_size)
        assert np.allclose(large.distance(3 * points), 3 * sphere.distance(points), rtol=1e-3, atol=1e-6)
        assert np.allclose(large.surface(8e-3).vertices, 3 * sphere.surface(8e-3 / 3).vertices, atol=1e-5)


def test_the_surface_is_closed_and_lies_on_the_field(sphere):
    surface = sphere.surface()
    assert np.all(np.abs(sphere.distance(surface.vertices)) < 1e-4)
    edges = np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=-1)
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0)
    assert len(sphere.surface(16e-3).faces) < len(surface.faces)


def test_other_threads_run_during_a_query(sphere):
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (300_000, 3))
    worker = threading.Thread(target=sphere.closest_point, args=(points,), kwargs={"threads": 1})
    worker.start()
    ticks = 0
    while worker.is_alive():
        time.sleep(1e-3)
        ticks += 1
    assert ticks > 10


def test_an_asset_may_be_closed_during_a_query(sphere):
    asset = vps.open(bytes(sphere._bytes))
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (100_000, 3))
    expected = asset.distance(points[:10])
    found = []
    worker = threading.Thread(target=lambda: found.append(asset.closest_point(points, threads=1)))
    worker.start()
    time.sleep(0.01)
    asset.close()
    worker.join()
    assert len(found) == 1 and np.array_equal(sphere.distance(points[:10]), expected)
