// SPDX-License-Identifier: GPL-3.0-or-later
// Robots that handle things: a gripper with a mug, a hand with a nut. As multibodies, and as rigid bodies with
// constraints.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <string>

#include "runtime/bullet/vps_scene.h"
#include "tests/cli/program.h"
#include "tests/runtime/bullet/robot_world.h"
#include "tests/runtime/bullet/world.h"
#include "tests/support/shared.h"

namespace vps::test {
namespace {

enum class Robot : std::uint8_t { multibody, rigid };

// A cup of 80 mm with a handle along x. Its walls are 4 mm thick, its origin is below its centre.
TriangleMesh make_mug() {
  const auto ring = [](double radius, double z) { return samples::make_ring(48, z, samples::circle(radius)); };
  const TriangleMesh cup =
      samples::make_skin({ring(0.04, 0), ring(0.04, 0.09), ring(0.036, 0.09), ring(0.036, 0.005)}, false);
  TriangleMesh handle = make_torus(0.022, 0.005, 32, 16);
  for (auto& v : handle.vertices) v = {v[0] + 0.044, v[2], v[1] + 0.045};
  for (auto& t : handle.triangles) std::swap(t[1], t[2]);  // y and z changed places
  return joined(cup, handle);
}

void write_obj(const TriangleMesh& mesh, const std::string& file) {
  std::ofstream out(file);
  out.precision(9);
  for (const auto& v : mesh.vertices) out << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  for (const auto& t : mesh.triangles) out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

// The gripper of docs/examples over a thing on a table.
// @param z  of the thing's origin while it stands. [m]
void bake_gripper(const TemporaryFolder& folder, const std::string& thing, double z) {
  write_file(folder / "scene.toml",
             "[[body]]\nname = \"gripper\"\nurdf = \"" VPS_DOCS
             "/examples/gripper/gripper.urdf\"\nvoxel = \"1mm\"\n"
             "position = [\"0m\", \"0m\", \"13cm\"]\nfriction = 0.8\n"
             "[[body]]\nname = \"thing\"\nmesh = \"" +
                 thing +
                 "\"\nvoxel = \"1mm\"\nmass = \"300g\"\nfriction = 0.8\n"
                 "position = [\"0m\", \"0m\", \"" +
                 std::to_string(z) +
                 "m\"]\n"
                 "[[body]]\nname = \"table\"\nshape = \"box\"\nsize = [\"1m\", \"1m\", \"2cm\"]\ntype = \"static\"\n"
                 "position = [\"0m\", \"0m\", \"-1cm\"]\nfriction = 0.8\n[world]\n"
                 "gravity = [\"0m/s2\", \"0m/s2\", \"-9.81m/s2\"]\n");
  const Outcome run = vpsbake(folder, "scene scene.toml -o out");
  ASSERT_EQ(run.code, 0) << run.err;
}

// Motors of the four axes: x, z, left and right finger.
class Axes4 {
 public:
  Axes4(RobotWorld& world, const bullet::Scene& scene, Robot robot, double dt) {
    constexpr double kForce[] = {200, 200, 40, 40};  // [N]
    if (robot == Robot::multibody) {
      constexpr const char* kJoints[] = {"gripper/slide", "gripper/lift", "gripper/left_finger",
                                         "gripper/right_finger"};
      for (int i = 0; i < 4; ++i) {
        joints_[i] = scene.find_joint(kJoints[i]);
        motors_[i] = &world.drive(*joints_[i].multibody, joints_[i].link, 0, btScalar(kForce[i] * dt));
      }
      return;
    }
    palm_ = scene.find("gripper/palm");
    start_ = palm_->getWorldTransform().getOrigin();
    auto gantry = std::make_unique<btGeneric6DofSpring2Constraint>(*palm_, btTransform::getIdentity());
    gantry_ = gantry.get();
    gantry->setLinearLowerLimit({1, 0, 1});
    gantry->setLinearUpperLimit({-1, 0, -1});
    gantry->setAngularLowerLimit({0, 0, 0});
    gantry->setAngularUpperLimit({0, 0, 0});
    for (const int axis : {0, 2}) {
      gantry->enableMotor(axis, true);
      gantry->setMaxMotorForce(axis, btScalar(kForce[0]));
    }
    world.joints.push_back(std::move(gantry));
    for (int i = 0; i < 2; ++i) {
      btRigidBody& finger = *scene.find(i == 0 ? "gripper/left" : "gripper/right");
      const btTransform axis(btQuaternion({0, 0, 1}, btScalar(i == 0 ? 1 : -1) * SIMD_HALF_PI), {0, 0, 0});
      const btTransform in_palm = palm_->getWorldTransform().inverse() * finger.getWorldTransform() * axis;
      auto slider = std::make_unique<btSliderConstraint>(*palm_, finger, in_palm, axis, true);
      slider->setLowerLinLimit(0);
      slider->setUpperLinLimit(btScalar(0.06));
      slider->setLowerAngLimit(0);
      slider->setUpperAngLimit(0);
      slider->setPoweredLinMotor(true);
      slider->setMaxLinMotorForce(btScalar(kForce[2]));
      sliders_[i] = slider.get();
      world.joints.push_back(std::move(slider));
    }
    for (const auto& joint : world.joints) world.world.addConstraint(joint.get(), true);
  }
  // Position of x and z. [m]
  [[nodiscard]] double at(int axis) const {
    if (palm_ != nullptr) return double((palm_->getWorldTransform().getOrigin() - start_)[axis == 0 ? 0 : 2]);
    return double(joints_[axis].multibody->getJointPos(joints_[axis].link));
  }
  void drive(int axis, double velocity) {
    if (palm_ == nullptr) {
      motors_[axis]->setVelocityTarget(btScalar(velocity));
    } else if (axis < 2) {
      gantry_->setTargetVelocity(axis == 0 ? 0 : 2, btScalar(-velocity));  // of the world
    } else {
      sliders_[axis - 2]->setTargetLinMotorVelocity(btScalar(velocity));
    }
  }

 private:
  bullet::JointPlace joints_[4];
  btMultiBodyJointMotor* motors_[4] = {};
  btRigidBody* palm_ = nullptr;
  btVector3 start_;
  btGeneric6DofSpring2Constraint* gantry_ = nullptr;
  btSliderConstraint* sliders_[2] = {};
};

struct Grasp {
  double slip = 0;    // largest motion of the thing in the hand, from the grasp to the table. [m]
  double tilt = 0;    // largest, in the hand. [rad]
  double height = 0;  // at the top. [m]
  double end_tilt = 0, end_height = 0, end_speed = 0;
};

double smooth(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double tilt_of(const btTransform& at, const btVector3& up) {
  return std::acos(std::min(1.0, double((at.getBasis() * up).z())));
}

// Closes, lifts by 15 cm, shakes along x and z, sets down, opens.
Grasp grasp(const std::string& manifest, Robot robot, double rate, double yaw, double shift) {
  RobotWorld world(0.001);
  bullet::Scene scene = bullet::load_scene(manifest, world.world, {.multibodies = robot == Robot::multibody});
  EXPECT_EQ(scene.error(), "");
  Grasp result;
  if (!scene.error().empty()) return result;
  for (int i = 0; i < world.world.getNumCollisionObjects(); ++i) {
    world.world.getCollisionObjectArray()[i]->setActivationState(DISABLE_DEACTIVATION);
  }
  btRigidBody& thing = *scene.find("thing");
  const btTransform turned(btQuaternion({0, 0, 1}, btScalar(yaw)), {0, btScalar(shift), 0});
  thing.setCenterOfMassTransform(turned * thing.getWorldTransform());
  // Fingers may hold a scan at one point each. Without torque at the points it turns about the line between them, at a
  // fifth of all yaws so far that it tips over on the table. Pads are soft: they give a torque of 2 mm times the force.
  thing.setSpinningFriction(btScalar(0.002));
  const btVector3 up = thing.getWorldTransform().getBasis().transpose() * btVector3(0, 0, 1);
  const double first = double(thing.getWorldTransform().getOrigin().z());
  const double dt = 1 / rate;
  Axes4 axes(world, scene, robot, dt);
  const auto wanted = [](int axis, double t) {
    const double shake = t > 1 && t < 2 ? 1 : 0;
    if (axis == 0) return shake * 0.03 * std::sin(2 * SIMD_PI * 3 * t);
    return 0.15 * (smooth((t - 0.4) / 0.6) - smooth((t - 2) / 0.6)) + shake * 0.02 * std::sin(2 * SIMD_PI * 4 * t);
  };
  btVector3 held(0, 0, 0);
  bool is_held = false;
  for (int i = 0; i < static_cast<int>(3.4 * rate); ++i) {
    const double t = i * dt;
    for (const int axis : {0, 1}) {
      axes.drive(axis, (wanted(axis, t + dt) - wanted(axis, t)) / dt + 0.2 * rate * (wanted(axis, t) - axes.at(axis)));
    }
    for (const int axis : {2, 3}) axes.drive(axis, t < 2.6 ? 0.1 : -0.1);
    world.step(1, btScalar(dt));
    const btTransform& at = thing.getWorldTransform();
    if (t > 0.38 && t < 2.55) {
      const btVector3 in_hand = at.getOrigin() - btVector3(btScalar(axes.at(0)), 0, btScalar(axes.at(1)));
      if (!is_held) held = in_hand;
      is_held = true;
      result.slip = std::max(result.slip, double((in_hand - held).length()));
      result.tilt = std::max(result.tilt, tilt_of(at, up));
      result.height = std::max(result.height, double(at.getOrigin().z()) - first);
    }
  }
  result.end_tilt = tilt_of(thing.getWorldTransform(), up);
  result.end_height = double(thing.getWorldTransform().getOrigin().z()) - first;
  result.end_speed = double(thing.getLinearVelocity().length());
  return result;
}

void expect_lifted(const std::string& manifest, Robot robot, double rate, double yaw, double shift) {
  const Grasp g = grasp(manifest, robot, rate, yaw, shift);
  const auto what = [&] {
    return std::to_string(rate) + " Hz, yaw " + std::to_string(yaw) +
           (robot == Robot::rigid ? ", rigid" : ", multibody");
  };
  EXPECT_GT(g.height, 0.16) << what();
  // Shaken at up to 1.6 g it creeps between the fingers, more in those of rigid bodies.
  EXPECT_LT(g.slip, robot == Robot::rigid ? 0.04 : 0.01) << what();
  if (robot == Robot::multibody) {  // the solver of rigid bodies has no spinning friction without rolling friction
    EXPECT_LT(g.tilt, 0.3) << what();
  }
  EXPECT_LT(g.end_tilt, 0.005) << what();  // no scan stands on a flat bottom
  EXPECT_NEAR(g.end_height, 0, 2e-4) << what();
  EXPECT_LT(g.end_speed, 0.02) << what();
}

TEST(RobotScenes, AGripperLiftsShakesAndSetsDownAMug) {
  const TemporaryFolder folder;
  write_obj(make_mug(), folder / "mug.obj");
  bake_gripper(folder, folder / "mug.obj", 0);
  const std::string manifest = folder / "out/scene.vps.json";
  for (const double yaw : {0.0, 0.6, 2.8}) expect_lifted(manifest, Robot::multibody, 240, yaw, 0.005);
  expect_lifted(manifest, Robot::multibody, 1000, 0, 0);
  expect_lifted(manifest, Robot::rigid, 240, 0.6, 0);
}

TEST(RobotScenes, AGripperLiftsShakesAndSetsDownAScan) {
  VPS_SHARED_FILE_OR_SKIP(scan, "scenes/ycb_tabletop/ycb_objects/YcbTomatoSoupCan/textured_simple_reoriented.obj");
  const TemporaryFolder folder;
  double lowest = 1;
  std::ifstream in(scan);
  for (std::string line; std::getline(in, line);) {
    double x = 0;
    double y = 0;
    double z = 0;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) lowest = std::min(lowest, z);
  }
  bake_gripper(folder, scan.string(), -lowest);
  for (const double yaw : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
    expect_lifted(folder / "out/scene.vps.json", Robot::multibody, 240, yaw, 0);
  }
}

// A hand turns a nut on its bolt: a hinge with a motor on a wrist that slides along the axis.
struct Turned {
  double angle = 0, height = 0, off_helix = 0;
};

Turned turn_nut(Robot robot, const std::shared_ptr<Asset>& nut_asset, const std::shared_ptr<Asset>& bolt_asset,
                double rate, double speed) {
  constexpr double kPitch = 0.0015;
  constexpr double kMass = 0.01;
  constexpr double kTorque = 0.005;  // [N m]
  RobotWorld world(nut_asset->info().voxel_size);
  bullet::Shape nut(nut_asset);
  bullet::Shape bolt(bolt_asset);
  nut.set_segments(15);
  bolt.set_segments(15);
  btRigidBody& fixed = world.add(bolt, 0, {0, 0, 0});
  fixed.setWorldTransform(bolt.body_pose(btTransform::getIdentity()));
  fixed.setFriction(0);
  const btTransform start = nut.body_pose(btTransform::getIdentity());
  btVector3 inertia;
  nut.calculateLocalInertia(btScalar(kMass), inertia);
  const double dt = 1 / rate;
  const btCollisionObject* object = nullptr;
  if (robot == Robot::multibody) {
    btMultiBody& hand = world.add_multibody(2, 0, {0, 0, 0}, start.getOrigin());
    hand.setupPrismatic(0, btScalar(kMass), inertia, -1, btQuaternion::getIdentity(), {0, 0, 1}, {0, 0, 0}, {0, 0, 0},
                        true);
    hand.setupRevolute(1, btScalar(kMass), inertia, 0, btQuaternion::getIdentity(), {0, 0, 1}, {0, 0, 0}, {0, 0, 0},
                       true);
    world.finish(hand);
    btMultiBodyLinkCollider& link = world.collide(hand, 1, nut);
    link.setFriction(0);
    object = &link;
    world.drive(hand, 1, btScalar(speed), btScalar(kTorque * dt));
  } else {
    btRigidBody& body = world.add(nut, btScalar(2 * kMass), start.getOrigin());
    body.setFriction(0);
    object = &body;
    auto wrist = std::make_unique<btGeneric6DofSpring2Constraint>(body, btTransform::getIdentity());
    wrist->setLinearLowerLimit({0, 0, 1});
    wrist->setLinearUpperLimit({0, 0, -1});
    wrist->setAngularLowerLimit({0, 0, 1});
    wrist->setAngularUpperLimit({0, 0, -1});
    wrist->enableMotor(5, true);
    wrist->setTargetVelocity(5, btScalar(-speed));  // of the world about the nut
    wrist->setMaxMotorForce(5, btScalar(kTorque));
    world.world.addConstraint(wrist.get(), true);
    world.joints.push_back(std::move(wrist));
  }
  Turned turned;
  for (int i = 0; i < static_cast<int>(0.5 * rate); ++i) {
    world.step(1, btScalar(dt));
    const btTransform& at = object->getWorldTransform();
    const double angle = std::atan2(double(at.getBasis()[1][0]), double(at.getBasis()[0][0]));
    turned.angle = angle + 2 * SIMD_PI * std::round((turned.angle - angle) / (2 * SIMD_PI));
    turned.height = double(at.getOrigin().z() - start.getOrigin().z());
    turned.off_helix = std::max(turned.off_helix, std::abs(turned.height - kPitch * turned.angle / (2 * SIMD_PI)));
  }
  return turned;
}

TEST(RobotScenes, AHandTurnsANutOnItsBolt) {
  const auto nut = baked_at(samples::make_nut(), 0.00025);
  const auto bolt = baked_at(samples::make_bolt(), 0.00025);
  constexpr double kPlay = samples::kThreadClearance * samples::kM10.pitch / 2 / samples::kM10.depth;
  for (const Robot robot : {Robot::multibody, Robot::rigid}) {
    for (const auto& [rate, speed] : {std::pair(240.0, -10.0), {240.0, 10.0}, {500.0, 30.0}, {1000.0, -10.0}}) {
      const Turned turned = turn_nut(robot, nut, bolt, rate, speed);
      EXPECT_NEAR(turned.angle, 0.5 * speed, 0.05 * std::abs(speed)) << rate << ' ' << static_cast<int>(robot);
      EXPECT_LT(turned.off_helix, kPlay + 0.00025 / 4) << rate << ' ' << speed << ' ' << static_cast<int>(robot);
    }
  }
}

}  // namespace
}  // namespace vps::test
