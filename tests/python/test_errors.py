# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input raises an exception that says what is wrong; nothing crashes."""
import copy
import inspect
import os
import pickle
import re

import numpy as np
import pytest
import vps
from conftest import MESHES, shifted


@pytest.mark.parametrize("query", ["distance", "gradient", "closest_point"])
def test_bad_points(sphere, query, points):
    ask = getattr(sphere, query)
    for bad in (np.nan, np.inf, 1e300):
        points[4321, 1] = points[4900, 0] = bad
        with pytest.raises(ValueError, match="number 4321"):
            ask(points)
    for shape in ((3, 5), (3, 4), (), (0,), (2, 0)):
        with pytest.raises(ValueError, match="shape"):
            ask(np.zeros(shape))
    for wrong in (["a", "b", "c"], np.zeros(3, complex), np.zeros(3, bool), [None] * 3, "abc", {}):
        with pytest.raises(TypeError, match="numbers are needed"):
            ask(wrong)
    for far in (np.nan, 1e20):
        _one_line(ValueError, "points number 1: coordinates are finite, at most 1e15 m", lambda far=far: ask([[0, 0, 0], [0, far, 0]]))
    for threads in (-1, 2000, 2**40, 1.5, "2"):
        with pytest.raises((TypeError, ValueError)):
            ask(np.zeros(3), threads=threads)


def test_bad_rays(sphere):
    for direction in ([0, 0, 0], [0, 0, np.nan], [np.inf, 0, 0]):
        with pytest.raises(ValueError, match="direction"):
            sphere.ray([0.0, 0, 0], direction)
    with pytest.raises(ValueError, match="directions number 2"):
        sphere.ray(np.zeros((4, 3)), [[0, 0, 1], [1, 0, 0], [0, 0, 0], [np.nan, 0, 0]])
    for length in (1e-200, 1e200):
        assert np.isclose(sphere.ray([0.0, 0, 1], [0, 0, -length]).distance, sphere.ray([0.0, 0, 1], [0, 0, -1]).distance)
    _one_line(ValueError, "rays number 0: origins are at most 1e6 m away, and max_distance is at least 0",
              lambda: sphere.ray([1e20, 0, 0], [0, 0, 1]))
    for arguments in (([np.nan, 0, 0], [0, 0, 1]), ([0, 0, 0], [0, 0, 1], -1.0), ([0, 0, 0], [0, 0, 1], np.nan),
                      (np.zeros((2, 3)), np.ones((3, 3))), (np.zeros((2, 3)), [0, 0, 1], [1.0, 2, 3])):
        with pytest.raises(ValueError):
            sphere.ray(*arguments)


def test_bad_poses(sphere):
    good = shifted(0.1, 0, 0)
    for query in (vps.contacts, vps.separation, vps.time_of_impact):
        for row, column, value in ((0, 0, 2.0), (1, 3, np.nan), (3, 0, 1.0), (3, 3, 2.0), (0, 3, 1e300)):
            bad = good.copy()
            bad[row, column] = value
            with pytest.raises(ValueError):
                query(sphere, sphere, bad)
        with pytest.raises(ValueError, match="shape"):
            query(sphere, sphere, np.eye(3))
        with pytest.raises(TypeError, match="vps.Asset is needed"):
            query(sphere, "sphere", good)
    with pytest.raises(ValueError, match="number 2"):
        vps.separation(sphere, sphere, [good, good, 2 * good - good * np.diag([0, 0, 0, 1]), good])
    _one_line(ValueError, "poses number 0: a pose is not finite, not a rotation or farther than 1e12 m",
              lambda: vps.separation(sphere, sphere, shifted(1e20, 0, 0)))
    many = np.tile(good, (1000, 1, 1))
    many[700, 0, 3] = np.nan
    for query in (vps.contacts, vps.separation):
        _one_line(ValueError, "poses number 700: ", lambda query=query: query(sphere, sphere, many))
    _one_line(ValueError, "tolerance: finite and more than 0, not 0.0",
              lambda: vps.time_of_impact(sphere, sphere, good, tolerance=0.0))
    with pytest.raises(ValueError, match="poses number 1: its last row"):
        vps.separation(sphere, sphere, [good, 2 * good, good, 2 * good])
    for bad in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError):
            vps.contacts(sphere, sphere, good, distance=bad)
        with pytest.raises(ValueError):
            vps.separation(sphere, sphere, good, tolerance=bad)
        with pytest.raises(ValueError):
            vps.time_of_impact(sphere, sphere, good, velocity=[bad, 0, 0], duration=bad)
    with pytest.raises(ValueError, match=r"\(4, 4\)"):
        vps.time_of_impact(sphere, sphere, [good, good])


def test_missing_parts(sphere, cube, layers):
    only_map = vps.bake(*_cube_mesh(), voxel=0.02, pointshell=False)
    only_shell = vps.bake(*_cube_mesh(), voxel=0.02, voxelmap=False)
    for query in (layers.distance, layers.closest_point, only_shell.distance, only_shell.gradient):
        with pytest.raises(vps.MissingPart, match="bake it with"):
            query([0.0, 0, 0])
    assert np.isclose(np.linalg.norm(layers.gradient([0.0, 0, 0.06])), 1)
    for lacking in (lambda: only_map.points, lambda: only_shell.certificate):
        with pytest.raises(vps.MissingPart, match="bake it with"):
            lacking()
    pose = shifted(0.08, 0, 0)
    assert vps.separation(only_map, only_shell, pose).distance < 0
    assert vps.separation(only_shell, only_map, pose).distance < 0
    for first, second in ((only_map, only_map), (only_shell, only_shell)):
        for query in (vps.contacts, vps.separation, vps.time_of_impact):
            with pytest.raises(vps.MissingPart):
                query(first, second, pose)
    with pytest.raises(vps.MissingPart):
        vps.time_of_impact(only_shell, only_map, pose)


def _cube_mesh():
    from conftest import read_obj

    return read_obj("cube.obj")


def test_closed_assets(cube):
    asset = vps.open(bytes(cube._bytes))
    asset.close()
    asset.close()
    assert asset.closed and repr(asset) == "<vps.Asset, closed>"
    pose = shifted(0.1, 0, 0)
    for use in (lambda: asset.distance([0.0, 0, 0]), lambda: asset.points, lambda: asset.bounds, lambda: asset.certificate,
                asset.verify, asset.surface, lambda: asset.save("x"), lambda: asset.mass_properties(1.0),
                lambda: vps.contacts(asset, cube, pose), lambda: vps.separation(cube, asset, pose)):
        with pytest.raises(ValueError, match="the asset is closed"):
            use()


def test_assets_go_to_other_processes_as_files(cube):
    for give in (pickle.dumps, copy.deepcopy):
        _one_line(TypeError, "a vps.Asset cannot be pickled; save it, and vps.open the file there", lambda give=give: give(cube))


def test_files_and_bytes_that_are_no_asset(tmp_path, cube):
    with pytest.raises(FileNotFoundError):
        vps.open(tmp_path / "none.vps.hdf")
    with pytest.raises(IsADirectoryError):
        vps.open(tmp_path)
    empty = tmp_path / "empty.vps.hdf"
    empty.write_bytes(b"")
    data = bytes(cube._bytes)
    for source in (empty, b"", b"text", data[:-1], data[:5000], data + b"\0", bytes(len(data))):
        with pytest.raises(vps.AssetError):
            vps.open(source)
    damaged = tmp_path / "damaged.vps.hdf"
    damaged.write_bytes(data[:5000])
    for path in (empty, damaged):
        with pytest.raises(vps.AssetError, match=re.escape(f"{path}: ")):
            vps.open(path)
    for source in (None, 7, 1.5, [1, 2, 3]):
        with pytest.raises(TypeError, match="a path or bytes are needed"):
            vps.open(source)
    for scale in (0, -1, np.nan, 1e9):
        with pytest.raises(ValueError, match="scale"):
            vps.open(data, scale=scale)
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 1
    asset = vps.open(damaged)
    with pytest.raises(vps.AssetError):
        asset.verify()


def test_bad_densities_and_steps(cube):
    for density in (0, -1, np.nan, np.inf):
        with pytest.raises(ValueError, match="density"):
            cube.mass_properties(density)
    for step in (0.0, -1.0, np.nan, 1e-9, 1e30):
        with pytest.raises(ValueError):
            cube.surface(step)
    with pytest.raises(ValueError, match="choose a step of a quarter of a voxel or more"):
        cube.surface(1e-9)


def test_everything_public_has_a_docstring():
    for name in vps.__all__:
        thing = getattr(vps, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    assert inspect.getdoc(value) or member in ("closed", "stage"), f"{name}.{member}"


def _one_line(error, text, call):
    with pytest.raises(error, match=text) as raised:
        call()
    assert "\n" not in str(raised.value)


def test_wrong_scales_and_files_that_are_no_regular_files(tmp_path, cube):
    for scale in ("2", None, [2], np.ones(2)):
        _one_line(TypeError, "scale: a number", lambda scale=scale: vps.open(bytes(cube._bytes), scale=scale))
    pipe = tmp_path / "pipe.vps.hdf"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/null"):
        _one_line(OSError, f"not a regular file.*{re.escape(str(path))}", lambda path=path: vps.open(path))


def test_options_of_bakes_of_a_wrong_type():
    mesh = MESHES / "cube.obj"
    for options, error, text in (
            ({"unit": "mm"}, TypeError, "unit: a number, not 'mm'"), ({"repair": 5}, TypeError, "repair: 5 "),
            ({"layers": "yes"}, TypeError, "layers: 'yes' "), ({"nonsense": None}, TypeError, "no option 'nonsense'"),
            ({"sheet_thickness": -1}, ValueError, "sheet_thickness: finite"),
            ({"sheet_thickness": np.nan}, ValueError, "sheet_thickness: finite"),
            ({"faces": [[0, 1, 2]]}, TypeError, "faces: a mesh file has its own")):
        _one_line(error, text, lambda options=options: vps.bake(mesh, voxel=0.01, **options))
    _one_line(ValueError, "resolution: 1 to 8192", lambda: vps.bake(mesh, resolution=10**30))


def test_numbers_of_queries_that_are_no_numbers(sphere):
    pose, point = np.eye(4), np.zeros(3)
    for query in (lambda **bad: sphere.distance(point, **bad), lambda **bad: sphere.gradient(point, **bad),
                  lambda **bad: sphere.closest_point(point, **bad), lambda **bad: sphere.ray(point, [0, 0, 1], **bad),
                  lambda **bad: vps.contacts(sphere, sphere, pose, **bad),
                  lambda **bad: vps.contacts(sphere, sphere, pose, most=2, **bad),
                  lambda **bad: vps.separation(sphere, sphere, pose, **bad)):
        for error, threads in ((TypeError, "2"), (TypeError, 1.5), (ValueError, -1), (ValueError, 10**30)):
            _one_line(error, "threads: ", lambda query=query, threads=threads: query(threads=threads))
    for query, name in ((vps.contacts, "distance"), (vps.separation, "tolerance"), (vps.time_of_impact, "duration"),
                        (vps.time_of_impact, "distance"), (vps.time_of_impact, "tolerance")):
        for error, bad in ((TypeError, "x"), (TypeError, None), (ValueError, -1), (ValueError, np.inf)):
            _one_line(error, f"{name}: ", lambda query=query, name=name, bad=bad: query(sphere, sphere, pose, **{name: bad}))
    for error, most in ((TypeError, "x"), (TypeError, 1.5), (ValueError, 0), (ValueError, -1), (ValueError, 10**30)):
        _one_line(error, "most: ", lambda most=most: vps.contacts(sphere, sphere, pose, most=most))
    _one_line(TypeError, "density: a number", lambda: sphere.mass_properties("x"))
    _one_line(TypeError, "step: a number", lambda: sphere.surface("x"))


def test_numbers_from_numpy_are_numbers(cube):
    poses = np.eye(4)
    for distance in (np.float32(1e-3), np.array(1e-3), 0):
        vps.contacts(cube, cube, poses, distance=distance)
    for distance in ("1mm", None, [1e-3], np.array([1e-3])):
        with pytest.raises(TypeError, match="^distance: a number, not"):
            vps.contacts(cube, cube, poses, distance=distance)
