// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A stock Bullet world that checks its bodies for NaN at every step.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "cli/lab/stress/stress.h"
#include "cli/lab/timed_dispatcher.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::stress {

inline constexpr double kGravity = 9.81;  ///< [m/s^2]

struct ArenaOptions {
  Detection detection = Detection::discrete;
  double gravity = 9.81;  ///< along -z. [m/s^2]
  int iterations = 10;    ///< of the solver; Bullet's default
  double voxel = 0;       ///< size of the world's voxels; 0: the subject's. [m]
};

/// Bodies never sleep. As docs/bullet.md advises, split impulses start at two voxels of penetration and friction acts
/// along two directions.
class Arena {
 public:
  Arena(const Subject& subject, const ArenaOptions& options);
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// @param mass     0: static. [kg]
  /// @param inertia  about the body's axes; zero: from the shape. [kg m^2]
  btRigidBody& add(const lab::BulletShape& shape, double mass, const btTransform& at,
                   const btVector3& inertia = {0, 0, 0});
  /// The half space below z = 0.
  btRigidBody& add_plane();
  /// Takes one step and then checks every body's pose and velocities.
  /// @return false when one is not finite, now or before. `failure` names the body, the value and the step
  bool step(double dt);
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Of all moving bodies. [J]
  [[nodiscard]] double kinetic_energy() const;
  /// Kinetic energy and potential energy by height. [J]
  [[nodiscard]] double energy() const;
  [[nodiscard]] btDiscreteDynamicsWorld& world() { return world_; }
  [[nodiscard]] lab::TimedDispatcher& dispatcher() { return dispatcher_; }

 private:
  void watch();

  const ArenaOptions options_;
  btDefaultCollisionConfiguration configuration_;
  lab::TimedDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  const std::unique_ptr<btConstraintSolver> solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, solver_.get(), &configuration_};
  bullet::ContinuousMotion continuous_;
  std::vector<std::unique_ptr<btCollisionShape>> planes_;
  std::vector<lab::BulletShape> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::string failure_;
  long steps_ = 0;
};

/// Corners of the points' convex hull. [m]
[[nodiscard]] std::vector<btVector3> hull_corners(const std::vector<std::array<double, 3>>& points);
/// Corners of the convex hull of the shell's points, about the centre of mass; none without a shell. [m]
[[nodiscard]] std::vector<btVector3> shell_corners(const Asset& asset);
/// z of the lowest corner. [m]
[[nodiscard]] double lowest(const btTransform& at, const std::vector<btVector3>& corners);
[[nodiscard]] inline double lowest(const btRigidBody& body, const std::vector<btVector3>& corners) {
  return lowest(body.getWorldTransform(), corners);
}
/// An unrotated pose whose lowest corner is at a height. [m]
[[nodiscard]] btTransform standing(const std::vector<btVector3>& corners, double height);
[[nodiscard]] double kinetic_energy(const btRigidBody& body);
/// Keeps the larger value. A NaN stays, whatever comes after it, and breaks the trial.
inline void keep_largest(double& most, double value) {
  if (!(value <= most) && !std::isnan(most)) most = value;
}
/// A broken trial for a NaN in the arena.
[[nodiscard]] Trial broken(const Arena& arena);
/// Values of a run, thinned to at most 200.
class Trace {
 public:
  explicit Trace(long steps) : every_(steps / 200 + 1) {}
  void add(double value) {
    if (seen_++ % every_ == 0) values.push_back(value);
  }
  std::vector<double> values;

 private:
  long every_, seen_ = 0;
};

/// Number of bounces within a time of a ball that falls from a height without loss: one after t = sqrt(2 h / g), and
/// one every 2 t after it. At least 1.
[[nodiscard]] int bounces_of_a_ball(double height, double seconds);
/// Energy that a ball gains, over m g height, when a bounce is detected a step late: it is then up to v dt deep, and is
/// lifted by that.
[[nodiscard]] double gain_of_a_late_bounce(double height, double rate);

/// One body of a stack.
struct StackBody {
  lab::BulletShape shape;
  std::vector<btVector3> corners;
  btTransform at;     ///< pose of the lowest body, on z = 0
  double height = 0;  ///< [m]
  const char* what = "";
};
/// The column's shape where the asset has two flat faces opposite to each other. Otherwise a cube: baked in this
/// project's columns, Bullet's box in the others.
[[nodiscard]] StackBody stack_body(const Subject& subject, const Column& column);

/// Whether Bullet's own hull can be measured beside the column. It is no control of itself.
[[nodiscard]] inline bool has_control(const Subject& subject, const Column& column) {
  return subject.hull.body.shape != nullptr && column.name != subject.hull.name;
}
inline constexpr const char* kHullControl =
    "The verdict is `solver` where Bullet's own hull of the body breaks it too and is less than 1.5 times better.";

inline constexpr const char* kTooManyTriangles =
    "GImpact takes tens of milliseconds a step with more than 5,000 triangles";

}  // namespace vps::stress
