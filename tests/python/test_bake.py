# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking from arrays, objects and files; the baker's module is a part of its own."""
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import vps
from conftest import MESHES, read_obj


def same(a, b):
    return bytes(a._bytes) == bytes(b._bytes)


def test_arrays_objects_and_scaled_units_give_the_same_bytes():
    vertices, faces = read_obj("gear.obj")
    asset = vps.bake(vertices, faces, voxel=1e-3)
    assert same(asset, vps.bake(SimpleNamespace(vertices=vertices, faces=faces), voxel=1e-3))
    assert same(asset, vps.bake(np.asfortranarray(vertices), faces.astype(np.uint16), voxel=1e-3))
    assert same(asset, vps.bake(vertices.tolist(), faces.tolist(), voxel=1e-3))
    inches = vps.bake(vertices / 0.0254, faces, voxel=1e-3, unit=0.0254)
    assert np.allclose(inches.bounds, asset.bounds, atol=1e-12)


def test_files_give_what_arrays_give():
    vertices, faces = read_obj("gear.obj")
    asset, of_file = vps.bake(vertices, faces, voxel=1e-3), vps.bake(str(MESHES / "gear.obj"), voxel=1e-3)
    points = np.random.default_rng(0).uniform(asset.bounds[0], asset.bounds[1], (1000, 3))
    assert np.array_equal(asset.distance(points), of_file.distance(points))


def test_a_saved_asset_opens_from_a_path_and_from_bytes(tmp_path, cube):
    path = tmp_path / "cube.vps.hdf"
    cube.save(path)
    data = path.read_bytes()
    for source in (path, str(path), data, bytearray(data), memoryview(data), np.frombuffer(data, np.uint8),
                   memoryview(b"123" + data)[3:]):
        with vps.open(source) as asset:
            asset.verify()
            assert asset.volume == pytest.approx(cube.volume) and same(asset, cube)


def test_saving_replaces_assets_alone(tmp_path, cube, sphere, points):
    path = tmp_path / "cube.vps.hdf"
    sphere.save(path)
    cube.save(path)
    (tmp_path / "link.vps.hdf").symlink_to(path)
    with vps.open(path) as asset:
        before = asset.distance(points)
        for its_own in (path, tmp_path / "link.vps.hdf"):
            asset.save(its_own)
            assert path.read_bytes() == bytes(cube._bytes)
        sphere.save(path)
        assert np.array_equal(asset.distance(points), before)
    assert same(vps.open(path), sphere) and (tmp_path / "link.vps.hdf").is_symlink()
    (tmp_path / "notes.txt").write_text("precious, and longer than a magic number")
    (tmp_path / "empty").touch()
    (tmp_path / "folder").mkdir()
    kept = sorted(tmp_path.iterdir())
    for name in ("notes.txt", "empty", "folder"):
        with pytest.raises(FileExistsError, match=f"exists and is not an asset.*{name}"):
            cube.save(tmp_path / name)
    with pytest.raises(FileNotFoundError, match="none/cube.vps.hdf"):
        cube.save(tmp_path / "none" / "cube.vps.hdf")
    with pytest.raises(NotADirectoryError, match="notes.txt/cube.vps.hdf"):
        cube.save(tmp_path / "notes.txt" / "cube.vps.hdf")
    assert (tmp_path / "notes.txt").read_text().startswith("precious") and sorted(tmp_path.iterdir()) == kept


def test_a_write_that_fails_leaves_the_old_file(tmp_path, cube, sphere):
    path = tmp_path / "cube.vps.hdf"
    cube.save(path)
    program = """
import resource, signal, sys, vps
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
asset = vps.open(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    asset.save(sys.argv[2])
except OSError as error:
    print(error)
"""
    sphere.save(tmp_path / "sphere.vps.hdf")
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path / "sphere.vps.hdf"), str(path)], capture_output=True,
                          text=True, check=False)
    assert path.read_bytes() == bytes(cube._bytes) and len(list(tmp_path.iterdir())) == 2
    assert "File too large" in done.stdout and str(path) in done.stdout, done.stderr


def test_changing_the_bytes_of_an_open_asset_changes_nothing(cube, points):
    data = bytearray(bytes(cube._bytes))
    asset = vps.open(data)
    data[:] = bytes(len(data))
    assert np.array_equal(asset.distance(points), cube.distance(points))


def test_options(tmp_path):
    vertices, faces = read_obj("cube.obj")
    asset = vps.bake(vertices, faces, resolution=10, real=True, cache=tmp_path / "cache")
    assert asset.certificate.field == "real" and asset.voxel_size == pytest.approx(0.01)
    assert len(list((tmp_path / "cache").rglob("*.vps.hdf"))) == 1
    assert same(asset, vps.bake(vertices, faces, resolution=10, real=True, cache=tmp_path / "cache"))
    (tmp_path / "file").touch()
    note, = vps.bake(vertices, faces, resolution=10, cache=tmp_path / "file").notes
    assert note.startswith(f"{tmp_path / 'file'}: ") and note.endswith("the asset is not kept there")
    assert vps.bake(vertices, faces, max_error=2e-3).certificate.bound <= 2e-3
    open_box = faces[1:]
    closed = vps.bake(vertices, open_box, voxel=20e-3, repair="fill")
    assert closed.volume == pytest.approx(1e-3) and closed.notes


def test_options_of_accuracy_and_cost():
    gear = MESHES / "gear.obj"
    plain = vps.bake(gear, resolution=40)
    assert len(vps.bake(gear, resolution=40, thin_faces=4).points.area) < 0.8 * len(plain.points.area)
    assert vps.bake(gear, resolution=40, field_error=0.02).certificate.bound < 0.8 * plain.certificate.bound
    assert vps.bake(gear, resolution=40, prove_bound=True).certificate.bound > plain.certificate.bound
    wide = vps.bake(gear, resolution=40, band_inside=4, band_outside=3)
    assert not same(wide, plain)
    assert same(wide, vps.bake(gear, resolution=40, band_inside=4, band_outside=3, threads=1, memory=1e9))


def test_meshes_that_cannot_be_baked_say_why(tmp_path):
    vertices, faces = read_obj("cube.obj")
    with pytest.raises(vps.BakeError, match=";") as raised:
        vps.bake(vertices, faces[1:], voxel=0.01, repair="none")
    assert raised.value.stage
    assert re.search(r"repair=fill, .*sheet_thickness=0\.02 ", str(raised.value))  # as vps.bake names them, in metres
    with pytest.raises(vps.BakeError, match=r"unit right\? \(unit\)"):
        vps.bake(vertices, faces, voxel=1)
    assert same(vps.bake(vertices, faces, voxel=0.01), vps.bake(vertices, faces, voxel=0.01, memory=1e30))
    with pytest.raises(vps.BakeError, match="a higher memory$"):
        vps.bake(vertices, faces, voxel=1e-3, memory=1e6)
    with pytest.raises(vps.BakeError, match="choose a larger max_error or a higher memory$"):
        vps.bake(vertices, faces, max_error=1e-6, memory=2e7)
    with pytest.raises(vps.BakeError, match="no_such.obj") as raised:
        vps.bake(tmp_path / "no_such.obj", voxel=0.01)
    assert raised.value.stage == "import"
    with pytest.raises(vps.BakeError):
        vps.bake(np.full((3, 3), np.nan), [[0, 1, 2]], voxel=0.01)
    with pytest.raises(vps.BakeError):
        vps.bake(np.empty((0, 3)), np.empty((0, 3), int), voxel=0.01)
    with pytest.raises(ValueError, match=r"faces\[1\] names vertex 8 of 8"):
        vps.bake(vertices, [[0, 1, 2], [0, 1, 8]], voxel=0.01)
    with pytest.raises(ValueError):
        vps.bake(vertices, [[0, 1, -1]], voxel=0.01)


@pytest.mark.parametrize(("arguments", "error", "text"), [
    ({}, ValueError, "one of voxel, resolution and max_error"),
    ({"voxel": 0.01, "resolution": 10}, ValueError, "one of voxel, resolution and max_error"),
    ({"voxel": 0.01, "layer": True}, TypeError, "no option 'layer'"),
    ({"voxel": 0.01, "repair": "glue"}, ValueError, "none, weld, stitch, fill, wrap, automatic"),
    ({"voxel": -1.0}, ValueError, "voxel: finite and more than 0"),
    ({"voxel": np.nan}, ValueError, "voxel"),
    ({"voxel": "5mm"}, TypeError, "voxel: a number, not '5mm'"),
    ({"resolution": 10.5}, TypeError, "resolution: a whole number"),
    ({"voxel": 0.01, "memory": "1GB"}, TypeError, "memory: a number, not '1GB'"),
    ({"voxel": 0.01, "threads": -1}, ValueError, "threads: 0 to 1024"),
    ({"voxel": 0.01, "thin_faces": 9}, vps.BakeError, "thin_faces is out of range"),
    ({"resolution": 2**40}, ValueError, "resolution: 1 to 8192"),
    ({"voxl": 0.01}, TypeError, "no option 'voxl'"),
    ({"voxel": 0.01, "unit": 0}, ValueError, "unit"),
    ({"voxel": 0.01, "faces": np.zeros((2, 3))}, TypeError, "integers"),
    ({"voxel": 0.01, "faces": [[0, 1, 2, 3]]}, ValueError, "shape"),
    ({"voxel": 0.01, "faces": None}, TypeError, "vertices and faces"),
])
def test_wrong_arguments_say_what_is_wrong(arguments, error, text):
    vertices, faces = read_obj("cube.obj")
    with pytest.raises(error, match=text):
        vps.bake(vertices, **{"faces": faces, **arguments})


@pytest.mark.parametrize("size", [{"resolution": 400}, {"max_error": 2e-5}])
def test_a_bake_can_be_interrupted(tmp_path, size):
    """An asset in the cache would show that the bake went on to its end."""
    vertices, faces = read_obj("icosphere.obj")
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        vps.bake(vertices, faces, cache=tmp_path / "cache", **size)
    assert not list((tmp_path / "cache").rglob("*.hdf"))


def test_without_its_other_modules_the_package_works(tmp_path, cube):
    """And messages say what is missing."""
    shutil.copytree(Path(vps.__file__).parent, tmp_path / "vps", ignore=shutil.ignore_patterns("_bake*", "_bullet*"))
    cube.save(tmp_path / "cube.vps.hdf")
    program = """
import vps
from vps import *
with vps.open("cube.vps.hdf") as cube:
    print(cube.distance([0, 0, 0.06]))
    for call in (lambda: cube.surface(), lambda: vps.bake("cube.obj", voxel=1e-3), lambda: vps.World()):
        try:
            call()
        except ImportError as error:
            print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)},
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    distance, surface, bake, world = done.stdout.splitlines()
    assert float(distance) == pytest.approx(0.01, abs=1e-3)
    assert surface.startswith("Asset.surface needs the baker's module") and "python3-vps-bake" in surface
    assert bake.startswith("vps.bake needs the baker's module")
    assert world.startswith("vps.World needs the module vps._bullet") and "python3-vps-bullet" in world
