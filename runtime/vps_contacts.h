// SPDX-License-Identifier: Zlib
/// @file Functions of a query's contacts: the penalty wrench in newtons and its gradient, and reduction to few
/// contacts. Also the few contacts of a pair that an engine needs in a step, and queries of many pairs at once.
///
/// Everything is in the frame of the contacts, the map frame, unless it says world. Nothing throws. Only functions that
/// say so allocate, and those with a scratch until it has grown.
#pragma once

#include <memory>

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

/// Acts on the pointshell's body; the opposite acts on the field's body.
struct Wrench {
  double force[3] = {0, 0, 0};   ///< [N]
  double torque[3] = {0, 0, 0};  ///< about Twist::centre. [N m]
};

/// Eqs. (2) and (3) in newtons: the sum of pressure * area * inward_normal over the contacts with V >= 0. Each point
/// is weighed by its area, so the wrench does not grow with the number of points. Damping acts against each point's
/// speed along its own normal: it never adds energy and never pulls.
/// @return bad_argument, and a zero wrench, when the law or the twist is not finite or the law negative
[[nodiscard]] Status penalty_wrench(std::span<const Contact> contacts, const PenaltyLaw& law, const Twist& twist,
                                    Wrench& out) noexcept;

/// Gradient of the wrench, for implicit integrators. Rows are force x, y, z, torque x, y, z. Columns are translation or
/// velocity x, y, z, then rotation or angular velocity x, y, z. `pose` is not symmetric unless the two bodies' normals
/// are opposite.
struct WrenchGradient {
  double pose[36] =
      {};  ///< by translation, then by rotation about `centre`; `centre` moves with the body. Map frame. [N/m, N, N m]
  double twist[36] = {};  ///< by linear, then angular velocity; symmetric, negative semidefinite. [N s/m, N s, N m s]
};

/// Gradient of `penalty_wrench` over the contacts that press. The set of contacts is treated as constant.
/// @param outward_normals  of the field at the contacts, in their order, from `outward_normal`. Empty: opposite to the
///                         shell's normals, which is right where two smooth surfaces touch and an estimate elsewhere.
///                         A zero vector, where the field has no slope, adds no stiffness
/// @return bad_argument also when the spans differ in length
[[nodiscard]] Status penalty_gradient(std::span<const Contact> contacts, std::span<const Vec3> outward_normals,
                                      const PenaltyLaw& law, const Twist& twist, WrenchGradient& out) noexcept;

/// Residuals of a reduction, for the sums of V n A and (P - centre) x V n A over contacts with V >= 0. Each is the
/// length of the difference between both sets' sums, divided by the sum of the lengths of the full set's terms. [-]
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

/// Replaces many contacts by few with the same force and torque about any point, as far as non-negative areas can.
/// Keeps the deepest contact, then repeatedly one that is deep and far from those kept. Each contact's area goes to the
/// nearest kept contact. Then least squares change the areas until the six sums agree. Eight contacts suffice in most
/// cases, three on a plane. The same contacts in the same order give the same answer.
/// @param all     contacts of a query
/// @param centre  reference point of the torque's residual. [m]
/// @param kept    room for the result, see Reduction::kept; positions, penetrations, normals, point and node are those
/// of `all`
[[nodiscard]] Status reduce_contacts(std::span<const Contact> all, Vec3 centre, std::span<Contact> kept,
                                     ReductionScratch& scratch, Reduction& result) noexcept;

/// How a body moves in a step, world.
struct StepMotion {
  double centre[3] = {};  ///< that it turns about, as its centre of mass. [m]
  Vec3 way;               ///< of `centre`, with what the forces of the step add. [m]
  Vec3 turn;              ///< rotation vector. [rad]
  Vec3 fall;              ///< the part of `way` that the forces of the step add. [m]
  float radius = 0;       ///< of its farthest point from `centre`; only where it turns. [m]
  bool yields = false;    ///< whether contacts can stop it
};

/// A body of a pair in a step: baked, or an analytic field.
struct StepBody {
  FieldRef field;  ///< its distances. A baked body without a voxelmap gives an empty VoxelmapView
  Pose pose;       ///< of the frame of `field` and `shell`, to world
  const PointshellView* shell = nullptr;  ///< its points; null: it has none, as analytic bodies
  const StepMotion* motion = nullptr;     ///< for contacts ahead; null: it stands still
};

/// What the contacts of a step are for.
enum class StepUse : std::uint8_t {
  /// A solver that keeps bodies apart: few places, each with its own depth and direction. They lie between the shell's
  /// points where both bodies have distances, so that they move continuously as a body rolls.
  constraints,
  /// The same, at points of the shell: those with many contacts that fit closely, as a nut on its bolt.
  samples,
  /// Springs with a force of stiffness * penetration * area: the areas keep force and torque of all points in contact.
  springs,
};

/// What a pair remembers from step to step. Contacts of the last step are preferred while they are nearly as good, and
/// a pair that rests is answered sooner. Use one for each pair, in one thread at a time, and drop it with the assets.
class StepMemory {
 public:
  StepMemory() noexcept;
  StepMemory(StepMemory&& other) noexcept;
  StepMemory& operator=(StepMemory&& other) noexcept;
  ~StepMemory();

  struct Content;                    ///< the library's own
  std::unique_ptr<Content> content;  ///< null before the first step
};

struct StepOptions {
  /// Surfaces up to this far apart are in contact, within a voxelmap's range. [Limits: value >= 0] [Units: m]
  float distance = 0;
  StepUse use = StepUse::constraints;
  StepMemory* memory = nullptr;  ///< of the pair; null: the contacts depend on the poses alone
};

struct StepContact {
  double position[3] = {};    ///< midway between the surfaces, world. [m]
  Vec3 normal;                ///< unit, from the second body into the first, world. [-]
  float penetration = 0;      ///< negative: the distance. [m]
  float area = 0;             ///< of the surface that it represents; 0: a place that is no point of a shell. [m^2]
  std::uint32_t feature = 0;  ///< the same number for the same contact from step to step
};

/// Working memory of one thread: grows with the shells.
class StepScratch {
 public:
  StepScratch() noexcept;
  StepScratch(StepScratch&& other) noexcept;
  StepScratch& operator=(StepScratch&& other) noexcept;
  ~StepScratch();

  struct Content;                    ///< the library's own
  std::unique_ptr<Content> content;  ///< null before its first use
};

/// The contacts of a pair for a step: chooses which body gives its points, finds those in contact, chooses few of them
/// and gives each its final place, direction and depth. It is all that an engine needs. runtime/bullet is made of the
/// same functions; runtime/mujoco and docs/examples/penalty.c call this one.
///
/// The body with the finer voxels gives its points; of two that are about as fine, the one with fewer points. Of shells
/// with thinned faces both bodies give theirs. Spheres, capsules and corners of boxes are also looked up in the
/// distances of the baked body.
///
/// With the bodies' motions it finds contacts ahead too: where a body that moves farther than a voxel in the step meets
/// the other one. Their penetration is minus the distance along the normal that closes until then. They need room for
/// more contacts than four. Without motions fast bodies may pass through each other between two steps.
/// @param contacts  room on entry, for one at least; four hold a body on a plane. On return those found, the best ones
///                  first: the deepest, then those that are deep and far from others
/// @return missing_part when neither body can give its points to the other; bad_pose, bad_argument, no_memory
[[nodiscard]] Status step_contacts(const StepBody& first, const StepBody& second, const StepOptions& options,
                                   StepScratch& scratch, std::span<StepContact>& contacts) noexcept;

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
  /// returned. Null: the caller's thread does all the work.
  void (*run)(void* context, std::uint32_t workers, Task task, void* batch) = nullptr;
  void* context = nullptr;
};

/// Starts a thread for each worker except the first, for each batch. For programs without a thread pool, and batches
/// that take milliseconds.
/// @param workers  0: as many as the machine has
[[nodiscard]] Executor thread_executor(std::uint32_t workers) noexcept;

/// Working memory of a batch: grows with the workers, and with their largest shells.
struct BatchScratch {
  std::vector<Scratch> workers;
};

/// Runs `traverse` for each pair, which first compares the shell's root sphere with the map's bounds (Sec. 3.2). The
/// answers equal those of single queries to the bit for any executor, except with budgets of time.
/// @return bad_argument when the spans differ in length or there is no worker; the status of each pair is in its answer
[[nodiscard]] Status traverse_batch(std::span<const PairQuery> queries, std::span<PairAnswer> answers,
                                    BatchScratch& scratch, const Executor& executor) noexcept;

}  // namespace vps
