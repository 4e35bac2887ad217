// SPDX-License-Identifier: Zlib
/// @file One traverse: its working state, and the parts that share it. Paper: Algorithm 1 (Sec. 2.3) and Sec. 2.4.
/// Internal.
///
/// Each part is a source of its own:
///   field_facts.cpp          what a traverse knows of a field besides its values
///   take_hits.cpp            hits become contacts, force and torque: Eqs. (2) and (3)
///   descend_in_blocks.cpp    Algorithm 1, as far as the budget allows
///   represent.cpp            nodes stand for what is below them: levels of detail, and what a budget left out
///   remembered_points.cpp    the list of a ContactCache
///   segments.cpp             the segmented traverse of Sec. 2.4
/// traverse.cpp puts them together.
#pragma once

#include <limits>
#include <span>

#include "runtime/queries/budget.h"
#include "runtime/queries/descend.h"

namespace vps::detail {

/// What a traverse knows of a field besides its values.
struct FieldFacts {
  Frame frame;
  std::uint64_t id = 0;     ///< differs between the fields that a cache may meet
  float error = 0;          ///< [m]
  bool takes_lists = true;  ///< the kernels can test listed points without their numbers
  /// V at a sphere's centre, where the sphere touches, is at most `excess` above the bound that the sphere's test gave,
  /// as long as that sum is less than `known`. V is at most `most` anywhere. [m]
  float excess = 0;
  float known = std::numeric_limits<float>::max();
  float most = std::numeric_limits<float>::max();
};
/// Fields that differ have different ids: for a ContactCache.
std::uint64_t field_id(const VoxelmapView& map) noexcept;
std::uint64_t field_id(std::span<const std::byte> analytic_field) noexcept;
/// How far inside a map a point can be at most. [m]
float greatest_penetration(const VoxelmapView& map) noexcept;

/// V before any point was tested.
inline constexpr float kNothingTested = std::numeric_limits<float>::lowest();

/// The state of one traverse.
struct TraverseQuery {
  /// @param shell_to_field  takes the shell to the map frame, in which contacts are
  /// @param kernel_pose     takes the shell to the field as the kernels see it
  TraverseQuery(const PointshellView& the_shell, const DescentField& the_field, const FieldFacts& the_facts,
                const Pose& kernel_pose, const Pose& shell_to_field, const QueryOptions& the_options, Scratch& scratch,
                std::span<Contact> contacts, QueryResult& the_result) noexcept;

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
  const QueryOptions& options;
  const Budget budget;
  const std::span<Contact> out;
  QueryResult& result;
  const Vec3 centre_of_mass;  ///< map frame. [m]
  Descent descent;
  Contact* segment = nullptr;  ///< null, or: only the deepest contact is kept, here
  std::uint32_t waiting = 0;   ///< segments to come, which the budget must reach
};

/// What the hits of a descent are: points, or points that stand for the nodes in `Descent::leaves`.
enum class HitsAre : std::uint8_t { points, nodes };
/// Takes the hits of the descent into the answer, and forgets them. Points that stand for nodes have the areas of
/// QueryOptions::node_areas; without these they are dropped.
void take_hits(TraverseQuery& query, HitsAre hits) noexcept;
/// Writes a contact, or only counts it where the buffer is full.
inline void write_contact(TraverseQuery& query, const Contact& contact) noexcept {
  if (query.result.contacts < query.out.size()) query.out[query.result.contacts] = contact;
  ++query.result.contacts;
}

/// Goes down from a node, which is entry `at` of the queue, to nodes from `last_node` on, and takes the hits.
/// Afterwards entries [begin, end) of the queue are left.
/// @return false when the budget ran out
bool descend_in_blocks(TraverseQuery& query, std::uint32_t node, std::uint32_t at, std::uint32_t last_node) noexcept;

/// Lets nodes, entries [from, to) of the queue, stand for what is below them: by their bounds and by their own points.
void represent(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept;
/// Where no tested point touches, tests the own points of nodes that were gone into, entries [from, to) of the queue:
/// they give a closer distance.
void sharpen_distance(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept;

/// Finds all hits, from the points that the cache remembers where these suffice. Else it remembers new ones.
/// @return how many inner nodes lie at the front of the queue
std::uint32_t find_hits_with(ContactCache& cache, TraverseQuery& query) noexcept;

/// One contact for each cluster of QueryOptions::segment_level.
void traverse_segments(TraverseQuery& query) noexcept;

}  // namespace vps::detail
