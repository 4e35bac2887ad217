// SPDX-License-Identifier: Zlib
// Manifold reduction before addContactPoint, which costs about 30 ns a point and keeps four. Paper: Sec. 3.2.
#include "runtime/bullet/reduce_contacts.h"

#include "runtime/penetration.h"

namespace vps::bullet {
namespace {

using namespace detail;

Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// First place with the largest score.
template <class Score>
std::uint32_t best(std::span<const Contact> contacts, Score score, float& value) {
  std::uint32_t at = 0;
  value = -1;
  for (std::uint32_t i = 0; i < contacts.size(); ++i) {
    const float s = score(contacts[i]);
    if (s > value) {
      value = s;
      at = i;
    }
  }
  return at;
}

std::uint32_t deepest(std::span<const Contact> contacts) {
  std::uint32_t at = 0;
  for (std::uint32_t i = 1; i < contacts.size(); ++i) {
    if (contacts[i].penetration > contacts[at].penetration) at = i;
  }
  return at;
}

}  // namespace

std::size_t reduce_contacts(std::span<const Contact> contacts, std::array<std::uint32_t, 4>& chosen) {
  if (contacts.empty()) return 0;
  chosen[0] = deepest(contacts);
  const Vec3 a = contacts[chosen[0]].position;
  float value = 0;
  chosen[1] = best(contacts, [&](const Contact& c) { return dot(c.position - a, c.position - a); }, value);
  if (!(value > 0)) return 1;
  const Vec3 b = contacts[chosen[1]].position;
  // Squared twice the area of the triangle abc.
  const auto triangle = [&](const Contact& c) {
    const Vec3 normal = cross(b - a, c.position - a);
    return dot(normal, normal);
  };
  chosen[2] = best(contacts, triangle, value);
  if (!(value > 0)) return 2;
  const Vec3 c = contacts[chosen[2]].position;
  const Vec3 normal = cross(b - a, c - a);
  // What a fourth corner adds beyond one of the triangle's edges.
  const auto beyond = [&](const Contact& d) {
    const float ab = dot(cross(b - a, a - d.position), normal);
    const float bc = dot(cross(c - b, b - d.position), normal);
    const float ca = dot(cross(a - c, c - d.position), normal);
    return std::max({ab, bc, ca});
  };
  chosen[3] = best(contacts, beyond, value);
  return value > 0 ? 4 : 3;
}

}  // namespace vps::bullet
