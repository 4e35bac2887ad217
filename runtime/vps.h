/* SPDX-License-Identifier: Zlib */
/// @file The runtime in C (C99): maps baked assets and answers contact queries. The C++ interface is vps_runtime.h.
///
///     VpsAsset* asset = NULL;
///     const VpsPointshell* shell = NULL;
///     VpsStatus status = vps_asset_open("bunny.vps.hdf", &asset);
///     if (status == vps_ok) status = vps_asset_pointshell(asset, &shell);
///     if (status != vps_ok) fprintf(stderr, "bunny.vps.hdf: %s\n", vps_status_text(status));
///
/// SI units. Frames: the asset frame is the mesh's own; a query runs in the asset frame of the body that plays the
/// voxelmap ("map frame"), or in the frame of a box, sphere or half space. Single precision, poses double. Sign:
/// penetration is positive inside, and 0 counts as contact.
/// Every function that can fail returns a status; none throws. NULL where a pointer is needed, numbers that are not
/// finite, coordinates and sizes beyond 1e15 m, and values outside their range are `vps_bad_argument`. On failure
/// handles become NULL and other outputs stay as they were. Closed handles are not detected. Any number of threads may
/// read an asset and its views; only one thread at a time may use a scratch or a batch. Link libvps.so
/// (`pkg-config --libs vps-shared`), or the static library with a C++ linker or the output of `pkg-config --libs vps`.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "vps_asset.h"

// NOLINTBEGIN(modernize-use-using): C.
#ifdef __cplusplus
extern "C" {
#endif

/// Rigid transform, body to world: p_world = rotation * p_body + translation.
typedef struct VpsPose {
  double rotation[9];     ///< row-major, orthonormal, determinant +1
  double translation[3];  ///< [m]
} VpsPose;
/// `vps_bad_pose` when not finite, translated by more than 1e12 m or farther than 1e-3 from orthonormal.
VpsStatus vps_check_pose(const VpsPose* pose);
/// first^-1 * second: takes second's body frame to first's. `out` may be one of them. Queries check the result.
VpsStatus vps_relative_pose(const VpsPose* first, const VpsPose* second, VpsPose* out);

// Analytic fields: each can replace a voxelmap and has its own frame. Their penetration is exact.
typedef struct VpsBox {
  float half_extents[3];  ///< centred on the origin. [Limits: value >= 0] [Units: m]
} VpsBox;
typedef struct VpsSphere {
  float radius;  ///< centred on the origin. [Limits: value >= 0] [Units: m]
} VpsSphere;
typedef struct VpsHalfSpace {
  float outward_normal[3];  ///< unit length to 1e-3. [-]
  float offset;             ///< the solid is outward_normal . p <= offset. [m]
} VpsHalfSpace;

/// Which kind of field a VpsFieldRef refers to.
typedef int32_t VpsFieldKind;
enum { vps_kind_map, vps_kind_box, vps_kind_sphere, vps_kind_half_space };
/// Refers to a field of any kind, for the queries below. It does not own the field, which must live until the query
/// returns. NULL, an unknown kind and a field with numbers outside their limits are `vps_bad_argument`.
typedef struct VpsFieldRef {
  VpsFieldKind kind;
  const void* field;  ///< VpsVoxelmap, VpsBox, VpsSphere or VpsHalfSpace, as `kind` says
} VpsFieldRef;
static inline VpsFieldRef vps_map_ref(const VpsVoxelmap* map) {
  const VpsFieldRef ref = {vps_kind_map, map};
  return ref;
}
static inline VpsFieldRef vps_box_ref(const VpsBox* box) {
  const VpsFieldRef ref = {vps_kind_box, box};
  return ref;
}
static inline VpsFieldRef vps_sphere_ref(const VpsSphere* sphere) {
  const VpsFieldRef ref = {vps_kind_sphere, sphere};
  return ref;
}
static inline VpsFieldRef vps_half_space_ref(const VpsHalfSpace* half_space) {
  const VpsFieldRef ref = {vps_kind_half_space, half_space};
  return ref;
}

/// Penetration of a point into a field. Beyond the narrow band of a voxelmap the sign is right. Up to `far_range` the
/// distance is that of the far grid, within `far_error`; beyond it, and without a far grid, it exceeds the true one by
/// no more than that. `vps_field_layers` may take a point of the band for one beyond it.
/// @param point          the field's frame. [m]
/// @param inward_normal  unit length, into the pointshell's body, the field's frame. Only `vps_field_layers` uses it;
///                       NULL is allowed for fields that are no voxelmap. [-]
VpsStatus vps_penetration(VpsFieldRef field, const float point[3], const float inward_normal[3], float* penetration);
/// Upper bound of the true penetration, also far outside the grid; FLT_MAX where there is none. [m]
VpsStatus vps_penetration_bound(const VpsVoxelmap* map, const float point[3], float* bound);
/// Direction out of the field, unit length; the zero vector only where a voxelmap has no slope.
VpsStatus vps_outward_normal(VpsFieldRef field, const float point[3], float normal[3]);

/// One point of the pointshell in contact, map frame.
typedef struct VpsContact {
  float position[3];       ///< of the shell's point. [m]
  float inward_normal[3];  ///< into the pointshell's body, unit length. [-]
  float penetration;       ///< [m]
  float area;              ///< [m^2]
  uint32_t point;          ///< index of the point: stable from step to step
  uint32_t node;           ///< segmented traverse: the segment's node. If the point represents a node: that node.
                           ///< Otherwise: the point's leaf
} VpsContact;

/// How the sums of force and torque weigh a point.
typedef int32_t VpsWeight;
enum {
  vps_per_area,   ///< force [m^3], torque [m^4]; times a foundation stiffness [N/m^3] they are N and N m
  vps_per_point,  ///< the paper's: force [m], torque [m^2]; they grow with the number of points
  vps_per_patch   ///< units of vps_per_area; folded patches (edges, corners) add integrals over their facets, which are
                  ///< contacts in place of their points. 4 to 10 times slower; errors: vps::Weight::per_patch
};

/// The points of a pair that can touch while the pair moves little. Queries of a resting body test only these points,
/// from the third one on. The contacts are the same as without a cache. Use one cache for each pair of a shell and a
/// field, in one thread at a time.
typedef struct VpsContactCache VpsContactCache;
VpsStatus vps_contact_cache_create(VpsContactCache** cache);
/// NULL is allowed.
VpsStatus vps_contact_cache_destroy(VpsContactCache* cache);

/// All zero is a good start.
typedef struct VpsQueryOptions {
  float contact_distance;  ///< points with penetration >= -contact_distance are contacts; beyond the distances that a
                           ///< voxelmap knows there are none. [Limits: value >= 0] [m]
  VpsWeight weight;
  uint32_t segment_level;  ///< 0: every contact. l >= 1: the deepest contact of each cluster of the tree's level l
  uint32_t level;          ///< 0: all points. l >= 1: those that represent the nodes of the tree's level l, with the
                           ///< areas below these nodes; not together with segment_level
  uint32_t max_tests;  ///< tests of spheres and points; 0: no limit. Points that represent unvisited nodes are contacts
  float max_microseconds;  ///< may be exceeded by a block of 128 tests or one wide node; 0: no limit.
                           ///< [Limits: value >= 0]
  VpsContactCache* cache;  ///< may be NULL; used only by regular queries of all points without a budget
} VpsQueryOptions;

typedef struct VpsQueryResult {
  double delta;        ///< largest penetration of the points tested; negative: minus the separation. When every sphere
                       ///< was rejected before a point was tested: an upper bound, "at least this far apart". [m]
  double delta_bound;  ///< upper bound of the penetration of all points of the shell. [m]
  double force[3];     ///< on the pointshell's body, map frame. Units: see VpsWeight
  double torque[3];    ///< about the pointshell's centre of mass, map frame
  uint32_t contacts;   ///< contacts found; more than were written when the status is `vps_output_full`
  uint32_t nodes_tested;
  uint32_t points_tested;
  uint32_t complete;  ///< 0: a budget ran out; delta_bound holds for unvisited points, too
} VpsQueryResult;

/// Working memory of one thread.
typedef struct VpsScratch VpsScratch;
VpsStatus vps_scratch_create(VpsScratch** scratch);
/// NULL is allowed.
VpsStatus vps_scratch_destroy(VpsScratch* scratch);
/// Makes room for queries of a shell with a buffer of `capacity` contacts, which then allocate nothing, and sums the
/// areas of the shell's nodes. Without this call queries grow the scratch when needed, and the first one with a level
/// or a budget sums the areas: some 60 us for 74,000 points, which are no part of its budget.
VpsStatus vps_scratch_reserve(VpsScratch* scratch, const VpsPointshell* shell, size_t capacity);

/// Points of a shell in contact with a field. Force and torque sum every point with penetration >= 0, for any size of
/// the buffer and any segmentation.
/// @param shell_to_field  takes the shell's asset frame to the field's: vps_relative_pose(field's body, shell's body)
/// @param options         NULL: all zero
/// @param contacts        written in tree order; NULL is allowed with capacity 0
/// @param capacity        contacts that the buffer can hold
/// @return `vps_ok`, or `vps_output_full`: `result` and the first `capacity` contacts are right then too.
VpsStatus vps_traverse(const VpsPointshell* shell, VpsFieldRef field, const VpsPose* shell_to_field,
                       const VpsQueryOptions* options, VpsScratch* scratch, VpsContact* contacts, size_t capacity,
                       VpsQueryResult* result);

// Functions of contacts. The C++ interface is vps_contacts.h.

/// Pressure on the shell's surface: stiffness * penetration - damping * (speed out of the field), never less than 0.
typedef struct VpsPenaltyLaw {
  double stiffness;  ///< of the foundation. [Limits: value >= 0] [N/m^3]
  double damping;    ///< [Limits: value >= 0] [N s/m^3]
} VpsPenaltyLaw;
/// Motion of the pointshell's body relative to the field's, map frame.
typedef struct VpsTwist {
  float centre[3];   ///< a point of the shell's body; torques are about it. [m]
  float linear[3];   ///< velocity of `centre`. [m/s]
  float angular[3];  ///< [rad/s]
} VpsTwist;
/// On the pointshell's body, map frame.
typedef struct VpsWrench {
  double force[3];   ///< [N]
  double torque[3];  ///< about VpsTwist::centre. [N m]
} VpsWrench;
/// Gradient of a wrench. Rows are force x, y, z, torque x, y, z. Columns are in the same order, see each field.
typedef struct VpsWrenchGradient {
  double pose[36];   ///< by translation, then by rotation about `centre`, which moves with the body. [N/m, N, N m]
  double twist[36];  ///< by linear, then by angular velocity. [N s/m, N s, N m s]
} VpsWrenchGradient;
/// Force and torque of contacts in newtons, independent of the number of points of the shell.
/// @param contacts  NULL is allowed with count 0, here and below
VpsStatus vps_penalty_wrench(const VpsContact* contacts, size_t count, const VpsPenaltyLaw* law, const VpsTwist* twist,
                             VpsWrench* wrench);
/// @param outward_normals  of the field at the contacts, 3 floats each; NULL: opposite to the shell's, an estimate
VpsStatus vps_penalty_gradient(const VpsContact* contacts, const float* outward_normals, size_t count,
                               const VpsPenaltyLaw* law, const VpsTwist* twist, VpsWrenchGradient* gradient);

/// Residuals of a reduction: the length of the difference of force or torque, divided by the sum of the lengths of its
/// terms.
typedef struct VpsReduction {
  uint32_t kept;
  double force_residual;   ///< [-]
  double torque_residual;  ///< about `centre`. [-]
} VpsReduction;
/// Replaces many contacts by few: the deepest and others far apart, with areas that keep force and torque.
/// @param centre    reference point of the torque's residual, map frame. [m]
/// @param kept      room for `capacity` contacts
/// @param capacity  how many to keep at most. [Limits: value >= 1]
VpsStatus vps_reduce_contacts(const VpsContact* contacts, size_t count, const float centre[3], VpsScratch* scratch,
                              VpsContact* kept, size_t capacity, VpsReduction* reduction);

/// How a body moves in a step, world.
typedef struct VpsStepMotion {
  double centre[3];  ///< that it turns about, as its centre of mass. [m]
  float way[3];      ///< of `centre`, with what the forces of the step add. [m]
  float turn[3];     ///< rotation vector. [rad]
  float fall[3];     ///< the part of `way` that the forces of the step add. [m]
  float radius;      ///< of its farthest point from `centre`; only where it turns. [m]
  int32_t yields;    ///< 1: contacts can stop it; 0: they cannot
} VpsStepMotion;

/// A body of a pair in a step: baked, or an analytic field.
typedef struct VpsStepBody {
  VpsFieldRef field;            ///< its distances; vps_map_ref(NULL) of a baked body without a voxelmap
  VpsPose pose;                 ///< of the frame of `field` and `shell`, to world
  const VpsPointshell* shell;   ///< its points; NULL: it has none, as analytic bodies
  const VpsStepMotion* motion;  ///< for contacts ahead; NULL: it stands still
} VpsStepBody;

/// What a pair remembers from step to step. Use one for each pair, in one thread at a time, and destroy it before the
/// assets are closed.
typedef struct VpsStepMemory VpsStepMemory;
VpsStatus vps_step_memory_create(VpsStepMemory** memory);
/// NULL is allowed.
VpsStatus vps_step_memory_destroy(VpsStepMemory* memory);

/// What the contacts of a step are for.
typedef int32_t VpsStepUse;
enum {
  vps_step_constraints,  ///< a solver that keeps bodies apart: few places, between the shell's points where both bodies
                         ///< have distances, so that they move continuously as a body rolls
  vps_step_samples,      ///< the same, at points of the shell: parts that fit closely and slide along each other
  vps_step_springs       ///< forces of stiffness * penetration * area: the areas keep force and torque of all points
};
/// All zero is a good start.
typedef struct VpsStepOptions {
  float distance;  ///< surfaces up to this far apart touch, within a voxelmap's range. [Limits: value >= 0] [m]
  VpsStepUse use;
  VpsStepMemory* memory;  ///< of the pair; NULL: the contacts depend on the poses alone
} VpsStepOptions;

typedef struct VpsStepContact {
  double position[3];  ///< midway between the surfaces, world. [m]
  float normal[3];     ///< unit, from the second body into the first, world
  float penetration;   ///< negative: the distance. [m]
  float area;          ///< of the surface that it represents; 0: a place that is no point of a shell. [m^2]
  uint32_t feature;    ///< the same number for the same contact from step to step
} VpsStepContact;

/// The contacts of a pair for a step: chooses which body gives its points, finds those in contact, chooses few of them
/// and gives each its final place, direction and depth. It is all that an engine needs: docs/examples/penalty.c.
/// With motions it finds contacts ahead too, where a body that moves farther than a voxel in the step meets the other
/// one: their penetration is minus the distance along the normal that closes until then. They need room for more than
/// four.
/// @param options   NULL: all zero
/// @param contacts  room for `capacity`, written with the best ones first: the deepest, then those that are deep and
///                  far from others
/// @param capacity  four hold a body on a plane. [Limits: value >= 1]
/// @param count     how many were written
/// @return `vps_missing_part` when neither body can give its points to the other
VpsStatus vps_step_contacts(const VpsStepBody* first, const VpsStepBody* second, const VpsStepOptions* options,
                            VpsScratch* scratch, VpsStepContact* contacts, size_t capacity, size_t* count);

/// All zero is a good start.
typedef struct VpsSeparationOptions {
  float tolerance;  ///< the search may miss a point that is deeper by at most this. [Limits: value >= 0] [m]
  uint32_t guess;   ///< point to start from, such as that of the last result. [Limits: value < points]
} VpsSeparationOptions;

typedef struct VpsSeparation {
  double delta;  ///< penetration of the shell's deepest point; negative: minus the distance. Beyond the map's band its
                 ///< size is the length of a walk from the point to the map's surface, if the walk arrives. [m]
  double delta_bound;  ///< upper bound of the penetration of all points of the shell. [m]
  double lower;        ///< lower bound of the largest penetration of the true surface, not of its samples. [m]
  double upper;        ///< upper bound of the same. [m]
  float position[3];   ///< of the deepest point, map frame. [m]
  float direction[3];  ///< out of the map there, unit length; zero where the field has none. [-]
  uint32_t point;      ///< index of the deepest point
  uint32_t nodes_tested;
  uint32_t points_tested;
} VpsSeparation;

/// Finds the deepest point of a shell, with bounds for the true surfaces. Beyond the band a voxelmap says little:
/// bodies that are apart are compared shell with shell, where the voxelmap's asset has points, and the deepest point is
/// found to a fiftieth of the distance. Without these it may be another one than the closest, as `upper` says. A
/// field's body that lies wholly inside the shell's counts as apart: no surface of the shell is inside it.
/// @param shell_to_field  as for vps_traverse
/// @param options         NULL: all zero
VpsStatus vps_separation(const VpsPointshell* shell, VpsFieldRef field, const VpsPose* shell_to_field,
                         const VpsSeparationOptions* options, VpsScratch* scratch, VpsSeparation* result);

/// Motion of a shell with constant velocities, in the field's frame: its centre of mass moves along a line, and the
/// body turns about it.
typedef struct VpsSweep {
  VpsPose start;               ///< shell_to_field at time 0
  double velocity[3];          ///< of the centre of mass. [m/s]
  double angular_velocity[3];  ///< [rad/s]
  double duration;             ///< [Limits: value >= 0] [s]
} VpsSweep;
/// shell_to_field at a time. [s]
VpsStatus vps_sweep_pose(const VpsPointshell* shell, const VpsSweep* sweep, double time, VpsPose* pose);

/// The part of the shell's body that does not reach the field before VpsImpactResult::time.
typedef int32_t VpsContactor;
enum {
  vps_contactor_surface,  ///< the body's true surface: impacts are reported up to a covering radius early
  vps_contactor_points    ///< the shell's points, the only ones that a traverse tests
};

typedef struct VpsImpactOptions {
  float distance;   ///< distance between the bodies that counts as an impact. [Limits: value >= 0] [m]
  float tolerance;  ///< an impact is reported when the gap to `distance` is at most this. [Limits: value > 0] [m]
  VpsContactor contactor;
  uint32_t max_iterations;  ///< steps of advancement; each is one separation query. [Limits: value >= 1]
} VpsImpactOptions;

typedef int32_t VpsImpact;
enum {
  vps_impact_none,       ///< none before the sweep's end
  vps_impact_hit,        ///< the bodies may be at VpsImpactOptions::distance
  vps_impact_unfinished  ///< max_iterations were not enough; there is no impact before `time`
};
typedef struct VpsImpactResult {
  VpsImpact impact;
  double time;               ///< there is no impact before it. [Limits: 0 <= value <= duration] [s]
  VpsSeparation separation;  ///< the last one computed; at `time` with vps_impact_hit
  uint32_t iterations;
} VpsImpactResult;

/// Finds when a moving shell first comes as near to a field as VpsImpactOptions::distance. The result is never later
/// than the true time.
/// @param options  NULL: distance 0, tolerance 1e-4 m, the surface, 256 iterations
VpsStatus vps_time_of_impact(const VpsPointshell* shell, VpsFieldRef field, const VpsSweep* sweep,
                             const VpsImpactOptions* options, VpsScratch* scratch, VpsImpactResult* result);

typedef struct VpsRay {
  float origin[3];     ///< map frame. [Limits: no coordinate beyond 1e6] [m]
  float direction[3];  ///< [Limits: unit length to 1e-3]
  float max_distance;  ///< along the ray; may be infinite. [Limits: value >= 0] [m]
} VpsRay;
typedef struct VpsRayHit {
  int32_t hit;              ///< 0: none
  float distance;           ///< from the ray's origin. [m]
  float position[3];        ///< map frame. [m]
  float outward_normal[3];  ///< there, unit length; zero where the field has none. [-]
  uint32_t steps;
} VpsRayHit;
/// Finds the first place along a ray where the penetration is >= 0. `vps_missing_part` with `vps_field_layers`.
/// @param tolerance_vx  accuracy of the place along the ray. [Limits: value > 0] [vx]
VpsStatus vps_cast_ray(const VpsVoxelmap* map, const VpsRay* ray, float tolerance_vx, VpsRayHit* result);

typedef struct VpsClosestPointOptions {
  float tolerance_vx;       ///< the walk ends where |penetration| is at most this. [Limits: value > 0] [vx]
  uint32_t max_iterations;  ///< steps of the walk. [Limits: value >= 1]
} VpsClosestPointOptions;
/// `inside`, `lower` and `upper` hold even if the walk did not converge; the other results do not.
typedef struct VpsClosestPoint {
  int32_t converged;
  int32_t inside;           ///< whether the query point is inside
  float position[3];        ///< on the surface, map frame. [m]
  float outward_normal[3];  ///< there, unit length; zero where the field has none. [-]
  float distance;           ///< from the point to `position`. [m]
  float residual;           ///< |penetration| at `position`. [m]
  float lower;              ///< lower bound of the true distance to the surface. [m]
  float upper;              ///< upper bound of the true distance to the surface. [m]
} VpsClosestPoint;
/// Finds a surface point by a walk from a point: a local minimum of the distance. `vps_missing_part` with
/// `vps_field_layers`.
/// @param options  NULL: 0.01 voxels, 256 steps
VpsStatus vps_closest_point(const VpsVoxelmap* map, const float point[3], const VpsClosestPointOptions* options,
                            VpsClosestPoint* result);

// Batches: many elements in one call, over threads. Each element gets the answer of the single call, bit for bit, for
// any number of threads.

/// The caller's array: element i starts i * stride bytes after `first`. Any stride is allowed, 0 and negative ones too.
/// Floats and structs need no alignment. Nothing is copied.
typedef struct VpsConstArray {
  const void* first;
  ptrdiff_t stride;  ///< [bytes]
} VpsConstArray;
/// The same, to be written: elements do not overlap, so |stride| is at least the element's size.
typedef struct VpsArray {
  void* first;
  ptrdiff_t stride;  ///< [bytes]
} VpsArray;

/// Threads of batches with their working memory. Threads start with each batch and end with it.
typedef struct VpsBatch VpsBatch;
/// @param threads  0: as many as the machine has; 1: the caller's alone. [Limits: value <= 1024]
VpsStatus vps_batch_create(uint32_t threads, VpsBatch** batch);
/// NULL is allowed.
VpsStatus vps_batch_destroy(VpsBatch* batch);

// Common to the batches below. An element that its single call refuses, such as a point that is not finite, keeps its
// former answer. All others are answered. The status is that of the first element refused.
/// Index of the first element that the last batch refused; its count when it refused none.
VpsStatus vps_batch_refused(const VpsBatch* batch, size_t* index);

/// vps_penetration of many points.
/// @param points          3 floats each. [m]
/// @param inward_normals  3 floats each; {NULL, 0} is allowed unless the field is `vps_field_layers`. [-]
/// @param penetrations    a float each. [m]
VpsStatus vps_penetration_batch(VpsBatch* batch, VpsFieldRef field, size_t count, VpsConstArray points,
                                VpsConstArray inward_normals, VpsArray penetrations);
/// vps_outward_normal of many points.
/// @param normals  3 floats each. [-]
VpsStatus vps_outward_normal_batch(VpsBatch* batch, VpsFieldRef field, size_t count, VpsConstArray points,
                                   VpsArray normals);
/// vps_closest_point of many points.
/// @param results  a VpsClosestPoint each
VpsStatus vps_closest_point_batch(VpsBatch* batch, const VpsVoxelmap* map, size_t count, VpsConstArray points,
                                  const VpsClosestPointOptions* options, VpsArray results);

/// Rays as arrays of their parts, see VpsRay.
typedef struct VpsRays {
  VpsConstArray origins;        ///< 3 floats each. [m]
  VpsConstArray directions;     ///< 3 floats each. [-]
  VpsConstArray max_distances;  ///< a float each; {NULL, 0}: no limit. [m]
} VpsRays;
/// vps_cast_ray of many rays.
/// @param hits  a VpsRayHit each
VpsStatus vps_cast_ray_batch(VpsBatch* batch, const VpsVoxelmap* map, size_t count, const VpsRays* rays,
                             float tolerance_vx, VpsArray hits);

/// vps_separation of many poses of a pair.
/// @param poses    a VpsPose each, shell_to_field
/// @param results  a VpsSeparation each
VpsStatus vps_separation_batch(VpsBatch* batch, const VpsPointshell* shell, VpsFieldRef field, size_t count,
                               VpsConstArray poses, const VpsSeparationOptions* options, VpsArray results);
/// vps_traverse of many poses of a pair.
/// @param options   its cache must be NULL
/// @param contacts  room for `capacity` VpsContact at each element, aligned to 4; {NULL, 0} with capacity 0
/// @param results   a VpsQueryResult each
/// @return `vps_output_full` when contacts of any pose did not fit and no pose was refused
VpsStatus vps_traverse_batch(VpsBatch* batch, const VpsPointshell* shell, VpsFieldRef field, size_t count,
                             VpsConstArray poses, const VpsQueryOptions* options, VpsArray contacts, size_t capacity,
                             VpsArray results);

/// vps_step_contacts of many poses of a pair.
/// @param first     its pose is not read
/// @param poses     a VpsPose each, of the first body
/// @param options   its memory must be NULL
/// @param contacts  room for `capacity` VpsStepContact at each element. [Limits: 1 <= capacity <= 1024]
/// @param counts    a uint32_t each: how many were written
VpsStatus vps_step_contacts_batch(VpsBatch* batch, const VpsStepBody* first, const VpsStepBody* second, size_t count,
                                  VpsConstArray poses, const VpsStepOptions* options, VpsArray contacts,
                                  size_t capacity, VpsArray counts);

#ifdef __cplusplus
}
#endif
// NOLINTEND(modernize-use-using)
