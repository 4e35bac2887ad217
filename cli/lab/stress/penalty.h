// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A body under penalty forces, integrated by symplectic Euler, and its stability limit by theory.
///
/// A mode of the linearised contact with angular frequency w is stable under symplectic Euler while w dt < 2 (e.g.
/// Hairer, Lubich and Wanner, Geometric Numerical Integration, I.1). The contact's stiffness k is the foundation times
/// the area in contact, and m_eff = k / w_max^2 contains the masses, moments and levers in the contact's gradient. The
/// limit is then k dt^2 < 4 m_eff. A damper c takes 2 c dt of it: k dt^2 + 2 c dt < 4 m_eff.
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "cli/lab/stress/rest_poses.h"
#include "cli/lab/stress/stress.h"
#include "runtime/vps_contacts.h"

namespace vps::stress {

/// The ground that the body is pressed into.
enum class Ground : std::uint8_t { plane, voxelmap };

/// An asset that lies with a face of its convex hull flat on the ground, pressed in by half a voxel. A constant wrench
/// balances it there, so that the equilibrium is the same for any stiffness.
class PressedBody {
 public:
  /// @throw std::runtime_error when a query fails
  PressedBody(const Subject& subject, Ground ground);
  /// Why nothing can be measured; empty when it can.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  [[nodiscard]] double area() const { return area_; }                      ///< in contact. [m^2]
  [[nodiscard]] double effective_mass() const { return effective_mass_; }  ///< [kg]
  [[nodiscard]] double depth() const { return depth_; }                    ///< of the deepest point. [m]

  struct LoopOptions {
    double stiffness = 0;  ///< k, of the whole contact. [N/m]
    double damping = 0;    ///< c, of the whole contact. [N s/m]
    double step = 1e-3;    ///< [s]
    int steps = 300;
    double disturbance = 1e-3;  ///< of the pose, over the depth
  };
  struct LoopResult {
    double growth = 0;  ///< largest disturbance over the first; infinite from 100 on and for NaN
    std::vector<double> trace;
  };
  [[nodiscard]] LoopResult run(const LoopOptions& options) const;
  /// Energy after a bounce onto the face over the energy before, less 1. [-]
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

/// Largest stable k dt^2 over its limit by theory, found by bisection to a thousandth. The limit is 4 m_eff, less the
/// part of a damper of `damping_share` k dt.
[[nodiscard]] double measured_over_theory(const PressedBody& body, double step, double damping_share);

}  // namespace vps::stress
