// SPDX-License-Identifier: Zlib
// Properties of a field besides its values, and the shell's place in the field. Paper: Sec. 2.3.
#include <algorithm>
#include <array>
#include <bit>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {

std::uint64_t field_id(const VoxelmapView& map) noexcept {
  const std::uint64_t parts[2] = {reinterpret_cast<std::uintptr_t>(map.values),
                                  std::bit_cast<std::uint32_t>(map.scale)};
  return hash_bytes(std::as_bytes(std::span(parts)));
}

std::uint64_t field_id(const PolytopeField& solid) noexcept {
  const std::array<std::uint64_t, 3> parts{reinterpret_cast<std::uintptr_t>(solid.planes.data()), solid.planes.size(),
                                           std::bit_cast<std::uint32_t>(solid.rounding)};
  return hash_bytes(std::as_bytes(std::span(parts)));
}

float greatest_penetration(const VoxelmapView& map) noexcept {
  // The surface is never farther than the nearest face of the bounds.
  float most = std::numeric_limits<float>::max();
  for (int axis = 0; axis < 3; ++axis) {
    most = std::min(most, 0.5F * (map.bounds_max[axis] - map.bounds_min[axis]) + map.error);
  }
  return most;
}

Descent descent_at(const PointshellView& shell, const Pose& pose, const Frame& frame, float reach,
                   float error) noexcept {
  Descent d;
  const auto unit = static_cast<float>(frame.unit);
  d.shell = &shell;
  d.unit = unit;
  d.radius_scale = shell.position_step / unit;
  d.points = affine(pose, frame, shell.position_origin, shell.position_step);
  d.contact_distance = reach / unit;
  d.rounding = rounding(shell, pose, frame);
  d.slack = error / unit + d.rounding;
  d.deepest = d.rejected = kNothingTested;
  return d;
}

TraverseQuery::TraverseQuery(const PointshellView& the_shell, const DescentField& the_field,
                             const FieldFacts& the_facts, const Pose& kernel_pose, const Pose& shell_to_field,
                             const QueryOptions& the_options, Scratch& scratch, std::span<Contact> contacts,
                             QueryResult& the_result) noexcept
    : shell(the_shell),
      field(the_field),
      facts(the_facts),
      pose(shell_to_field),
      transform(shell_to_field),
      has_facets(the_options.weight == Weight::per_patch && the_shell.facets > 0),
      options(the_options),
      reach(has_facets ? std::max(the_options.contact_distance, the_shell.feature_covering_radius)
                       : the_options.contact_distance),
      budget(the_options),
      out(contacts),
      result(the_result),
      centre_of_mass(transform.apply({shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]})),
      descent(descent_at(the_shell, kernel_pose, the_facts.frame, reach, the_facts.error)) {
  descent.queue = scratch.queue;
  descent.hits = scratch.hits;
  descent.penetrations = scratch.penetrations;
  descent.leaves = scratch.leaves;
  if (budget.limited() || options.level > 0) descent.bounds = scratch.bounds;
}

std::uint32_t TraverseQuery::end_of_inner_nodes(std::uint32_t from, std::uint32_t to) const noexcept {
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  const std::uint32_t* const queue = descent.queue;
  return static_cast<std::uint32_t>(std::lower_bound(queue + from, queue + to, leaves) - queue);
}

}  // namespace vps::detail
