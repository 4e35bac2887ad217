# SPDX-License-Identifier: GPL-3.0-or-later
"""A small Bullet world."""
import gc
import os
import subprocess
import threading
import warnings
import weakref

import numpy as np
import pytest
import vps
from conftest import MESHES, RADIUS, shifted

pytestmark = pytest.mark.skipif(
    not any(name.startswith("_bullet.") for name in os.listdir(os.path.dirname(vps.__file__))),
    reason="the package was built without Bullet")


def angle(pose):
    """About z. [rad]"""
    return np.arctan2(pose[1, 0], pose[0, 0])


def test_bodies_fall_and_rest(sphere):
    world = vps.World(step=1 / 240)
    world.add_plane(name="ground")
    ball = world.add(sphere, pose=shifted(0, 0, 0.3), density=500, name="ball")
    crate = world.add_box([0.05, 0.05, 0.02], pose=shifted(1, 0, 0.05), mass=2)
    marble = world.add_sphere(0.01, pose=shifted(2, 0, 0.02))
    assert world.lint() == []
    assert ball.mass == pytest.approx(500 * sphere.volume, rel=1e-5) and crate.mass == pytest.approx(2)
    assert marble.mass == pytest.approx(1000 * 4 / 3 * np.pi * 1e-6)
    assert world.poses.shape == (4, 4, 4) and world.bodies[1] is ball
    world.step(24)
    assert world.time == pytest.approx(0.1)
    assert ball.pose[2, 3] == pytest.approx(0.3 - 9.81 * 0.1**2 / 2, rel=0.01)
    assert ball.velocity[2] == pytest.approx(-0.981, rel=1e-3)
    world.step(480)
    assert ball.pose[2, 3] == pytest.approx(RADIUS, abs=1e-3)
    assert crate.pose[2, 3] == pytest.approx(0.02, abs=1e-3)
    contacts = world.contacts()
    assert set(zip(contacts.first.tolist(), contacts.second.tolist())) <= {(a, b) for a in range(4) for b in range(4)}
    of_crate = (contacts.first == crate.index) | (contacts.second == crate.index)
    assert contacts.impulse[of_crate].sum() == pytest.approx(2 * 9.81 / 240, rel=0.05)
    down = np.where(contacts.second[of_crate] == crate.index, 1, -1) * contacts.normal[of_crate][:, 2]
    assert np.allclose(down, 1, atol=1e-3), "from the first body into the second"


def test_a_nut_turns_down_its_bolt():
    bolt, nut = (vps.bake(MESHES / f"{name}.obj", voxel=0.5e-3) for name in ("bolt", "nut"))
    world = vps.World(step=1e-3)
    world.add(bolt, fixed=True, friction=0)
    body = world.add(nut, density=7850, friction=0)
    turned, last = 0.0, 0.0
    for _ in range(40):
        world.step(10)
        now = angle(body.pose)
        turned += (now - last + np.pi) % (2 * np.pi) - np.pi
        last = now
    descent = -body.pose[2, 3]
    assert descent > 0.7e-3
    assert abs(descent + turned * 1.5e-3 / (2 * np.pi)) < 0.2e-3, "along the thread, whose pitch is 1.5 mm"


def test_worlds_step_side_by_side(cube):
    def heap():
        world = vps.World()
        world.add_plane()
        for i in range(6):
            world.add(cube, pose=shifted(0.02 * i, 0.01 * i, 0.2 + 0.25 * i))
        return world

    alone = heap()
    alone.step(2000)
    worlds = [heap() for _ in range(3)]
    threads = [threading.Thread(target=world.step, args=(2000,)) for world in worlds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for world in worlds:
        assert np.array_equal(world.poses, alone.poses) and world.time == alone.time


def test_a_world_that_another_thread_steps_refuses_calls(sphere):
    world = vps.World()
    world.add_plane()
    ball = world.add(sphere, pose=shifted(0, 0, 0.2))
    calls = [lambda: world.poses, lambda: world.step(), lambda: world.time, lambda: world.add_box([1, 1, 1]),
             world.contacts, lambda: ball.velocity, lambda: ball.push((0, 0, 1))]
    for call in calls:
        refused = False
        for _ in range(20):  # the thread may end before the call
            thread = threading.Thread(target=world.step, args=(20000,))
            thread.start()
            while thread.is_alive() and not refused:
                try:
                    call()
                except RuntimeError as error:
                    assert str(error) == "another thread is stepping this world"
                    refused = True
            thread.join()
            if refused:
                break
        assert refused
    world.step()


def test_a_hinge_turns_a_body(cube):
    world = vps.World(gravity=(0, 0, 0))
    body = world.add(cube, pose=shifted(0.2, 0, 0))
    hinge = world.hinge(body, point=(0, 0, 0), axis=(0, 0, 2))
    assert hinge.position == pytest.approx(0, abs=1e-6)
    hinge.drive(speed=1.5, effort=100)
    world.step(240)
    assert angle(body.pose) == pytest.approx(1.5, abs=0.05) and hinge.position == pytest.approx(1.5, abs=0.05)
    assert np.linalg.norm(body.pose[:3, 3]) == pytest.approx(0.2, abs=1e-3)
    hinge.drive(speed=0, effort=100)
    world.step(240)
    assert body.angular_velocity[2] == pytest.approx(0, abs=1e-3)


def test_a_slider_slides_against_another_body(cube):
    world = vps.World()
    rail = world.add_box([0.5, 0.02, 0.02], fixed=True, mass=0)
    body = world.add(cube, pose=shifted(0, 0, 0.3))
    slider = world.slider(body, rail, axis=(1, 0, 0))
    slider.drive(speed=0.1, effort=1000)
    world.step(480)
    assert np.allclose(body.pose, shifted(0.2, 0, 0.3), atol=5e-3)
    assert slider.position == pytest.approx(0.2, abs=5e-3)
    slider.drive(speed=0, effort=0)
    body.push(force=(1e4, 0, 0))
    world.step()
    assert body.velocity[0] > 1


def test_a_kinematic_body_carries_another(cube):
    world = vps.World()
    lift = world.add_box([0.2, 0.2, 0.02], kinematic=True, pose=shifted(0, 0, -0.02))
    load = world.add(cube, pose=shifted(0, 0, 0.05))
    assert lift.mass == 0
    for i in range(240):
        lift.pose = shifted(0, 0, -0.02 + 0.1 * (i + 1) / 240)
        world.step()
    assert lift.velocity[2] == pytest.approx(0.1, rel=0.01)
    assert load.pose[2, 3] == pytest.approx(0.15, abs=2e-3) and load.velocity[2] == pytest.approx(0.1, rel=0.05)


def test_bodies_are_put_and_thrown(cube):
    world = vps.World(gravity=(0, 0, 0), step=0.01)
    body = world.add(cube)
    body.pose, body.velocity, body.angular_velocity = shifted(1, 2, 3), (1, 0, 0), (0, 0, 1)
    assert np.allclose(body.pose, shifted(1, 2, 3)) and np.allclose(body.velocity, [1, 0, 0])
    world.step(10)
    assert np.allclose(body.pose[:3, 3], [1.1, 2, 3], atol=1e-4) and angle(body.pose) == pytest.approx(0.1, abs=1e-3)


@pytest.mark.skipif("VPSBAKE" not in os.environ, reason="needs the program vpsbake")
def test_a_planned_scene(tmp_path):
    (tmp_path / "scene.toml").write_text(f"""
[world]
gravity = ["0m/s2", "0m/s2", "-1.62m/s2"]
[wishes]
error = "4mm"
[[body]]
name = "table"
type = "static"
mesh = "{MESHES / 'cube.obj'}"
[[body]]
name = "ball"
mass = "100g"
mesh = "{MESHES / 'icosphere.obj'}"
position = ["0mm", "0mm", "120mm"]
""")
    done = subprocess.run([os.environ["VPSBAKE"], "scene", "scene.toml"], cwd=tmp_path, capture_output=True,
                          text=True, check=False)
    assert done.returncode == 0, done.stderr
    world = vps.World()
    bodies = world.load_scene(tmp_path / "scene.vps" / "scene.vps.json")
    assert list(bodies) == ["table", "ball"] and bodies["ball"].mass == pytest.approx(0.1)
    assert np.allclose(bodies["ball"].pose, shifted(0, 0, 0.12), atol=1e-5)
    world.step(24)
    assert bodies["ball"].velocity[2] == pytest.approx(-0.162, rel=0.01)
    with pytest.raises(FileNotFoundError, match="none.json"):
        world.load_scene(tmp_path / "none.json")

    # A warning that is an error leaves nothing of the scene behind.
    scene = (tmp_path / "scene.toml").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(scene.replace("100g", "1000000kg"), encoding="utf-8")
    subprocess.run([os.environ["VPSBAKE"], "scene", "scene.toml", "-q"], cwd=tmp_path, check=True)
    world = vps.World()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning):
            world.load_scene(tmp_path / "scene.vps" / "scene.vps.json")
    assert world.bodies == [] and world.add_box((0.1, 0.1, 0.1)).index == 0


@pytest.mark.skipif("VPSBAKE" not in os.environ, reason="needs the program vpsbake")
def test_a_robot_of_a_scene(tmp_path):
    inertial = '<inertial><origin xyz="0 0 0.01"/><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
    collision = f'<collision><geometry><mesh filename="{MESHES / "cube.obj"}"/></geometry></collision>'
    (tmp_path / "r.urdf").write_text(f"""<robot name="r">
<link name="a">{inertial}{collision}</link><link name="b">{inertial}{collision}</link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/></joint>
</robot>""")
    (tmp_path / "r.toml").write_text("""[[body]]
name = "ground"
type = "static"
shape = "plane"
[[body]]
name = "r"
urdf = "r.urdf"
""")
    done = subprocess.run([os.environ["VPSBAKE"], "scene", "r.toml"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    world = vps.World(step=1 / 240)
    with pytest.warns(RuntimeWarning, match="1 joints of the scene are not loaded"):
        world.load_scene(tmp_path / "r.vps" / "r.vps.json")
    assert not any(advice.startswith("m_splitImpulsePenetrationThreshold") for advice in world.lint())


def test_a_world_goes_without_the_garbage_collector(cube):
    world = vps.World()
    body = world.add(cube)
    gone = weakref.ref(world)
    gc.disable()
    try:
        del world
        assert gone() is None
    finally:
        gc.enable()
    assert body.pose.shape == (4, 4)  # a body keeps what it needs


def test_directions_have_any_length(cube):
    world = vps.World(gravity=(0, 0, 0))
    world.add_plane(normal=(0, 0, 1e25))
    long = vps.World()
    long.add_plane((0, 0, 2), 2.0)
    ball = long.add_sphere(0.1, mass=1, pose=shifted(0, 0, 1.11))
    long.step(240)
    assert ball.pose[2, 3] == pytest.approx(1.1, abs=1e-3), "normal . p = offset at 1 m"
    body = world.add(cube, pose=shifted(0, 0, 0.04))
    world.hinge(world.add(cube, pose=shifted(1, 0, 1)), point=(1, 0, 1), axis=(1e-25, 0, 0))
    world.step(24)
    assert body.pose[2, 3] > 0.041 and np.isfinite(world.poses).all()


def test_bad_arguments(cube):
    world, other = vps.World(), vps.World()
    body, stranger = world.add(cube), other.add(cube)
    for call in (lambda: vps.World(step=0), lambda: vps.World(gravity=(0, 0, np.nan)),
                 lambda: world.add(cube, pose=np.eye(4) * 2), lambda: world.add(cube, pose=np.eye(3)),
                 lambda: world.add(cube, pose=np.full((4, 4), np.nan)), lambda: world.add(cube, density=0),
                 lambda: world.add(cube, mass=-1), lambda: world.add(cube, friction=-1), lambda: world.add_box([0, 1, 1]),
                 lambda: world.add_sphere(-1), lambda: world.add_sphere(1e-46), lambda: vps.World(step=1e-7),
                 lambda: world.add_plane(offset=1e39), lambda: world.add_plane((0, 0, 1e-25), 1.0), lambda: world.add(cube, restitution=np.inf), lambda: world.add_plane((0, 0, 0)), lambda: body.push((0, 0, np.inf)),
                 lambda: world.hinge(body, stranger, point=(0, 0, 0), axis=(0, 0, 1)),
                 lambda: world.hinge(body, body, point=(0, 0, 0), axis=(0, 0, 1)),
                 lambda: world.hinge(body, point=(0, 0, 0), axis=(0, 0, 0)),
                 lambda: world.slider(body, axis=(1, 0, 0)).drive(np.nan, 1),
                 lambda: world.slider(body, axis=(1, 0, 0)).drive(1, -1)):
        with pytest.raises(ValueError):
            call()
    for call in (lambda: world.add_box("box"), lambda: vps.World(gravity=(0, 0)), lambda: body.push((1, 2))):
        with pytest.raises((TypeError, ValueError)):
            call()
    with vps.open(bytes(cube._bytes)) as asset:
        thing = world.add(asset, pose=shifted(5, 0, 0))
    with pytest.raises(ValueError, match="closed"):
        world.add(asset)
    world.step()
    assert thing.velocity[2] < 0, "its shape keeps the bytes"


def test_wrong_arguments_are_named_in_one_line(cube):
    world = vps.World()
    body = world.add(cube)
    ground = world.add_plane()
    joint = world.slider(body, axis=(1, 0, 0))
    huge = (1e300, 0, 0)  # infinite in single precision
    for error, text, call in (
            (TypeError, "step: a number", lambda: vps.World(step="x")), (ValueError, "gravity: ", lambda: vps.World(gravity=(1, 2))),
            (ValueError, "gravity: finite", lambda: vps.World(gravity=huge)),
            (TypeError, "a vps.Asset is needed, not str", lambda: world.add("cube.vps.hdf")),
            (TypeError, "pose: ", lambda: world.add(cube, pose="x")), (TypeError, "density: ", lambda: world.add(cube, density="x")),
            (TypeError, "mass: a number, not '1kg'", lambda: world.add(cube, mass="1kg")),
            (ValueError, "one of the two", lambda: world.add(cube, mass=1, density=1)),
            (ValueError, "one of the two", lambda: world.add(cube, fixed=True, kinematic=True)),
            (ValueError, "restitution: 0 to 1", lambda: world.add(cube, restitution=2)),
            (ValueError, "mass: ", lambda: world.add(cube, mass=1e300)), (ValueError, "mass: ", lambda: world.add(cube, mass=1e-300)),
            (TypeError, "friction: ", lambda: world.add(cube, friction="x")),
            (TypeError, "restitution: ", lambda: world.add(cube, restitution=None)),
            (ValueError, "half_extents: ", lambda: world.add_box([1, 1])), (ValueError, "half_extents: ", lambda: world.add_box(1)),
            (ValueError, "half_extents: ", lambda: world.add_box([[1, 1, 1]])),
            (ValueError, "half_extents: more than 0", lambda: world.add_box([0, 1, 1])),
            (ValueError, "radius: more than 0", lambda: world.add_sphere(0)),
            (TypeError, "radius: ", lambda: world.add_sphere("x")), (ValueError, "normal: ", lambda: world.add_plane((1, 1))),
            (TypeError, "offset: ", lambda: world.add_plane(offset="x")), (TypeError, "count: ", lambda: world.step(1.5)),
            (ValueError, "count: ", lambda: world.step(-1)), (ValueError, "count: ", lambda: world.step(2**63)),
            (ValueError, "velocity: ", lambda: setattr(body, "velocity", huge)), (ValueError, "force: ", lambda: body.push(huge)),
            (ValueError, "torque: ", lambda: body.push(torque=(1, 2))), (TypeError, "pose: ", lambda: setattr(body, "pose", "x")),
            (ValueError, "angular_velocity: ", lambda: setattr(body, "angular_velocity", 5)),
            (ValueError, "no force moves this body", lambda: setattr(ground, "velocity", (1, 0, 0))),
            (ValueError, "no force moves this body", lambda: ground.push((1, 0, 0))),
            (ValueError, "fixed and kinematic bodies have no mass", lambda: world.add(cube, mass=1, fixed=True)),
            (ValueError, "axis: ", lambda: world.hinge(body, point=(0, 0, 0), axis=(0, 1))),
            (ValueError, "point: ", lambda: world.hinge(body, point=huge, axis=(0, 0, 1))),
            (TypeError, "speed: ", lambda: joint.drive("x", 1)), (TypeError, "effort: ", lambda: joint.drive(1, None))):
        with pytest.raises(error, match=text) as raised:
            call()
        assert "\n" not in str(raised.value)
    world.step()
    assert len(world.bodies) == 2 and np.isfinite(world.poses).all()


def test_messages_are_warnings(cube):
    with pytest.warns(RuntimeWarning, match="assets are in metres"):
        vps.World().add(cube, mass=1e6)


def test_an_asset_with_a_scale(sphere):
    world = vps.World(step=1 / 240)
    world.add_plane()
    with vps.open(bytes(sphere._bytes), scale=2) as large:
        ball = world.add(large, pose=shifted(0, 0, 0.11))
    assert ball.mass == pytest.approx(8 * 1000 * sphere.volume, rel=1e-4)
    world.step(240)
    assert ball.pose[2, 3] == pytest.approx(2 * RADIUS, abs=2e-3)
