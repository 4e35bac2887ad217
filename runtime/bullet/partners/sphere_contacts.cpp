// SPDX-License-Identifier: Zlib
// Finds the places where a sphere touches a distance field. Paper: Sec. 2.2, with the field asked at one point.
#include "runtime/bullet/partners/sphere_contacts.h"

#include <algorithm>
#include <cmath>

#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {
namespace {

using detail::operator+;
using detail::operator-;
using detail::operator*;

constexpr std::size_t kMostContacts = 32;
constexpr float kSameFace = 0.985F;  // cosine of 10 degrees

// @param out  from the map to the sphere, unit
Contact contact_at(Vec3 position, Vec3 out, float penetration, const Contact& seed) {
  Contact contact = seed;
  contact.position = position;
  contact.inward_normal = -1.0F * out;
  contact.penetration = penetration;
  return contact;
}

// The contact on the plane of a seed, if that plane is the map's surface below the centre.
bool touches_face(const VoxelmapView& map, const SphereInMap& sphere, const Contact& seed, Contact& contact) {
  const Vec3 out = -1.0F * seed.inward_normal;
  const float distance = detail::dot(out, sphere.centre - seed.position);
  if (!(distance > 0)) return false;
  const Vec3 foot = sphere.centre - distance * out;
  if (!(std::abs(penetration(map, foot, {})) < 0.25F * map.voxel_size)) return false;
  if (!(detail::dot(outward_normal(map, foot), out) > kSameFace)) return false;
  contact = contact_at(foot, out, sphere.radius - distance, seed);
  return true;
}

}  // namespace

bool takes_sphere(const Shape& shape, float radius) {
  const VoxelmapView& map = shape.distances();
  if (map.field == Field::none) return false;
  float longest = 0;
  for (int axis = 0; axis < 3; ++axis) longest = std::max(longest, map.bounds_max[axis] - map.bounds_min[axis]);
  return radius <= longest;
}

bool find_sphere_contacts(const VoxelmapView& map, const SphereInMap& sphere, std::span<Contact> seeds, float reach,
                          std::uint32_t shell_points, std::vector<Contact>& found) {
  ClosestPoint nearest;
  if (closest_point(map, sphere.centre, {}, nearest) != Status::ok || !nearest.converged) return false;
  const float distance = nearest.inside ? -nearest.distance : nearest.distance;
  Vec3 out = nearest.outward_normal;
  // The field's slope is rough; the way to a place far off is not.
  if (distance > map.voxel_size) out = (1 / distance) * (sphere.centre - nearest.position);
  if (!(detail::dot(out, out) > 0)) return false;
  found.clear();
  if (!(sphere.radius - distance >= -reach)) return true;
  const auto is_deeper = [](const Contact& a, const Contact& b) { return a.penetration > b.penetration; };
  std::stable_sort(seeds.begin(), seeds.end(), is_deeper);
  Contact first = contact_at(nearest.position, out, sphere.radius - distance, seeds.empty() ? Contact() : seeds[0]);
  first.point = shell_points;
  found.push_back(first);
  for (const Contact& seed : seeds) {
    const auto is_same = [&](const Contact& other) {
      return detail::dot(other.inward_normal, seed.inward_normal) > kSameFace;
    };
    Contact contact;
    if (std::any_of(found.begin(), found.end(), is_same) || !touches_face(map, sphere, seed, contact)) continue;
    if (!(contact.penetration >= -reach)) continue;
    contact.point = shell_points + 1 + seed.point;
    found.push_back(contact);
    if (found.size() == kMostContacts) break;
  }
  return true;
}

}  // namespace vps::bullet
