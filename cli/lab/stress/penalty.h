// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A body in a loop of penalty forces, integrated by symplectic Euler, and where theory says that it ends to be
/// stable.
///
/// A mode of the linearised contact with angular frequency w is stable under symplectic Euler while w dt < 2 (e.g.
/// Hairer, Lubich and Wanner, Geometric Numerical Integration, I.1). With the contact's stiffness k = foundation times
/// area in touch, and m_eff = k / w_max^2 by the masses, moments and levers in the contact's gradient, that is
/// k dt^2 < 4 m_eff; a damper c takes 2 c dt of it: k dt^2 + 2 c dt < 4 m_eff.
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "cli/lab/stress/rest_poses.h"
#include "cli/lab/stress/stress.h"
#include "runtime/vps_contacts.h"

namespace vps::stress {

/// What the body is pressed into.
enum class Ground : std::uint8_t { plane, voxelmap };

/// A pose of an asset with a face of its convex hull flat on the ground, pressed in by half a voxel; a constant wrench
/// holds it in balance there, so that the same equilibrium serves any stiffness.
class PressedBody {
 public:
  /// @throw std::runtime_error when a query fails
  PressedBody(const Subject& subject, Ground ground);
  /// Why there is nothing to measure; empty when there is.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  [[nodiscard]] double area() const { return area_; }                      ///< in touch. [m^2]
  [[nodiscard]] double effective_mass() const { return effective_mass_; }  ///< [kg]
  [[nodiscard]] double depth() const { return depth_; }                    ///< of the deepest point. [m]

  struct LoopOptions {
    double stiffness = 0;  ///< k, of the whole contact. [N/m]
    double damping = 0;    ///< c, of the whole contact. [N s/m]
    double step = 1e-3;    ///< [s]
    int steps = 300;
    double disturbance = 1e-3;  ///< of pose, in parts of the depth
  };
  struct LoopResult {
    double growth = 0;  ///< largest disturbance over the first; infinite when it is no number
    std::vector<double> trace;
  };
  [[nodiscard]] LoopResult run(const LoopOptions& options) const;
  /// Energy that a bounce onto the face leaves over what it had, less 1. [-]
  [[nodiscard]] double bounce(double stiffness, double step) const;

 private:
  void query(const Pose& shell_to_field, std::vector<Contact>& contacts) const;
  [[nodiscard]] bool settle(const RestPose& rest, const std::vector<btVector3>& corners);

  std::shared_ptr<const Asset> asset_, slab_;
  PointshellView shell_;
  VoxelmapView map_;
  Ground ground_;
  double slab_top_ = 0;
  std::uint64_t seed_;
  Eigen::Vector3d centre_;  // of mass, asset frame
  double mass_ = 1;
  Eigen::Matrix3d inertia_;  // asset frame
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d position_;  // of the centre of mass, field frame
  double area_ = 0, effective_mass_ = 0, depth_ = 0;
  std::string refusal_;
};

/// Largest k dt^2 that a loop stands, over 4 m_eff (or what a damper of `damping_share` k dt leaves of it), by
/// bisection to a thousandth.
[[nodiscard]] double measured_over_theory(const PressedBody& body, double step, double damping_share);

}  // namespace vps::stress
