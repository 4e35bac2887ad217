// SPDX-License-Identifier: Zlib
// Properties of a field besides its values, and the shell's place in the field. Paper: Sec. 2.3.
#include <algorithm>
#include <bit>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {

std::uint64_t field_id(std::span<const std::byte> analytic_field) noexcept {
  return hash_bytes(analytic_field);
}

std::uint64_t field_id(const VoxelmapView& map) noexcept {
  const std::uint64_t parts[2] = {reinterpret_cast<std::uintptr_t>(map.values),
                                  std::bit_cast<std::uint32_t>(map.scale)};
  return field_id(std::as_bytes(std::span(parts)));
}

float greatest_penetration(const VoxelmapView& map) noexcept {
  // The surface is never farther than the nearest face of the bounds.
  float most = std::numeric_limits<float>::max();
  for (int axis = 0; axis < 3; ++axis) {
    most = std::min(most, 0.5F * (map.bounds_max[axis] - map.bounds_min[axis]) + map.error);
  }
  return most;
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
      centre_of_mass(transform.apply({shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]})) {
  const auto unit = static_cast<float>(facts.frame.unit);
  descent.shell = &shell;
  descent.unit = unit;
  descent.radius_scale = shell.position_step / unit;
  descent.points = affine(kernel_pose, facts.frame, shell.position_origin, shell.position_step);
  descent.contact_distance = reach / unit;
  descent.rounding = rounding(shell, kernel_pose, facts.frame);
  descent.slack = facts.error / unit + descent.rounding;
  descent.queue = scratch.queue;
  descent.hits = scratch.hits;
  descent.penetrations = scratch.penetrations;
  descent.leaves = scratch.leaves;
  if (budget.limited() || options.level > 0) descent.bounds = scratch.bounds;
  descent.deepest = descent.rejected = kNothingTested;
}

std::uint32_t TraverseQuery::end_of_inner_nodes(std::uint32_t from, std::uint32_t to) const noexcept {
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  const std::uint32_t* const queue = descent.queue;
  return static_cast<std::uint32_t>(std::lower_bound(queue + from, queue + to, leaves) - queue);
}

}  // namespace vps::detail
