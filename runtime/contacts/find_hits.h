// SPDX-License-Identifier: Zlib
/// @file The points of a pair in contact, before they become contacts. Internal. Paper: Algorithm 1 (Sec. 2.3).
#pragma once

#include "runtime/contacts/choose_four.h"

namespace vps::detail {

/// Rows that may be added to those of the hits.
inline constexpr std::uint32_t kExtraRows = 16;

/// The regular traverse without forces: a flat face touches with thousands of points, of which few become contacts. Of
/// a flat node that lies wholly in a contact where the field is linear, only the corners are hits:
/// docs/internals/bounds.md, "Flat nodes".
/// @param options  contact distance and cache; no budget, level, segments or facets
/// @param hits     in the field's frame; the features are the points' numbers. Rows of the scratch, kExtraRows more
/// @param most     upper bound of the true V of all points. [m]
Status find_hits(const PointshellView& shell, FieldRef field, const Pose& shell_to_field, const QueryOptions& options,
                 Scratch& scratch, ContactRows& hits, float& most) noexcept;
/// The same among a few points only; among all where the field takes no lists.
/// @param points  at most kLanePadding; their numbers rise
Status find_hits_of(std::span<const std::uint32_t> points, const PointshellView& shell, FieldRef field,
                    const Pose& shell_to_field, const QueryOptions& options, Scratch& scratch,
                    ContactRows& hits) noexcept;

/// A motion of the shell relative to the field: a place p moves by shift + turn x p. The field's frame.
struct RelativeMotion {
  Vec3 shift;               ///< [m]
  Vec3 turn;                ///< [rad]
  bool is_directed = true;  ///< false: as far as this, but in any direction
};
inline Vec3 way_at(const RelativeMotion& motion, Vec3 place) noexcept {
  return motion.shift + cross(motion.turn, place);
}

/// As `traverse`, without force and torque.
Status traverse_contacts(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                         const QueryOptions& options, Scratch& scratch, std::span<Contact> out,
                         QueryResult& result) noexcept;
/// The same, but a contact has V >= -(contact distance + way of its point): farther points do not come within the
/// contact distance in the motion. Over planes and large boxes only what the way loses in height counts
/// (docs/internals/bounds.md, "Heights over a plane or a box"). Of the cache only the region is used; no budget and no
/// level.
Status traverse_ahead(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                      const QueryOptions& options, const RelativeMotion& motion, Scratch& scratch,
                      std::span<Contact> out, QueryResult& result) noexcept;

}  // namespace vps::detail
