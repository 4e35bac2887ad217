# SPDX-License-Identifier: Zlib
"""Collision queries on baked assets: signed distances, closest points, rays, contacts, separation, time of impact.

    import numpy as np
    import vps

    nut = vps.bake("nut.obj", voxel=0.25e-3)      # or vps.bake(vertices, faces, ...), or a trimesh
    bolt = vps.open("bolt.vps.hdf")               # baked before, by vpsbake or nut.save(...)

    nut.distance(points)                          # (n,) signed distances, negative inside [m]
    nut.closest_point(points).position            # (n, 3) [m]
    nut.ray(origins, directions).distance         # (n,) inf: no hit [m]
    vps.separation(bolt, nut, poses).distance     # (n,) for n poses of the nut in the bolt's frame [m]
    vps.contacts(bolt, nut, poses).normal         # (k, 3) [-]

SI units: metres, kilograms, seconds, radians. Frames are right-handed. The asset frame is that of the mesh.

Arrays: any shape (..., 3) of points, any shape (..., 4, 4) of poses, float or int, of any strides. Leading dimensions are
those of the results, so one point gives a number. Queries compute in float32; contiguous float32 points are not copied.
Pose matrices take the second body's frame to the first's: p_first = pose @ (p_second, 1).

Threads: queries release the interpreter's lock and use `threads` threads (0: as many as the machine has), with the same
results for any number. Assets may be used by any number of Python's threads.

Errors: ValueError and TypeError for arguments, with the index of the first bad element; OSError for files; AssetError for
bytes that are no asset; MissingPart for what an asset was baked without; BakeError for meshes that cannot be read or baked.
`vps.bake` and `Asset.surface` need the baker's module, which is a part of its own under the GPL, and `vps.World`, a small
Bullet world for trying assets, that of the plug-in for Bullet.
"""
from __future__ import annotations

import builtins
import contextlib
import errno
import mmap
import os
import stat
import uuid
from typing import Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _runtime
from ._arguments import at_least_0, number, numbers, one_array, whole
from ._runtime import AssetError, MissingPart, __version__
from ._world import Body, Joint, World, WorldContacts

__all__ = [
    "Asset", "AssetError", "BakeError", "Body", "Certificate", "ClosestPoints", "Contacts", "Impact", "Joint",
    "MassProperties", "MissingPart", "Points", "RayHits", "Separation", "Surface", "World", "WorldContacts", "bake",
    "contacts", "open", "separation", "time_of_impact",
]

for _public in (AssetError, MissingPart, Body, Joint, World, WorldContacts):
    _public.__module__ = __name__
AssetError.__doc__ = "The bytes are no asset of this version, or they are damaged."
MissingPart.__doc__ = "The asset was baked without the part that a query needs."


class BakeError(ValueError):
    """A mesh or setting that cannot be baked: the reason, and what to do."""

    stage: str = ""  #: import, one of the bake's, or write


Array = npt.NDArray[Any]
Path = Union[str, "os.PathLike[str]"]


class Certificate(NamedTuple):
    """Error of an asset's field against its mesh, measured in the narrow band when it was baked. [m]"""

    field: str  #: "scaled", "real" or "layers"
    max: float  #: largest error found
    rms: float  #: root mean square
    p99: float  #: 99 % of the samples have at most this error
    bound: float  #: error that queries allow for, at least `max`
    worst_at: Array  #: where `max` was found, shape (3,)


class MassProperties(NamedTuple):
    """Of a body of uniform density, in the asset frame."""

    mass: float  #: [kg]
    centre_of_mass: Array  #: shape (3,) [m]
    inertia: Array  #: about the centre of mass, shape (3, 3) [kg m^2]


class Points(NamedTuple):
    """The pointshell: samples of the surface."""

    position: Array  #: shape (n, 3) [m]
    inward_normal: Array  #: unit, into the body, shape (n, 3)
    area: Array  #: surface area that each point represents, shape (n,) [m^2]


class Surface(NamedTuple):
    """Triangles, counter-clockwise seen from outside."""

    vertices: Array  #: shape (n, 3) [m]
    faces: Array  #: shape (m, 3)


class ClosestPoints(NamedTuple):
    """Surface points near query points of shape (...)."""

    position: Array  #: on the surface, shape (..., 3) [m]
    normal: Array  #: out of the body there, unit, shape (..., 3)
    distance: Array  #: from the query point, never negative [m]
    lower: Array  #: lower bound of the true distance to the surface [m]
    upper: Array  #: upper bound of the true distance to the surface [m]
    inside: Array  #: whether the query point is inside
    converged: Array  #: False: only `inside`, `lower` and `upper` hold


class RayHits(NamedTuple):
    """First hits of rays of shape (...)."""

    hit: Array  #: whether there is one
    distance: Array  #: from the origin; inf without a hit [m]
    position: Array  #: shape (..., 3); NaN without a hit [m]
    normal: Array  #: out of the body there, unit, shape (..., 3); zero without a hit


class Contacts(NamedTuple):
    """Contacts of k points over poses of shape (...), in the first body's frame."""

    pose: Array  #: index of each contact's pose, ascending, shape (k,); of the flattened poses
    position: Array  #: shape (k, 3) [m]
    normal: Array  #: unit, from the first body into the second, shape (k, 3)
    penetration: Array  #: positive inside, shape (k,) [m]
    area: Array  #: surface area of the contact's point; 0: it is at none, shape (k,) [m^2]
    counts: Array  #: contacts of each pose, shape (...)
    depth: Array  #: largest penetration of each pose; negative: the bodies are at least this far apart, shape (...) [m]


class Separation(NamedTuple):
    """Distances of pairs over poses of shape (...), in the first body's frame."""

    distance: Array  #: between the surfaces, as sampled; negative: depth [m]
    lower: Array  #: lower bound of the true distance [m]
    upper: Array  #: upper bound of the true distance [m]
    position: Array  #: nearest or deepest point of the body with fewer points, shape (..., 3) [m]
    normal: Array  #: unit, from the first body to the second, shape (..., 3); zero where the field has none


class Impact(NamedTuple):
    """When a moving body arrives."""

    hit: bool  #: whether the bodies may be at `distance` at `time`
    time: float  #: there is no impact before it [s]
    finished: bool  #: False: the search was cut short at `time`
    separation: Separation  #: the last one computed, in the first body's frame


class Asset:
    """A baked body, from `vps.open` or `vps.bake`.

    Closing it, or leaving a `with` block, lets go of its bytes as soon as running queries and its arrays are done with them.
    """

    def __init__(self, source: Any, *, scale: float = 1.0, notes: list[str] | None = None) -> None:
        self._bytes = _asset_bytes(source)
        try:
            self._asset = _runtime.Asset(self._bytes, number("scale", scale))
        except AssetError as error:
            if not isinstance(source, (str, os.PathLike)):
                raise
            raise AssetError(f"{os.fspath(source)}: {error}") from None
        self._baked: Any = None  # its shape in Bullet, see World.add
        self.notes = notes or []  #: of the bake: what was repaired, and warnings

    def __repr__(self) -> str:
        if self.closed:
            return "<vps.Asset, closed>"
        size = " x ".join(f"{1e3 * length:.4g}" for length in np.diff(self.bounds, axis=0)[0])
        return f"<vps.Asset of {size} mm, voxels of {1e3 * self.voxel_size:.4g} mm, {self._info['points']} points>"

    def __enter__(self) -> Asset:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> Any:
        raise TypeError("a vps.Asset cannot be pickled; save it, and vps.open the file there")

    def close(self) -> None:
        """Queries of a closed asset raise ValueError. Its arrays stay valid."""
        self._asset.close()
        self._bytes = self._baked = None

    @property
    def closed(self) -> bool:
        return self._asset.closed

    @property
    def _info(self) -> Any:
        return self._asset.info()[0]

    def distance(self, points: npt.ArrayLike, *, threads: int = 0) -> Array:
        """Signed distance of points to the surface: negative inside, positive outside.

        points: shape (..., 3), asset frame [m]
        return: shape (...) [m]. Within 1.4 voxels of the surface (default bands) its error is at most `certificate.bound`. Beyond that
            it comes from a coarser grid, and far outside it is never more than the true distance. The sign is right everywhere.
        """
        rows, shape = _rows("points", points)
        return _shaped(self._asset.distance(rows, _threads(threads)), shape)

    def gradient(self, points: npt.ArrayLike, *, threads: int = 0) -> Array:
        """Gradient of `distance`: the unit direction out of the body; zero only where the field has no slope.

        points: shape (..., 3), asset frame [m]
        return: shape (..., 3)
        """
        rows, shape = _rows("points", points)
        return _shaped(self._asset.gradient(rows, _threads(threads)), shape)

    def closest_point(self, points: npt.ArrayLike, *, threads: int = 0) -> ClosestPoints:
        """Surface points that are closest to points, by a walk: the nearest one where `distance` equals `lower`.

        points: shape (..., 3), asset frame, no coordinate beyond 1e15 [m]
        """
        rows, shape = _rows("points", points)
        found = self._asset.closest_point(rows, _threads(threads))
        return ClosestPoints(
            *(_shaped(found[name], shape) for name in ("position", "outward_normal", "distance", "lower", "upper")),
            *(_shaped(found[name] != 0, shape) for name in ("inside", "converged")))

    def ray(self, origins: npt.ArrayLike, directions: npt.ArrayLike, max_distance: npt.ArrayLike = np.inf, *,
            threads: int = 0) -> RayHits:
        """First places along rays where the body begins; 0 for a ray that starts inside. No wall of the field is missed.

        origins: shape (..., 3), asset frame [m]
        directions: shape (..., 3), of any length but 0
        max_distance: shape (...) [m]
        The three are broadcast together.
        """
        starts = numbers("origins", origins, (3,))
        ways = np.asarray(numbers("directions", directions, (3,)), np.float64)
        limits = numbers("max_distance", max_distance, ())
        largest = np.abs(ways).max(axis=-1, keepdims=True)
        bad = ~(np.isfinite(largest) & (largest > 0))
        if bad.any():
            raise ValueError(f"directions number {bad.argmax()}: finite, and not zero")
        ways = ways / largest  # so that no square is 0 or infinite
        ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
        shape = np.broadcast_shapes(starts.shape[:-1], ways.shape[:-1], limits.shape)
        found = self._asset.ray(
            _rows("origins", np.broadcast_to(starts, (*shape, 3)))[0],
            _rows("directions", np.broadcast_to(ways, (*shape, 3)))[0],
            np.broadcast_to(limits, shape).reshape(-1).astype(np.float32), _threads(threads))
        missed = found["hit"] == 0
        found["distance"][missed] = np.inf
        found["position"][missed] = np.nan
        found["outward_normal"][missed] = 0
        return RayHits(_shaped(~missed, shape),
                       *(_shaped(found[name], shape) for name in ("distance", "position", "outward_normal")))

    @property
    def points(self) -> Points:
        """The pointshell, in the asset frame: read-only arrays that share memory with the asset and keep it alive."""
        points = self._asset.points()
        points.flags.writeable = False
        return Points(points["position"], points["inward_normal"], points["area"])

    def surface(self, step: float | None = None) -> Surface:
        """The surface of the distance field as a closed mesh, for display and export: an asset holds no mesh.

        step: edge of the cells of its grid, at least a quarter of a voxel; details thinner than it are lost. Default: so that
            there are about 20 000 triangles. [m]
        Needs the baker's module. Raises ValueError where no cell has a part of the surface in it.
        """
        if self.closed:
            raise ValueError("the asset is closed")
        if not self._asset.field:
            raise MissingPart("the asset has no voxelmap: bake it with voxelmap=True")
        if step is not None:
            number("step", step)
        return Surface(*_baker("Asset.surface").surface(self._bytes, self.scale, step))

    @property
    def certificate(self) -> Certificate:
        """Measured error of the field that answers."""
        field = self._asset.field
        if not field:
            raise MissingPart("the asset has no voxelmap: bake it with voxelmap=True")
        values = self._info[f"{field}_error"]
        return Certificate(field, float(values["max"]), float(values["rms"]), float(values["p99"]), float(values["bound"]),
                           values["worst_at"].copy())

    def mass_properties(self, density: float) -> MassProperties:
        """Mass, centre of mass and inertia of the mesh's solid.

        density: [kg/m^3]
        """
        if not 0 < number("density", density) < np.inf:
            raise ValueError("density: finite and more than 0 kg/m^3")
        xx, yy, zz, xy, xz, yz = density * self._info["inertia"]
        return MassProperties(float(density * self._info["volume"]), self._info["centre_of_mass"].copy(),
                              np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))

    @property
    def bounds(self) -> Array:
        """Lowest and highest corner of the mesh, shape (2, 3) [m]"""
        return np.array([self._info["bounds_min"], self._info["bounds_max"]])

    @property
    def voxel_size(self) -> float:
        """[m]"""
        return float(self._info["voxel_size"])

    @property
    def volume(self) -> float:
        """Of the mesh's solid [m^3]"""
        return float(self._info["volume"])

    @property
    def surface_area(self) -> float:
        """Of the mesh [m^2]"""
        return float(self._info["surface_area"])

    @property
    def scale(self) -> float:
        """Factor of all lengths, given when the asset was opened."""
        return self._asset.scale

    def verify(self) -> None:
        """Compares all hashes with the bytes, which opening does not. Raises AssetError when they differ."""
        self._asset.verify()

    def save(self, path: Path) -> None:
        """Writes the asset's file, NAME.vps.hdf by convention: for `vps.open`, vpsbake, C, C++ and Bullet.

        The file appears whole or not at all. It replaces an asset of this name, also one that is open. Raises
        FileExistsError where the name belongs to anything else, ValueError for an asset opened with a scale.
        """
        if self._bytes is None:
            raise ValueError("the asset is closed")
        if self.scale != 1:
            raise ValueError(f"the file would not keep the scale of {self.scale:g}: save an asset opened without one")
        _write_whole(path, self._bytes)


def open(source: Any, *, scale: float = 1.0) -> Asset:  # as gzip.open, lzma.open and others
    """Opens an asset.

    source: a path, which is mapped into memory, or the bytes of a whole file. Bytes that cannot change are not copied.
    scale: factor of all lengths, 0.001 to 1000

    Checks the directory and every index, but not the hashes of all bytes: see `Asset.verify`.
    """
    return Asset(source, scale=scale)


_BAKE_FLAGS = {"layers", "scaled", "real", "voxelmap", "pointshell", "prove_bound"}
_BAKE_NUMBERS = {"voxel", "resolution", "max_error", "alpha", "sheet_thickness", "field_error", "thin_faces", "band_inside",
                 "band_outside", "memory"}


def bake(mesh: Any, faces: npt.ArrayLike | None = None, *, voxel: float | None = None, resolution: int | None = None,
         max_error: float | None = None, unit: float = 1.0, repair: str = "automatic", cache: Path | None = None,
         threads: int = 0, **options: Any) -> Asset:
    """Bakes a mesh: seconds for a part of 200 voxels. The same mesh and options give the same bytes. Ctrl-C ends it.

    mesh: vertices of shape (n, 3) [m], with `faces` of shape (m, 3), counter-clockwise seen from outside; or an object with
        `vertices` and `faces`, such as a trimesh.Trimesh; or the path of a mesh file (obj, stl, ply, off, gltf, ...)
    voxel: size of a voxel [m]; or
    resolution: voxels along the longest side; or
    max_error: bake with the largest voxel whose certified error stays below this [m]
    unit: metres per unit of the mesh's numbers, such as 1e-3 for millimetres
    repair: what may be done to an open mesh: none, weld, stitch, fill, wrap, automatic
    cache: folder of assets baked before, which `vpsbake --cache` can share
    threads: at most so many processors; 0: all
    options: as those of `vpsbake`
        layers, scaled, real: fields to store (True or False)
        voxelmap, pointshell: parts to bake (True or False)
        field_error: error between samples that the field aims for, 0.01 to 1 [voxels]
        prove_bound: prove the bound of the field's error in every cell (True or False)
        band_inside, band_outside: how far the field reaches, 2 to 8 [voxels]
        alpha: spacing of the points, 0.25 to 64 [voxels]
        thin_faces: how many times farther apart they are inside flat faces, 1 to 4
        sheet_thickness: open surfaces become solids this thick [m]
        memory: a bake that would need more is refused [bytes, default 8e9]

    Needs the baker's module.
    """
    baker = _baker("vps.bake")
    given: dict[str, Any] = {"voxel": voxel, "resolution": resolution, "max_error": max_error, "repair": repair, **options}
    settings = {name: value for name, value in given.items() if value is not None}
    unknown = sorted(given.keys() - _BAKE_FLAGS - _BAKE_NUMBERS - {"repair"})
    if unknown:
        raise TypeError(f"vps.bake has no option {unknown[0]!r}")
    if sum(name in settings for name in ("voxel", "resolution", "max_error")) != 1:
        raise ValueError("give one of voxel, resolution and max_error")
    for name in sorted(settings.keys() & _BAKE_NUMBERS):
        value = number(name, settings[name])
        if not 0 < value < np.inf:  # the baker knows the ranges of the others
            raise ValueError(f"{name}: finite and more than 0, not {value!r}")
    if "resolution" in settings:
        whole("resolution", settings["resolution"], 1, 8192)
    if not 0 < number("unit", unit) < np.inf:
        raise ValueError("unit: finite and more than 0 m")
    settings["threads"] = _threads(threads)
    if "memory" in settings:
        settings["memory"] = int(min(settings["memory"], 2**62))
    folder = "" if cache is None else os.fspath(cache)
    if isinstance(mesh, (str, os.PathLike)):
        if faces is not None:
            raise TypeError("faces: a mesh file has its own")
        data, notes = baker.bake(os.fspath(mesh), {**settings, "unit": unit}, folder)
        return Asset(data, notes=notes)
    if faces is None:
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise TypeError("vps.bake takes vertices and faces, an object that has both, or the path of a mesh file")
        mesh, faces = mesh.vertices, mesh.faces
    vertices = unit * np.asarray(numbers("vertices", mesh, (3,)), np.float64)
    triangles = numbers("faces", faces, (3,))
    if triangles.dtype.kind == "f":
        raise TypeError(f"faces are integers, not {triangles.dtype}")
    data, notes = baker.bake(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int64), settings, folder)
    return Asset(data, notes=notes)


def contacts(first: Asset, second: Asset, poses: npt.ArrayLike, *, distance: float = 0.0, most: int | None = None,
             threads: int = 0) -> Contacts:
    """Points of one body in contact with the other, for each pose. The body with fewer points gives them; if it holds the
    other one without touching it, that one does, where both have points and voxelmaps.

    With `most`, the few contacts that an engine takes for a step: the deepest of each pose first, then those that are deep
    and far from others. They lie midway between the surfaces, not only at points, and have the normal and depth of the
    surface. The body with the finer voxels gives the points.

    poses: shape (..., 4, 4), take the second body's frame to the first's
    distance: surfaces this far apart count as contacts, too [m]
    most: at most so many contacts of each pose, 1 to 1024; None: all points
    """
    matrices, shape = _poses(poses)
    at_least_0("distance", distance)
    if most is not None:
        most = whole("most", most, 1, 1024)
        few, counts = _runtime.step_contacts(_handle(first), _handle(second), matrices, distance, most,
                                             _threads(threads))
        is_one = np.arange(most) < counts[:, None]
        found, deepest = few[is_one], np.where(counts > 0, few["penetration"][:, 0], -np.float32(distance))
        return Contacts(np.nonzero(is_one)[0], found["position"], found["normal"], found["penetration"], found["area"],
                        _shaped(counts.astype(np.int64), shape), _shaped(deepest.astype(np.float64), shape))
    found, pose, results = _runtime.contacts(_handle(first), _handle(second), matrices, distance, _threads(threads))
    return Contacts(pose, found["position"], found["inward_normal"], found["penetration"], found["area"],
                    _shaped(results["contacts"].astype(np.int64), shape), _shaped(results["delta"], shape))


def separation(first: Asset, second: Asset, poses: npt.ArrayLike, *, tolerance: float = 0.0,
               threads: int = 0) -> Separation:
    """Distance between two bodies, with bounds for their true surfaces, for each pose. Negative if one holds the other,
    where both have points and voxelmaps; else a body that lies inside the one with the points counts as apart.

    Beyond the band the closest points are found to 2 % of the distance if both bodies have points.
    poses: shape (..., 4, 4), take the second body's frame to the first's
    tolerance: the search may stop this far from the nearest point; faster [m]
    """
    matrices, shape = _poses(poses)
    at_least_0("tolerance", tolerance)
    return _separation(_runtime.separation(_handle(first), _handle(second), matrices, tolerance, _threads(threads)), shape)


def time_of_impact(first: Asset, second: Asset, start: npt.ArrayLike, *, velocity: npt.ArrayLike = (0, 0, 0),
                   angular_velocity: npt.ArrayLike = (0, 0, 0), duration: float = 1.0, distance: float = 0.0,
                   tolerance: float = 1e-4) -> Impact:
    """When the second body, moving at constant velocities, first comes near the first one. Never later than the true time.

    start: pose of the second body in the first's frame, shape (4, 4)
    velocity, angular_velocity: of its centre of mass, and about it, first body's frame, shape (3,) [m/s], [rad/s]
    duration: of the motion [s]
    distance: between the bodies that counts as an impact [m]
    tolerance: an impact is reported when the gap to `distance` is at most this [m]
    The first body needs a voxelmap, the second a pointshell.
    """
    matrices, shape = _poses(start)
    if shape != ():
        raise ValueError(f"start has the shape (4, 4), not {(*shape, 4, 4)}")
    motion = [one_array("velocity", velocity, (3,)), one_array("angular_velocity", angular_velocity, (3,))]
    for name, given in (("duration", duration), ("distance", distance), ("tolerance", tolerance)):
        at_least_0(name, given)
    if np.float32(tolerance) == 0:
        raise ValueError(f"tolerance: finite and more than 0, not {tolerance!r}")
    impact, time, found = _runtime.time_of_impact(
        _handle(first), _handle(second), matrices, np.concatenate([*motion, [duration]]), distance, tolerance)
    return Impact(impact == 1, time, impact != 2, _separation(found, ()))


def _separation(found: Array, shape: tuple[int, ...]) -> Separation:
    return Separation(_shaped(-found["delta"], shape), _shaped(-found["upper"], shape), _shaped(-found["lower"], shape),
                      _shaped(found["position"], shape), _shaped(found["direction"], shape))


def _handle(asset: Asset) -> _runtime.Asset:
    if not isinstance(asset, Asset):
        raise TypeError(f"a vps.Asset is needed, not {type(asset).__name__}")
    return asset._asset


def _threads(count: Any) -> int:
    return whole("threads", count, 0, 1024)


def _rows(name: str, value: npt.ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """float32 rows of three for the C interface, which takes any stride between rows; and the leading shape."""
    array = numbers(name, value, (3,))
    with np.errstate(over="ignore"):
        rows = array.reshape(-1, 3).astype(np.float32, copy=False)
    if rows.strides[1] != rows.itemsize:
        rows = np.ascontiguousarray(rows)
    return rows, array.shape[:-1]


def _poses(value: npt.ArrayLike) -> tuple[Array, tuple[int, ...]]:
    array = numbers("poses", value, (4, 4))
    return array.reshape(-1, 4, 4).astype(np.float64, copy=False), array.shape[:-2]


def _shaped(rows: Array, shape: tuple[int, ...]) -> Array:
    """Rows with the leading shape of the argument: a number or a row for one point."""
    shaped: Array = rows.reshape((*shape, *rows.shape[1:]))
    return shaped if shaped.shape else shaped[()]


def _asset_bytes(source: Any) -> Any:
    """The bytes of a path or a buffer, at an address that the runtime takes, which nobody changes."""
    if isinstance(source, (str, os.PathLike)):
        with builtins.open(source, "rb", opener=_at_once) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise OSError(errno.EINVAL, "this is not a regular file; give a .vps.hdf file", os.fspath(source))
            if os.fstat(file.fileno()).st_size == 0:
                raise AssetError(f"{os.fspath(source)}: the file is empty")
            return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    try:
        view = memoryview(source).cast("B")
    except TypeError as error:
        raise TypeError(f"a path or bytes are needed, not {type(source).__name__}") from error
    array = np.frombuffer(view, np.uint8)
    if view.readonly and array.ctypes.data % 8 == 0:
        return array
    copy = np.empty((len(array) + 7) // 8, np.uint64).view(np.uint8)[:len(array)]
    copy[:] = array
    return copy


def _at_once(path: str, flags: int) -> int:
    """An opener that does not wait for the other end of a pipe."""
    return os.open(path, flags | os.O_NONBLOCK)


def _write_whole(path: Path, data: Any) -> None:
    """Writes an asset as vpsbake does: to a temporary file beside the target, which then takes its place."""
    target = os.path.realpath(path)  # follows a link
    part = os.path.join(os.path.dirname(target), f".vps.{uuid.uuid4().hex}")
    try:
        if os.path.exists(target) and not _is_asset(target, bytes(data[:8])):
            raise FileExistsError(errno.EEXIST, "the file exists and is not an asset; remove it or choose another name")
        with builtins.open(part, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None
    finally:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            os.remove(part)


def _is_asset(path: str, magic: bytes) -> bool:
    if not os.path.isfile(path):
        return False
    with builtins.open(path, "rb") as file:
        return file.read(len(magic)) == magic


def _baker(user: str) -> Any:
    try:
        from . import _bake
    except ImportError as error:
        raise ImportError(f"{user} needs the baker's module vps._bake: install python3-vps-bake, or build with "
                          f"VPS_BUILD_BAKE=ON; or bake with the program vpsbake and vps.open the asset ({error})") from error
    return _bake
