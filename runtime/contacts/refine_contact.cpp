// SPDX-License-Identifier: Zlib
// Takes the direction from the field, or from the shell where the field has an edge.
#include "runtime/contacts/refine_contact.h"

#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"

namespace vps::detail {
namespace {

constexpr float kSameNormal = 0.966F;  // 15 degrees

// Whether the shell's body has an edge there. Its normal is then none of a face.
bool is_at_shells_edge(const ShellBody& shell, const Contact& contact, Vec3 into_shell) noexcept {
  if (shell.distances.field == Field::none) return false;
  const auto v = [&](Vec3 p) { return vps::penetration(shell.distances, shell.to_asset.apply(p), {}); };
  return is_at_edge(contact, into_shell, shell.distances.voxel_size, v);
}

// Where edges of both bodies meet, the face of the map that is nearest to the inside of the shell's body. At a corner
// of a stacked box the shell's own normal would be 55 degrees off.
Vec3 face_beyond(const VoxelmapView& map, Vec3 at, Vec3 into_shell) noexcept {
  const Vec3 normal = outward_normal(map, at + 1.5F * map.voxel_size * into_shell);
  return dot(normal, normal) > 0 ? normal : into_shell;
}

// The direction of a contact on a map. The map's normals are differences of rounded samples, and none is a face's at an
// edge: where both normals agree and at edges, that of the shell is better.
// @param contact  with the map's normal
// @param here     V at the contact. [m]
Vec3 direction_on(const VoxelmapView& map, const ShellBody& shell, const Contact& contact, float here,
                  Vec3 into_shell) noexcept {
  if (dot(contact.inward_normal, into_shell) > kSameNormal) return into_shell;
  const auto v = [&](Vec3 p) { return vps::penetration(map, p, into_shell); };
  // V of layers depends on the normal.
  const std::optional<float> known = map.field != Field::layers ? std::optional(here) : std::nullopt;
  if (!is_at_edge(contact, into_shell, 0.5F * map.voxel_size, v, known)) return contact.inward_normal;
  return is_at_shells_edge(shell, contact, into_shell) ? face_beyond(map, contact.position, into_shell) : into_shell;
}

}  // namespace

MapPlace place_in_map(const VoxelmapView& map, Vec3 point) noexcept {
  const auto [v, outward] = penetration_and_normal(map, point);
  ClosestPoint closest;
  // Near the end of the band and beyond, V and its gradient are rough.
  if (v < -0.75F * map.band_outer && closest_point(map, point, {}, closest) == Status::ok && closest.converged &&
      closest.distance > 0) {
    return {-closest.distance, (1 / closest.distance) * (point - closest.position), true};
  }
  return {v, outward, false};
}

std::array<HalfSpaceField, 6> faces_of(const BoxField& box) noexcept {
  const Vec3 half = box.half_extents;
  return {{{{1, 0, 0}, half.x},
           {{-1, 0, 0}, half.x},
           {{0, 1, 0}, half.y},
           {{0, -1, 0}, half.y},
           {{0, 0, 1}, half.z},
           {{0, 0, -1}, half.z}}};
}

bool face_shell(std::span<const HalfSpaceField> faces, float alike, Contact& contact) noexcept {
  const HalfSpaceField* best = nullptr;
  float best_agreement = 0;
  const float deepest = contact.penetration + alike;
  for (const HalfSpaceField& face : faces) {
    if (!(value_at(face, contact.position) <= deepest)) continue;
    const float agreement = dot(face.outward_normal, contact.inward_normal);
    if (best != nullptr && !(agreement > best_agreement)) continue;
    best = &face;
    best_agreement = agreement;
  }
  if (best == nullptr) return false;
  contact.penetration = value_at(*best, contact.position);
  contact.inward_normal = best->outward_normal;
  return true;
}

bool settle_on_map(const VoxelmapView& map, const ShellBody& shell, float margin, float reach,
                   Contact& contact) noexcept {
  const Vec3 into_shell = contact.inward_normal;
  const MapPlace place = place_in_map(map, contact.position);
  if (!(dot(place.outward, place.outward) > 0)) return false;
  contact.inward_normal = place.outward;
  contact.penetration = place.penetration + margin;
  if (grazes(contact, into_shell) || contact.penetration < -reach) return true;
  if (!place.is_far) contact.inward_normal = direction_on(map, shell, contact, place.penetration, into_shell);
  weigh(contact, into_shell);
  return false;
}

}  // namespace vps::detail
