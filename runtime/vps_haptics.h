// SPDX-License-Identifier: Zlib
/// @file A tool that a haptic device holds by a spring: what to feel, a thousand times a second.
///
/// The tool is the virtual body; the device's handle goes where the hand moves it, also into walls, and the tool
/// follows as far as contacts let it. Each cycle moves the tool to where the spring is shortest and nothing penetrates,
/// contacts being constraints (as in Ortega, Redon and Coquillart 2007): no mass, nothing to integrate, no stiffness of
/// contacts to choose. The hand feels the spring alone (static virtual coupling; Wan and McNeely 2003), never more.
///
/// Everything is in the map's frame: for a map that moves give the device's pose relative to it.
#pragma once

#include <array>

#include "runtime/vps_contacts.h"

namespace vps {

struct CouplingOptions {
  double linear_stiffness = 2000;  ///< of the spring. [Limits: value > 0] [Units: N/m]
  double angular_stiffness = 1;    ///< [Limits: value > 0] [Units: N m/rad]
  double max_force = 20;  ///< of the device: force and torque are scaled down together. [Limits: value > 0] [Units: N]
  std::uint32_t max_iterations = 4;  ///< moves a cycle, of a voxel at most near contacts. [Limits: value >= 1]
  float max_microseconds = 0;        ///< of each query, see QueryOptions. 0: no limit. [Limits: value >= 0]
};

/// What a cycle found.
struct HapticCycle {
  Wrench felt;                 ///< on the handle, torque about the tool's centre of mass. [N, N m]
  Pose tool;                   ///< shell_to_map
  double penetration = 0;      ///< of the tool's deepest point, as QueryResult::delta. [m]
  std::uint32_t contacts = 0;  ///< that press
  std::uint32_t iterations = 0;
  bool complete = true;  ///< false: the time limit cut a query short
};

/// One tool against one map. Views must outlive it; it allocates in the constructor and while its contacts grow.
class VirtualTool {
 public:
  /// @param start  where tool and handle are at first, shell_to_map; a tool that starts inside the map may stay there
  VirtualTool(const PointshellView& tool, const VoxelmapView& map, const Pose& start, const CouplingOptions& options);

  /// One cycle.
  /// @param device  the handle's pose: where the tool would be without contacts, shell_to_map
  /// @return `bad_pose`, `bad_argument` for options outside their limits, or what the query says; the tool stays then,
  ///         and nothing is felt
  [[nodiscard]] Status step(const Pose& device, HapticCycle& cycle) noexcept;

 private:
  using Vector6 = std::array<double, 6>;  // translation, then rotation about the centre of mass
  struct Constraint {
    Vector6 out;         // along a contact
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
