// SPDX-License-Identifier: Zlib
/// @file Gives a contact of one of the shell's points its final direction, penetration and area. Internal.
/// Paper: Sec. 2.3.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// A contact off the surface is none if its direction and the shell's inward normal have a smaller cosine: the surfaces
/// do not face each other there.
inline constexpr float kGrazing = 0.3F;

/// Penetration of a point into a map and the direction out of it, also far outside the band of its samples.
struct MapPlace {
  float penetration = 0;  ///< [m]
  Vec3 outward;           ///< unit; zero where the map has no slope
  bool is_far = false;    ///< beyond the band: by a walk to the surface
};
MapPlace place_in_map(const VoxelmapView& map, Vec3 point) noexcept;

std::array<HalfSpaceField, 6> faces_of(const BoxField& box) noexcept;

/// Sets penetration and direction of a contact from a face: of those equally deep, the one whose normal agrees most
/// with the shell's inward normal. At an edge, the nearest face may be one that the shell hardly touches.
/// @param contact  its inward_normal is the shell's on entry, and the direction on return
/// @param alike    penetrations that differ by no more than this count as the same. [m]
/// @return false, and no change, when there are no faces
bool face_shell(std::span<const HalfSpaceField> faces, float alike, Contact& contact) noexcept;

/// Whether a shell point lies near an edge of the field but is not about to touch. Its contact would stop a body that
/// slides past.
inline bool grazes(const Contact& contact, Vec3 into_shell) noexcept {
  return contact.penetration < 0 && dot(contact.inward_normal, into_shell) < kGrazing;
}

/// Whether an edge of the field meets the shell at a contact. Then the normal of the shell's face gives the direction,
/// not that of a face at the edge.
/// @param v     function that returns V at a point
/// @param h     distance of the samples from the contact. [m]
/// @param here  V at the contact; unset: not known. [m]
template <class V>
bool is_at_edge(const Contact& contact, Vec3 into_shell, float h, const V& v, std::optional<float> here = {}) noexcept {
  const Vec3 out = contact.inward_normal;
  const float agreement = dot(out, into_shell);
  const Vec3 across = into_shell - agreement * out;
  const float size = length(across);
  if (!(size > 0.05F)) return false;
  const Vec3 p = contact.position;
  const Vec3 step = (h / size) * across;
  return std::min(v(p + step), v(p - step)) - (here ? *here : v(p)) < -0.25F * h;
}

/// Projects a contact's area along its direction.
inline void weigh(Contact& contact, Vec3 into_shell) noexcept {
  contact.area *= std::max(dot(contact.inward_normal, into_shell), 0.0F);
}

/// Finishes a contact with an analytic field. Its direction is already the field's.
/// @param beside  distance at which an edge is looked for. [m]
/// @return true for a grazing contact, which is to be removed
template <class Field>
bool settle(const Field& field, float beside, Vec3 into_shell, Contact& contact) noexcept {
  if (grazes(contact, into_shell)) return true;
  if (is_at_edge(contact, into_shell, beside, [&](Vec3 p) { return value_at(field, p); })) {
    contact.inward_normal = into_shell;
  }
  weigh(contact, into_shell);
  return false;
}

/// The distance field of the shell's body.
struct ShellBody {
  const VoxelmapView& distances;  ///< Field::none: it has none
  Transform to_asset;             ///< from the contacts' frame
};

/// Finishes a contact with another body's voxelmap.
/// @param contact  map's frame; its inward_normal is the shell's on entry
/// @param margin   thickness by the bodies' margins. [m]
/// @param reach    largest distance of a contact off the surface. [m]
/// @return true for a contact to be removed: it grazes, or is farther off than `reach`
bool settle_on_map(const VoxelmapView& map, const ShellBody& shell, float margin, float reach,
                   Contact& contact) noexcept;

}  // namespace vps::detail
