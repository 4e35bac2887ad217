# SPDX-License-Identifier: Zlib
"""A small Bullet world, for trying assets and for tests."""
from __future__ import annotations

import json
import os
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from ._arguments import number, one_array, whole

if TYPE_CHECKING:
    from . import Asset

Array = npt.NDArray[Any]
_HERE = np.eye(4)


class WorldContacts(NamedTuple):
    """Contacts of a world after a step, in its frame; k in all."""

    first: Array  #: index of the first body, shape (k,)
    second: Array  #: index of the second body, shape (k,)
    position: Array  #: on the second body, shape (k, 3) [m]
    normal: Array  #: unit, from the first body into the second, shape (k, 3)
    distance: Array  #: negative: penetration, shape (k,) [m]
    impulse: Array  #: along the normal, in the last step, shape (k,) [N s]


class Body:
    """A body of a world. Its pose is that of the mesh's frame, or of the centre of a box or sphere."""

    def __init__(self, world: Any, index: int, name: str) -> None:
        self._world = world  # of vps._bullet: a World would wait for the garbage collector
        self.index = index  #: in World.bodies, World.poses and WorldContacts
        self.name = name

    def __repr__(self) -> str:
        return f"<vps.Body {self.index} {self.name!r}>"

    @property
    def pose(self) -> Array:
        """Takes the body's frame to the world's, shape (4, 4). A kinematic body moves to a new pose during the next step."""
        pose: Array = self._world.poses()[self.index]
        return pose

    @pose.setter
    def pose(self, pose: npt.ArrayLike) -> None:
        self._world.set_pose(self.index, one_array("pose", pose, (4, 4)))

    @property
    def velocity(self) -> Array:
        """Of the centre of mass, shape (3,) [m/s]"""
        return np.array(self._world.velocity(self.index)[0])

    @velocity.setter
    def velocity(self, velocity: npt.ArrayLike) -> None:
        self._world.set_velocity(self.index, one_array("velocity", velocity, (3,)), self.angular_velocity)

    @property
    def angular_velocity(self) -> Array:
        """Shape (3,) [rad/s]"""
        return np.array(self._world.velocity(self.index)[1])

    @angular_velocity.setter
    def angular_velocity(self, velocity: npt.ArrayLike) -> None:
        self._world.set_velocity(self.index, self.velocity, one_array("angular_velocity", velocity, (3,)))

    @property
    def mass(self) -> float:
        """0 for bodies that no force moves [kg]"""
        return float(self._world.mass(self.index))

    def push(self, force: npt.ArrayLike = (0, 0, 0), torque: npt.ArrayLike = (0, 0, 0)) -> None:
        """Acts on the centre of mass during the next step, world frame. [N], [N m]"""
        self._world.push(self.index, one_array("force", force, (3,)), one_array("torque", torque, (3,)))


class Joint:
    """A hinge or a slider with a motor."""

    def __init__(self, world: Any, index: int) -> None:
        self._world = world
        self._index = index

    @property
    def position(self) -> float:
        """Since the joint was made: the angle, -pi to pi, or the way, of the first body [rad] or [m]"""
        return float(self._world.position(self._index))

    def drive(self, speed: float, effort: float) -> None:
        """Moves the first body against the second.

        speed: about or along the axis [rad/s] or [m/s]
        effort: largest torque or force of the motor; 0 switches it off [N m] or [N]
        """
        self._world.set_motor(self._index, number("speed", speed), number("effort", effort))


class World:
    """A stock Bullet world, single precision, with the settings that docs/bullet.md advises. Bodies never sleep.

        world = vps.World(step=1 / 1000)
        bolt = world.add(bolt_asset, fixed=True)
        nut = world.add(nut_asset, pose=start, friction=0.1)
        world.hinge(nut, point=(0, 0, 0), axis=(0, 0, 1))
        world.step(500)
        nut.pose, world.contacts()

    Threads may step worlds side by side, which may share assets: `step` releases the interpreter's lock. A world that
    another thread is stepping refuses calls with RuntimeError. Messages of the plug-in are RuntimeWarnings. Needs the
    module vps._bullet.
    """

    def __init__(self, *, gravity: npt.ArrayLike = (0, 0, -9.81), step: float = 1 / 240) -> None:
        """gravity: [m/s^2]. step: of time, 1e-6 to 10 [s]"""
        try:
            from . import _bullet
        except ImportError as error:
            raise ImportError("vps.World needs the module vps._bullet: install python3-vps-bullet, or build with "
                              f"VPS_BUILD_BULLET=ON ({error})") from error
        self._bullet: Any = _bullet
        self._world: Any = _bullet.World(one_array("gravity", gravity, (3,)), number("step", step))
        self.bodies: list[Body] = []

    @property
    def time(self) -> float:
        """Since the start [s]"""
        return float(self._world.time)

    @property
    def poses(self) -> Array:
        """Of all bodies, shape (n, 4, 4), as Body.pose"""
        poses: Array = self._world.poses()
        return poses

    def step(self, count: int = 1) -> None:
        """Computes `count` steps of time."""
        self._world.step(whole("count", count, 0, 2**31 - 1))

    def contacts(self) -> WorldContacts:
        """All contacts of the last step, those that lie ahead included."""
        found = self._world.contacts()
        return WorldContacts(*(found[name] for name in WorldContacts._fields))

    def lint(self) -> list[str]:
        """Settings of this world that harm it, and what to set instead: one line each."""
        lines: list[str] = self._world.lint()
        return lines

    def add(self, asset: Asset, *, pose: npt.ArrayLike = _HERE, density: float | None = None, mass: float | None = None,
            fixed: bool = False, kinematic: bool = False, friction: float = 0.5, restitution: float = 0.0,
            name: str = "") -> Body:
        """Adds a baked body.

        pose: takes the asset frame to the world's, shape (4, 4)
        density or mass: [kg/m^3] or [kg], not both; 1000 kg/m^3 without them
        fixed: it never moves. kinematic: only `Body.pose` moves it
        """
        from . import Asset

        if not isinstance(asset, Asset):
            raise TypeError(f"a vps.Asset is needed, not {type(asset).__name__}")
        if asset.closed:
            raise ValueError("the asset is closed")
        if asset._baked is None:  # bodies share it
            asset._baked = self._bullet.Baked(asset._bytes, asset.scale)
        options = self._options(pose, _mass(mass, density, asset._baked.volume, fixed or kinematic), fixed, kinematic,
                                friction, restitution)
        return self._enter(self._world.add_baked(asset._baked, options), name)

    def add_box(self, half_extents: npt.ArrayLike, *, pose: npt.ArrayLike = _HERE, density: float | None = None,
                mass: float | None = None, fixed: bool = False, kinematic: bool = False, friction: float = 0.5,
                restitution: float = 0.0, name: str = "") -> Body:
        """Adds a box. half_extents: shape (3,) [m]; the others as for `add`."""
        half_extents = one_array("half_extents", half_extents, (3,))
        if not np.all(half_extents > 0):
            raise ValueError("half_extents: more than 0 m")
        volume = float(8 * np.prod(half_extents))
        options = self._options(pose, _mass(mass, density, volume, fixed or kinematic), fixed, kinematic, friction,
                                restitution)
        return self._enter(self._world.add_box(half_extents, options), name)

    def add_sphere(self, radius: float, *, pose: npt.ArrayLike = _HERE, density: float | None = None, mass: float | None = None,
                   fixed: bool = False, kinematic: bool = False, friction: float = 0.5, restitution: float = 0.0,
                   name: str = "") -> Body:
        """Adds a sphere. radius: [m]; the others as for `add`."""
        radius = number("radius", radius)
        if not radius > 0:
            raise ValueError("radius: more than 0 m")
        volume = 4 / 3 * np.pi * radius**3
        options = self._options(pose, _mass(mass, density, volume, fixed or kinematic), fixed, kinematic, friction,
                                restitution)
        return self._enter(self._world.add_sphere(radius, options), name)

    def add_plane(self, normal: npt.ArrayLike = (0, 0, 1), offset: float = 0.0, *, friction: float = 0.5,
                  restitution: float = 0.0, name: str = "") -> Body:
        """Adds a fixed half-space: the solid is normal . p <= offset. offset: [m]"""
        options = self._options(_HERE, 0.0, True, False, friction, restitution)
        return self._enter(self._world.add_plane(one_array("normal", normal, (3,)), number("offset", offset), options), name)

    def load_scene(self, manifest: Union[str, "os.PathLike[str]"]) -> dict[str, Body]:
        """Adds the bodies of a scene that `vpsbake scene` has planned, by name, and sets its gravity.

        Joints of robots are not loaded, with a RuntimeWarning: use `hinge` and `slider`, or C++'s load_scene.
        """
        with open(manifest, "rb") as file:
            text = file.read()
        first = self._world.load_scene(os.fspath(manifest))
        scene = json.loads(text)
        if joints := scene.get("joints"):
            warnings.warn(f"{len(joints)} joints of the scene are not loaded: their links are free",
                          RuntimeWarning, stacklevel=2)
        names = [body["name"] for body in scene["bodies"]]
        return {name: self._enter(first + i, name) for i, name in enumerate(names)}

    def hinge(self, first: Body, second: Body | None = None, *, point: npt.ArrayLike, axis: npt.ArrayLike) -> Joint:
        """Lets the first body only turn against the second, or against the world.

        point, axis: of the hinge, world frame, shape (3,) [m], [-]
        """
        return Joint(self._world, self._world.add_hinge(
            self._own(first), self._other(second), one_array("point", point, (3,)), one_array("axis", axis, (3,))))

    def slider(self, first: Body, second: Body | None = None, *, axis: npt.ArrayLike) -> Joint:
        """Lets the first body only slide along an axis of the second, or of the world. axis: world frame, shape (3,)"""
        return Joint(self._world, self._world.add_slider(self._own(first), self._other(second), one_array("axis", axis, (3,))))

    def _options(self, pose: npt.ArrayLike, mass: float, fixed: bool, kinematic: bool, friction: float,
                 restitution: float) -> Any:
        if fixed and kinematic:
            raise ValueError("fixed and kinematic: one of the two")
        restitution = number("restitution", restitution)
        if not 0 <= restitution <= 1:
            raise ValueError("restitution: 0 to 1")
        return self._bullet.BodyOptions(one_array("pose", pose, (4, 4)), mass, bool(kinematic), number("friction", friction),
                                        restitution)

    def _enter(self, index: int, name: str) -> Body:
        self.bodies.append(Body(self._world, index, name))
        return self.bodies[-1]

    def _own(self, body: Body) -> int:
        if not isinstance(body, Body) or body._world is not self._world:
            raise ValueError("a body of this world is needed")
        return body.index

    def _other(self, body: Body | None) -> int:
        return -1 if body is None else self._own(body)


def _mass(mass: float | None, density: float | None, volume: float, stays: bool) -> float:
    if mass is not None and density is not None:
        raise ValueError("density and mass: one of the two")
    if stays and (mass or density):
        raise ValueError("fixed and kinematic bodies have no mass")
    of_density = 1000.0 if density is None else number("density", density)
    given = of_density * volume if mass is None else number("mass", mass)
    if stays and given == 0:
        return 0.0
    if not np.finfo(np.float32).tiny <= given <= np.finfo(np.float32).max:
        raise ValueError("density and mass: finite and more than 0, in single precision")
    return 0.0 if stays else given
