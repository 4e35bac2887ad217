// SPDX-License-Identifier: Zlib
// Takes the direction from the field, or from the shell where the field has an edge.
#include "runtime/bullet/refine_contacts.h"

#include <algorithm>
#include <array>
#include <type_traits>

#include "runtime/bullet/partners/corner_contacts.h"
#include "runtime/bullet/partners/partner_field.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {

using detail::operator+;
using detail::operator-;
using detail::operator*;

namespace {

constexpr float kSameNormal = 0.966F;  // 15 degrees

// Tolerance for faces of equal penetration: the spacing of the shell's points resolves no more. [m]
float alike_faces(const Pair& pair) {
  return static_cast<float>(voxel_size(pair) / 2);
}

std::array<HalfSpaceField, 6> faces_of(const BoxField& box) {
  const Vec3 half = box.half_extents;
  return {{{{1, 0, 0}, half.x},
           {{-1, 0, 0}, half.x},
           {{0, 1, 0}, half.y},
           {{0, -1, 0}, half.y},
           {{0, 0, 1}, half.z},
           {{0, 0, -1}, half.z}}};
}

// Whether a shell point lies near an edge of the field but is not about to touch. Its contact would stop a body that
// slides past.
bool grazes(const Contact& contact, Vec3 into_shell) {
  return contact.penetration < 0 && detail::dot(contact.inward_normal, into_shell) < kGrazing;
}

// Whether an edge of the field meets the shell at a contact. Then the normal of the shell's face gives the direction,
// not that of a face at the edge.
// @param v  function that returns V at a point
// @param h  distance of the samples from the contact. [m]
template <class V>
bool is_at_edge(const Contact& contact, Vec3 into_shell, float h, const V& v) {
  const Vec3 out = contact.inward_normal;
  const float agreement = detail::dot(out, into_shell);
  const Vec3 across = into_shell - agreement * out;
  const float size = detail::length(across);
  if (!(size > 0.05F)) return false;
  const Vec3 p = contact.position;
  const Vec3 step = (h / size) * across;
  return std::min(v(p + step), v(p - step)) - v(p) < -0.25F * h;
}

// Projects a contact's area along its direction.
void weigh(Contact& contact, Vec3 into_shell) {
  contact.area *= std::max(detail::dot(contact.inward_normal, into_shell), 0.0F);
}

// Finishes a contact with an analytic field. Its direction is already the field's.
// @return true for a grazing contact, which is to be removed
template <class Field>
bool settle(const Field& field, float beside, Vec3 into_shell, Contact& contact) {
  if (grazes(contact, into_shell)) return true;
  if (is_at_edge(contact, into_shell, beside, [&](Vec3 p) { return detail::value_at(field, p); })) {
    contact.inward_normal = into_shell;
  }
  weigh(contact, into_shell);
  return false;
}

// @return number of contacts left; they come first
template <class Field>
std::size_t refine_analytic(const Pair& pair, const Field& field, const ConvexPlanes& planes,
                            const FoundContacts& found, std::span<ManifoldContact> contacts) {
  const float alike = alike_faces(pair);
  [[maybe_unused]] const float margin = margin_of(pair);
  const auto is_none = [&](Contact& contact) {
    if (found.is_refined(contact)) return false;
    const Vec3 into_shell = contact.inward_normal;
    bool has_face = false;
    if constexpr (std::is_same_v<Field, BoxField>) {
      // The faces do not include the margin.
      contact.penetration -= margin;
      has_face = contact.penetration >= 0 && face_shell(faces_of(field), alike, contact);
      contact.penetration += margin;
    }
    if constexpr (std::is_same_v<Field, PolytopeField>) {
      contact.penetration = detail::value_at(field, contact.position);
      planes.finish(contact, alike);
      contact.penetration += margin;
      has_face = true;
    }
    if (!has_face) contact.inward_normal = detail::normal_at(field, contact.position);
    return settle(field, alike, into_shell, contact);
  };
  return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_none) - contacts.begin());
}

// The distance field of the shell's body.
struct ShellBody {
  const VoxelmapView& distances;
  detail::Transform to_asset;  // from the contacts' frame

  // Whether the body has an edge there. The shell's normal is then none of a face.
  [[nodiscard]] bool is_at_edge(const Contact& contact, Vec3 into_shell) const {
    if (distances.field == Field::none) return false;
    const auto v = [&](Vec3 p) { return vps::penetration(distances, to_asset.apply(p), {}); };
    return bullet::is_at_edge(contact, into_shell, distances.voxel_size, v);
  }
};

// Where edges of both bodies meet, the face of the map that is nearest to the inside of the shell's body. At a corner
// of a stacked box the shell's own normal would be 55 degrees off.
Vec3 face_beyond(const VoxelmapView& map, Vec3 at, Vec3 into_shell) {
  const Vec3 normal = outward_normal(map, at + 1.5F * map.voxel_size * into_shell);
  return detail::dot(normal, normal) > 0 ? normal : into_shell;
}

// The direction of a contact on a map. The map's normals are differences of rounded samples, and none is a face's at an
// edge: where both normals agree and at edges, that of the shell is better.
// @param contact  with the map's normal
Vec3 direction_on(const VoxelmapView& map, const ShellBody& shell, const Contact& contact, Vec3 into_shell) {
  if (detail::dot(contact.inward_normal, into_shell) > kSameNormal) return into_shell;
  const auto v = [&](Vec3 p) { return penetration(map, p, into_shell); };
  if (!is_at_edge(contact, into_shell, 0.5F * map.voxel_size, v)) return contact.inward_normal;
  return shell.is_at_edge(contact, into_shell) ? face_beyond(map, contact.position, into_shell) : into_shell;
}

// Finishes a contact with another shape's voxelmap.
// @param margin  thickness by the bodies' margins. [m]
// @param reach   largest distance of a contact off the surface. [m]
// @return true for a contact to be removed: it grazes, or is farther off than `reach`
bool settle_on_map(const VoxelmapView& map, const ShellBody& shell, float margin, float reach, Contact& contact) {
  const Vec3 into_shell = contact.inward_normal;
  const MapPlace place = place_in_map(map, contact.position);
  if (!(detail::dot(place.outward, place.outward) > 0)) return false;
  contact.inward_normal = place.outward;
  contact.penetration = place.penetration + margin;
  if (grazes(contact, into_shell) || contact.penetration < -reach) return true;
  if (!place.is_far) contact.inward_normal = direction_on(map, shell, contact, into_shell);
  weigh(contact, into_shell);
  return false;
}

}  // namespace

void finish_polytope(const Pair& pair, const ConvexPlanes& planes, const PolytopeField& field, float reach,
                     FoundContacts& found) {
  const float alike = alike_faces(pair);
  const auto is_none = [&](Contact& contact) {
    const Vec3 into_shell = contact.inward_normal;
    planes.finish(contact, alike);
    return !(contact.penetration >= -reach) || settle(field, alike, into_shell, contact);
  };
  const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), is_none);
  found.contacts = {found.contacts.begin(), last};
  found.refined = FoundContacts::Refined::all;
}

std::size_t refine(const Pair& pair, PairMemory& memory, const FoundContacts& found,
                   std::span<ManifoldContact> contacts) {
  if (found.refined == FoundContacts::Refined::all) return contacts.size();
  if (pair.field.vps == nullptr) {
    std::size_t left = contacts.size();
    (void)on_partner(*pair.field.shape, btVector3(0, 0, 0), memory.planes, [&](const auto& field, const btTransform&) {
      left = refine_analytic(pair, field, memory.planes, found, contacts);
      return Status::ok;
    });
    return left;
  }
  const VoxelmapView& map = pair.field.vps->voxelmap();
  const float margin = margin_of(pair);
  const ShellBody shell{pair.shell.vps->distances(), to_asset(pair, found.frame)};
  const auto is_none = [&](Contact& contact) {
    return !found.is_refined(contact) && settle_on_map(map, shell, margin, found.reach, contact);
  };
  return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_none) - contacts.begin());
}

}  // namespace vps::bullet
