// SPDX-License-Identifier: Zlib
/// @file A tool that a spring couples to a haptic device: computes the force on the hand, a thousand times a second.
///
/// The tool is a virtual body. The hand moves the device's handle freely, also into walls; the tool follows as far as
/// contacts allow. Each cycle moves the tool to where the spring is shortest and nothing penetrates. Contacts are
/// constraints (as in Ortega, Redon and Coquillart 2007), so there is no mass, no integration, and no contact stiffness
/// to choose. The hand feels only the spring (static virtual coupling; Wan and McNeely 2003).
///
/// Everything is in the map's frame. For a moving map, give the device's pose relative to it.
#pragma once

#include <array>

#include "runtime/vps_contacts.h"

namespace vps {

struct CouplingOptions {
  double linear_stiffness = 2000;  ///< of the spring. [Limits: value > 0] [Units: N/m]
  double angular_stiffness = 1;    ///< [Limits: value > 0] [Units: N m/rad]
  double max_force = 20;  ///< of the device; force and torque are scaled down together. [Limits: value > 0] [Units: N]
  std::uint32_t max_iterations = 4;  ///< moves per cycle; at most one voxel each near contacts. [Limits: value >= 1]
  float max_microseconds = 0;        ///< of each query, see QueryOptions. 0: no limit. [Limits: value >= 0]
};

/// Result of a cycle.
struct HapticCycle {
  Wrench felt;                 ///< on the handle, torque about the tool's centre of mass. [N, N m]
  Pose tool;                   ///< shell_to_map
  double penetration = 0;      ///< of the tool's deepest point, as QueryResult::delta. [m]
  std::uint32_t contacts = 0;  ///< contacts that press
  std::uint32_t iterations = 0;
  bool complete = true;  ///< false: a query reached its time limit
};

/// One tool against one map. The views must outlive it. It allocates in the constructor and while its contacts grow.
class VirtualTool {
 public:
  /// @param start  initial pose of tool and handle, shell_to_map; a tool that starts inside the map may stay there
  VirtualTool(const PointshellView& tool, const VoxelmapView& map, const Pose& start, const CouplingOptions& options);

  /// One cycle.
  /// @param device  the handle's pose: where the tool would be without contacts, shell_to_map
  /// @return `bad_pose`, `bad_argument` for options outside their limits, or the query's status. The tool stays then,
  ///         and HapticCycle::felt is zero
  [[nodiscard]] Status step(const Pose& device, HapticCycle& cycle) noexcept;

 private:
  using Vector6 = std::array<double, 6>;  // translation, then rotation about the centre of mass
  struct Constraint {
    Vector6 out;         // normal out of the map, and its moment about the centre of mass
    double penetration;  // [m]
    double force;        // [N]
  };
  [[nodiscard]] Status find_constraints(HapticCycle& cycle, double& free_way) noexcept;
  [[nodiscard]] Vector6 constrained(const Vector6& wish, HapticCycle& cycle) noexcept;

  const PointshellView* tool_;
  const VoxelmapView* map_;
  const CouplingOptions options_;
  Pose pose_;
  Scratch scratch_;
  ContactCache cache_;
  std::vector<Contact> contacts_;
  std::vector<Constraint> constraints_;
};

}  // namespace vps
