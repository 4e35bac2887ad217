// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A world with y up and one floor, in which bodies are dropped and observed.
#pragma once

#include <vector>

#include "tests/paper/bodies.h"
#include "tests/support/bullet_world.h"

namespace vps::paper {

struct SceneOptions {
  double gravity = 9.81;             ///< [m/s^2]
  double rate = 200;                 ///< [Hz]
  double voxel = bench::kVoxelSize;  ///< of the compared assets: split impulses start at twice this. [m]
};

/// A world without sleeping bodies. GImpact and the algorithm of this project are registered.
class Scene {
 public:
  Scene(const Floor& floor, Motion motion, const SceneOptions& options);
  /// Adds a body of 1 kg with friction 0.5. @param inertia  0: from the shape. [kg m^2]
  btRigidBody& add(const lab::BulletShape& body, const btTransform& at, const btVector3& inertia = {0, 0, 0});
  void set_floor_restitution(btScalar restitution);
  void step();
  /// Time of the last step's narrowphase. [us]
  [[nodiscard]] double last_us() const { return world_.dispatcher.last_us; }
  /// Time of the whole last step. [us]
  [[nodiscard]] double last_step_us() const { return last_step_us_; }

 private:
  bullet::ContinuousMotion continuous_;
  test::World world_;
  const SceneOptions options_;
  double last_step_us_ = 0;
};

/// A bunny of 1 kg as in Sec. 4.2: its lowest corner 0.5 m above the floor.
class Drop {
 public:
  Drop(const Side& side, const Floor& floor, const std::vector<btVector3>& corners, const btMatrix3x3& rotation,
       const SceneOptions& options);
  void step() { scene_.step(); }
  [[nodiscard]] const btRigidBody& body() const { return *body_; }
  [[nodiscard]] double height() const { return double(body_->getWorldTransform().getOrigin().y()); }
  /// Height of the real bunny's lowest point above the floor. [m]
  [[nodiscard]] double lowest() const;
  [[nodiscard]] const Scene& scene() const { return scene_; }

 private:
  const std::vector<btVector3>& corners_;
  Scene scene_;
  btRigidBody* body_;
};

inline constexpr double kDropHeight = 0.5;  // [m]
inline constexpr int kRotations = 10;

/// The rotations of Table 2, drawn from the fixed seed of tests/support/random.h.
[[nodiscard]] std::vector<btMatrix3x3> random_rotations(int count);

}  // namespace vps::paper
