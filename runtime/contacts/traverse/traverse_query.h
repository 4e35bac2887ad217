// SPDX-License-Identifier: Zlib
/// @file One traverse: its working state, and the parts that share it. Paper: Algorithm 1 (Sec. 2.3) and Sec. 2.4.
/// Internal.
///
/// Each part is a source of its own:
///   field_facts.cpp          properties of a field besides its values
///   take_hits.cpp            hits become contacts, force and torque: Eqs. (2) and (3)
///   descend_in_blocks.cpp    Algorithm 1, as far as the budget allows
///   represent.cpp            points that represent nodes: levels of detail, and parts that a budget left out
///   flat_nodes.cpp           nodes whose corners answer for all their points
///   remembered_points.cpp    the list of a ContactCache
///   segments.cpp             the segmented traverse of Sec. 2.4
/// traverse.cpp calls them.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "runtime/queries/budget.h"
#include "runtime/queries/descend.h"

namespace vps::detail {

/// Properties of a field that a traverse needs besides its values.
struct FieldFacts {
  explicit FieldFacts(FieldRef field) noexcept : values(field) {}

  FieldRef values;
  Frame frame;
  std::optional<SolidBelow> below;  ///< if there is one: the kernels see this, and only heights over it count
  std::uint64_t id = 0;             ///< differs between the fields that a cache may meet
  float error = 0;                  ///< [m]
  bool takes_lists = true;          ///< the kernels can test listed points without their numbers
  /// Let b be the bound of V that a sphere's test gives at the sphere's centre. If the sphere touches and b < `known`,
  /// V at the centre is at most b + `excess`. V is at most `most` anywhere. [m]
  float excess = 0;
  float known = std::numeric_limits<float>::max();
  float most = std::numeric_limits<float>::max();
  /// Where -certain < V < known_inside, V is within `error` of the true V; elsewhere within `far_error`. [m]
  float certain = std::numeric_limits<float>::max();
  float known_inside = std::numeric_limits<float>::max();
  float far_error = 0;

  /// Upper bound of the true V, less `error`, where a query gives V. [m]
  [[nodiscard]] float highest(float v) const noexcept {
    return v > -certain && v < known_inside ? v : std::min(v + far_error, std::max(v, most));
  }
};
/// Fields that differ have different ids: for what is remembered of a pair.
std::uint64_t field_id(const VoxelmapView& map) noexcept;
std::uint64_t field_id(const PolytopeField& solid) noexcept;
template <class Analytic>
std::uint64_t field_id(const Analytic& field) noexcept {
  return hash_bytes(std::as_bytes(std::span(&field, 1)));
}
/// How far inside a map a point can be at most. [m]
float greatest_penetration(const VoxelmapView& map) noexcept;

/// V before any point was tested.
inline constexpr float kNothingTested = std::numeric_limits<float>::lowest();

/// A descent without working memory.
/// @param pose   takes the shell to the field as the kernels see it
/// @param reach  largest distance of a hit off the field. [m]
/// @param error  of the field. [m]
Descent descent_at(const PointshellView& shell, const Pose& pose, const Frame& frame, float reach,
                   float error) noexcept;

/// What stands for the points of a flat node that lies in a contact where the field is linear: wholly, but for
/// segments.
enum class FlatNodesGive : std::uint8_t {
  corners,  ///< hits: for the choice of a manifold's contacts
  deepest,  ///< a hit, the deepest corner: for the segment that the node is in
  patches   ///< contacts of QueryOptions::flat_patches: for force and torque
};

/// The state of one traverse.
struct TraverseQuery {
  /// @param shell_to_field  takes the shell to the map frame, in which contacts are
  /// @param kernel_pose     takes the shell to the field as the kernels see it
  TraverseQuery(const PointshellView& the_shell, const DescentField& the_field, const FieldFacts& the_facts,
                const Pose& kernel_pose, const Pose& shell_to_field, const QueryOptions& the_options, Scratch& scratch,
                std::span<Contact> contacts, QueryResult& the_result) noexcept;

  [[nodiscard]] bool is_left_out(std::uint32_t point) const noexcept {
    return options.leaves_faces && is_on_face(shell, point);
  }
  /// Spheres and points tested so far.
  [[nodiscard]] std::uint64_t tests() const noexcept {
    return std::uint64_t{descent.nodes_tested} + descent.points_tested;
  }
  /// Where the leaves begin among entries [from, to) of the queue, which are in tree order.
  [[nodiscard]] std::uint32_t end_of_inner_nodes(std::uint32_t from, std::uint32_t to) const noexcept;

  const PointshellView& shell;
  const DescentField field;
  const FieldFacts& facts;
  const Pose& pose;
  const Transform transform;  ///< `pose` in float
  const bool has_facets;      ///< the shell has facets, and the sums use them
  const QueryOptions& options;
  const float reach;  ///< largest distance of a hit off the field: the contact distance, or what facets need. [m]
  const Budget budget;
  const std::span<Contact> out;
  QueryResult& result;
  const Vec3 centre_of_mass;  ///< map frame. [m]
  Descent descent;
  Contact* segment = nullptr;          ///< if not null, only the deepest contact is kept, and stored here
  float deepest_far = kNothingTested;  ///< max V by the far grid, of a shell beyond the band. In the field's unit
  FlatNodesGive flat_nodes_give = FlatNodesGive::corners;
  std::uint32_t waiting = 0;  ///< segments that are not begun, for which the budget must suffice
};

/// Kind of a descent's hits: points, or points that represent the nodes in `Descent::leaves`.
enum class HitsAre : std::uint8_t { points, nodes };
/// Adds the descent's hits to the result, and clears them. Points that represent nodes have the areas of
/// QueryOptions::node_areas; without these they are dropped.
void take_hits(TraverseQuery& query, HitsAre hits) noexcept;
/// The same for hits [first, last), which stay.
void take_hits(TraverseQuery& query, HitsAre hits, std::uint32_t first, std::uint32_t last) noexcept;
/// Writes a contact, or only counts it where the buffer is full.
inline void write_contact(TraverseQuery& query, const Contact& contact) noexcept {
  if (query.result.contacts < query.out.size()) query.out[query.result.contacts] = contact;
  ++query.result.contacts;
}

/// Writes a contact that is none of the descent's hits, and adds it to the sums.
void take_contact(TraverseQuery& query, const Contact& contact) noexcept;

/// Goes down from a node, which becomes entry `at` of the queue, to nodes from `last_node` on. With a budget it takes
/// the hits of each block; otherwise the caller takes them. Afterwards entries [begin, end) of the queue are left.
/// @return false when the budget ran out
bool descend_in_blocks(TraverseQuery& query, std::uint32_t node, std::uint32_t at, std::uint32_t last_node) noexcept;

/// Represents unvisited parts of the tree by their top nodes, entries [from, to) of the queue: adds the bounds of these
/// nodes and tests the points that represent them.
void represent(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept;
/// If no tested point touches, tests the points that represent expanded inner nodes, entries [from, to) of the queue.
/// They give a more accurate distance. Beyond the band these include the leaves', and the nearest leaf's points.
void sharpen_distance(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept;

/// Stops a descent at flat nodes, which `ask_flat_nodes` answers later. Not with a budget.
void stop_at_flat_nodes(TraverseQuery& query, Scratch& scratch, FlatNodesGive give) noexcept;
/// Takes the hits or contacts of flat nodes: as above, else the points below that are hits.
/// @param count  of the nodes in Descent::flats
void ask_flat_nodes(TraverseQuery& query, std::uint32_t count) noexcept;

/// The points below a node, in tree order.
inline IndexRange points_below(const PointshellView& shell, std::uint32_t node) noexcept {
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  std::uint32_t first = node;
  while (node < leaves) {
    first = children_of(shell, first).begin;
    node = children_of(shell, node).end - 1;
  }
  return {children_of(shell, first).begin, children_of(shell, node).end};
}

/// Finds all hits. @return how many expanded nodes lie at the front of the queue
std::uint32_t find_all_hits(TraverseQuery& query) noexcept;
/// The same, but tests only the points in the cache if these suffice. Otherwise traverses the tree and stores new
/// points.
std::uint32_t find_hits_with(ContactCache& cache, TraverseQuery& query) noexcept;

/// One contact for each cluster of QueryOptions::segment_level.
void traverse_segments(TraverseQuery& query) noexcept;

}  // namespace vps::detail
