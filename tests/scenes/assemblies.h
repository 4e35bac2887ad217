// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Parts of the scenes and how they start, shared by the scenes' programs and their benchmark.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "tests/scenes/scene.h"

namespace vps::scenes {

inline constexpr double kSteel = 7800;    ///< [kg/m^3]
inline constexpr double kGravity = 9.81;  ///< [m/s^2]

/// A nut above its place on a fixed bolt.
struct Thread {
  Part bolt, nut;
  double pitch = 0;    ///< [m]
  double play = 0;     ///< along the axis, from the middle to either flank. [m]
  double lift = 0;     ///< start of the nut above its position in the file, whole turns. [m]
  double torque = 0;   ///< about z, relative to gravity's torque through the helix
  double seconds = 0;  ///< of the scene
  double slowest = 0;  ///< least part of the frictionless descent

  [[nodiscard]] double turn_per_metre() const;                        ///< [rad/m]
  [[nodiscard]] double torque_on(const btRigidBody& nut_body) const;  ///< about z. [N m]
};
/// @param variant  "fine", "sample" or "factory"; the last needs the shared folder. Both parts have segments.
[[nodiscard]] Thread make_thread(const std::string& variant);
/// Places both without friction. @param turn  of the nut on its thread, upwards [rad] @return the nut
btRigidBody& place(Run& run, const Thread& thread, double turn = 0);

/// A peg off-centre and tilted over its hole, which stands on a box.
struct Fit {
  Part peg, hole;
  double clearance = 0;    ///< on every side. [m]
  double hole_height = 0;  ///< [m]
};
/// @param variant  "sample", "round" or "rectangular"; the last two need the shared folder
[[nodiscard]] Fit make_fit(const std::string& variant);
/// @param direction  in which the peg is off-centre and leans, about z [rad] @return the peg
btRigidBody& place(Run& run, const Fit& fit, double direction = 0);

/// Two gears on parallel axes: a torque drives one, a brake in proportion to its speed holds the other.
struct Train {
  static constexpr double kTorque = 0.01;  ///< on the driver. [N m]
  static constexpr double kSpeed = 5;      ///< steady speed of the driver under the brake. [rad/s]

  Part driver, driven;
  btTransform driven_at = btTransform::getIdentity();
  double ratio = 1;     ///< of the driven gear's speed to the driver's, from the numbers of teeth
  double backlash = 0;  ///< largest lag of the driven gear at this distance of the axes. [rad]

  /// Torques about z on the driver and the driven gear. [N m]
  [[nodiscard]] std::array<double, 2> torques(const btRigidBody& driven_body) const;
};
/// @param variant  "sample" or "factory"; the latter needs the shared folder
[[nodiscard]] Train make_train(const std::string& variant);

/// The gears of a train on their hinges, without friction. Ends before its world.
class HingedTrain {
 public:
  /// @param turn  of the driver; the driven gear follows [rad]
  HingedTrain(test::World& world, Run& run, const Train& train, double turn = 0);
  HingedTrain(const HingedTrain&) = delete;
  HingedTrain& operator=(const HingedTrain&) = delete;
  ~HingedTrain();
  const std::array<btRigidBody*, 2> gears;  ///< driver, driven

 private:
  test::World& world_;
  std::array<std::unique_ptr<btHingeConstraint>, 2> hinges_;
};

/// Copies of one body, 1 kg each, turned at random, in layers over a box with walls.
struct Heap {
  int across = 2;  ///< bodies along either side of a layer
  int layers = 1;
  std::uint64_t seed = 1;  ///< of the bodies' rotations
};
void place(Run& run, const Heap& heap, const Part& part);

}  // namespace vps::scenes
