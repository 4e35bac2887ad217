// SPDX-License-Identifier: Zlib
/// @file What can be made of the contacts of a query: the penalty wrench in newtons with its gradient, few contacts for
/// many, and queries of many pairs at once.
///
/// Everything is in the frame of the contacts, the map frame. Nothing throws. Only functions that say so allocate.
#pragma once

#include "runtime/vps_runtime.h"

namespace vps {

/// Pressure on the shell's surface: stiffness * V - damping * (speed out of the field), never less than 0.
struct PenaltyLaw {
  double stiffness = 0;  ///< of the foundation. [Limits: value >= 0] [Units: N/m^3]
  double damping = 0;    ///< [Limits: value >= 0] [Units: N s/m^3]
};

/// Motion of the pointshell's body relative to the field's, map frame.
struct Twist {
  Vec3 centre;   ///< a point of the shell's body; torques are about it. [m]
  Vec3 linear;   ///< velocity of `centre`. [m/s]
  Vec3 angular;  ///< [rad/s]
};

/// On the pointshell's body; the field's body feels the opposite.
struct Wrench {
  double force[3] = {0, 0, 0};   ///< [N]
  double torque[3] = {0, 0, 0};  ///< about Twist::centre. [N m]
};

/// Eqs. (2) and (3) in newtons: the sum of pressure * area * inward_normal over the contacts with V >= 0. As each point
/// stands for its area, the wrench does not grow with the number of points. Damping works against each point's speed
/// along its own normal: it takes energy or leaves it, and never pulls.
/// @return bad_argument, and a zero wrench, when the law or the twist is not finite or the law negative
[[nodiscard]] Status penalty_wrench(std::span<const Contact> contacts, const PenaltyLaw& law, const Twist& twist,
                                    Wrench& out) noexcept;

/// How the wrench changes, for implicit integrators: rows are force x, y, z, torque x, y, z; columns the same of the
/// change. Symmetric only where the two bodies' normals are opposite.
struct WrenchGradient {
  double pose[36] =
      {};  ///< by translation, then by rotation about `centre`, which goes along. Map frame. [N/m, N, N m]
  double twist[36] = {};  ///< by linear, then by angular velocity: symmetric, never positive. [N s/m, N s, N m s]
};

/// Gradient of `penalty_wrench`, for the contacts that press; the set of contacts is held.
/// @param outward_normals  of the field at the contacts, in their order, as `outward_normal` has them. Empty: opposite
///                         to the shell's, which is right where two smooth surfaces touch and else an estimate. A zero
///                         vector, where the field has no slope, adds no stiffness
/// @return bad_argument also when the spans differ in length
[[nodiscard]] Status penalty_gradient(std::span<const Contact> contacts, std::span<const Vec3> outward_normals,
                                      const PenaltyLaw& law, const Twist& twist, WrenchGradient& out) noexcept;

/// What a reduction lost. Of the sums over contacts with V >= 0 of V n A and (P - centre) x V n A: the length of the
/// difference, over the sum of the lengths of the terms of the full set. [-]
struct Reduction {
  std::uint32_t kept = 0;
  double force_residual = 0;
  double torque_residual = 0;
};

/// Working memory of one thread: grows with the contacts.
struct ReductionScratch {
  std::vector<float> distances;
  std::vector<std::uint32_t> nearest;
};

/// Few contacts in the place of many, with the same force and torque about any point, as far as non-negative areas can:
/// the deepest, then each time the one that is deep and far from those kept; each contact's area goes to the nearest of
/// them, and then areas change by least squares until the six sums agree. Eight contacts suffice in most cases, three
/// on a plane. The same contacts in the same order give the same answer.
/// @param all     contacts of a query
/// @param centre  about which the torque's residual is meant. [m]
/// @param kept    their number is its size; positions, penetrations, normals, point and node are those of `all`
[[nodiscard]] Status reduce_contacts(std::span<const Contact> all, Vec3 centre, std::span<Contact> kept,
                                     ReductionScratch& scratch, Reduction& result) noexcept;

/// One query of a batch.
struct PairQuery {
  const PointshellView* shell = nullptr;
  const VoxelmapView* map = nullptr;
  Pose shell_pose, map_pose;  ///< of the bodies, to world
  QueryOptions options;       ///< a cache must not be shared with another pair
  std::span<Contact> out;
};
struct PairAnswer {
  Status status = Status::ok;
  QueryResult result;
};

/// How a batch runs in parallel.
struct Executor {
  using Task = void (*)(void* batch, std::uint32_t worker);
  std::uint32_t workers = 1;  ///< [Limits: value >= 1]
  /// Calls task(batch, worker) once for each worker from 0 on, on any threads in any order, and returns when all have
  /// returned. Null: one after the other on the caller's thread.
  void (*run)(void* context, std::uint32_t workers, Task task, void* batch) = nullptr;
  void* context = nullptr;
};

/// Starts a thread for each worker but the first: for programs without a pool of their own, and batches of
/// milliseconds.
/// @param workers  0: as many as the machine has
[[nodiscard]] Executor thread_executor(std::uint32_t workers) noexcept;

/// Working memory of a batch: grows with the workers, and with their largest shells.
struct BatchScratch {
  std::vector<Scratch> workers;
};

/// `traverse` for each pair, which first compares the shell's root sphere with the field (Sec. 3.2). Answers are those
/// of single queries to the bit, whatever the executor; but for budgets of time.
/// @return bad_argument when the spans differ in length or there is no worker; the status of each pair is in its answer
[[nodiscard]] Status traverse_batch(std::span<const PairQuery> queries, std::span<PairAnswer> answers,
                                    BatchScratch& scratch, const Executor& executor) noexcept;

}  // namespace vps
