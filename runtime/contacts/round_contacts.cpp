// SPDX-License-Identifier: Zlib
// Finds the places where a sphere or capsule touches a distance field. Paper: Sec. 2.2, with the field looked up at the
// body's centre or on its axis.
#include "runtime/contacts/round_contacts.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "runtime/contacts/wide_face.h"
#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"

namespace vps::detail {
namespace {

constexpr std::size_t kMostContacts = 32;
constexpr float kSameFace = 0.985F;  // cosine of 10 degrees
constexpr float kSamePlace_vx = 2;

// @param out  from the map to the sphere, unit
Contact contact_at(Vec3 position, Vec3 out, float penetration, const Contact& seed) {
  Contact contact = seed;
  contact.position = position;
  contact.inward_normal = -1.0F * out;
  contact.penetration = penetration;
  return contact;
}

// The place of the axis that is nearest to a point.
Vec3 on_axis(const RoundInMap& body, Vec3 point) {
  const float squared = dot(body.half_axis, body.half_axis);
  if (!(squared > 0)) return body.centre;
  const float along = std::clamp(dot(point - body.centre, body.half_axis) / squared, -1.0F, 1.0F);
  return body.centre + along * body.half_axis;
}

// The contact on the plane of a seed, if that plane is the map's surface below the body.
bool touches_face(const VoxelmapView& map, const RoundInMap& body, const Contact& seed, Contact& contact) {
  const Vec3 out = -1.0F * seed.inward_normal;
  const Vec3 centre = on_axis(body, seed.position);
  const float distance = dot(out, centre - seed.position);
  if (!(distance > 0)) return false;
  const Vec3 foot = centre - distance * out;
  if (!(std::abs(vps::penetration(map, foot, {})) < 0.25F * map.voxel_size)) return false;
  if (!(dot(outward_normal(map, foot), out) > kSameFace)) return false;
  contact = contact_at(foot, out, body.radius - distance, seed);
  return true;
}

// The contact of a sphere at its nearest surface point. @return false where that is not found
bool touch(const VoxelmapView& map, Vec3 centre, float radius, Contact& contact) {
  ClosestPoint nearest;
  if (closest_point(map, centre, {}, nearest) != Status::ok || !nearest.converged) return false;
  const float distance = nearest.inside ? -nearest.distance : nearest.distance;
  Vec3 out = nearest.outward_normal;
  // The field's slope is rough; the way to a place far off is not.
  if (distance > map.voxel_size) out = (1 / distance) * (centre - nearest.position);
  if (!(dot(out, out) > 0)) return false;
  contact = contact_at(nearest.position, out, radius - distance, contact);
  return true;
}

// The contact of the axis near a place of the surface: the nearest places of axis and surface are found in turn.
bool touch_between_ends(const VoxelmapView& map, const RoundInMap& body, Vec3 place, Contact& contact) {
  constexpr int kTurns = 3;
  contact.position = place;
  for (int i = 0; i < kTurns; ++i) {
    if (!touch(map, on_axis(body, contact.position), body.radius, contact)) return false;
  }
  return true;
}

}  // namespace

std::optional<Round> round_of(FieldRef field) noexcept {
  return field.visit([](const auto& body) -> std::optional<Round> {
    using Kind = std::remove_cvref_t<decltype(body)>;
    if constexpr (std::is_same_v<Kind, SphereField>) return Round{{}, body.radius};
    if constexpr (std::is_same_v<Kind, RevolvedField>) {
      if (body.profile == RevolvedField::Profile::capsule && body.rounding == 0) {
        return Round{{0, 0, body.half_height}, body.radius};
      }
    }
    return std::nullopt;
  });
}

bool takes_round(const VoxelmapView& map, float radius) noexcept {
  return map.field != Field::none && radius <= longest_side(map);
}

bool find_round_contacts(const VoxelmapView& map, const RoundInMap& body, std::span<Contact> seeds, float reach,
                         std::uint32_t shell_points, std::vector<Contact>& found) {
  const auto is_deeper = [](const Contact& a, const Contact& b) { return a.penetration > b.penetration; };
  std::stable_sort(seeds.begin(), seeds.end(), is_deeper);
  const bool is_sphere = !(dot(body.half_axis, body.half_axis) > 0);
  found.clear();
  // Each half of a capsule: its end and, if the body is deeper there, a place between the ends.
  for (const float half : {-1.0F, 1.0F}) {
    if (is_sphere && half > 0) break;
    Contact contact = seeds.empty() ? Contact() : seeds[0];
    contact.point = shell_points + (half > 0 ? 1U : 0U);
    const bool has_end = touch(map, body.centre + half * body.half_axis, body.radius, contact);
    if (has_end) found.push_back(contact);
    if (is_sphere) break;
    const auto seed = std::find_if(seeds.begin(), seeds.end(), [&](const Contact& one) {
      return half * dot(one.position - body.centre, body.half_axis) >= 0;
    });
    const float least = (has_end ? contact.penetration : -reach) + 0.02F * map.voxel_size;
    if (seed == seeds.end() || !touch_between_ends(map, body, seed->position, contact)) continue;
    contact.point += 2;
    if (!(contact.penetration > least)) continue;
    // At an edge that the capsule lies across, its ends find the same place, but are not as deep.
    const auto is_there = [&](const Contact& other) {
      return length(other.position - contact.position) < kSamePlace_vx * map.voxel_size;
    };
    std::erase_if(found,
                  [&](const Contact& other) { return is_there(other) && other.penetration < contact.penetration; });
    if (std::none_of(found.begin(), found.end(), is_there)) found.push_back(contact);
  }
  if (found.empty()) return false;
  std::erase_if(found, [&](const Contact& contact) { return !(contact.penetration >= -reach); });
  if (found.empty()) return true;
  for (const Contact& seed : seeds) {
    const auto is_same = [&](const Contact& other) { return dot(other.inward_normal, seed.inward_normal) > kSameFace; };
    Contact contact;
    if (std::any_of(found.begin(), found.end(), is_same) || !touches_face(map, body, seed, contact)) continue;
    if (!(contact.penetration >= -reach)) continue;
    constexpr std::uint32_t kNearest = 4;
    contact.point = shell_points + kNearest + seed.point;
    found.push_back(contact);
    if (found.size() == kMostContacts) break;
  }
  return true;
}

}  // namespace vps::detail
