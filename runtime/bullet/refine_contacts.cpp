// SPDX-License-Identifier: Zlib
// Refines the contacts of a pair with each kind of partner.
#include "runtime/bullet/refine_contacts.h"

#include <algorithm>
#include <type_traits>

#include "runtime/bullet/partners/partner_field.h"
#include "runtime/contacts/refine_contact.h"
#include "runtime/fields/analytic_fields.h"

namespace vps::bullet {

namespace {

// Tolerance for faces of equal penetration: the spacing of the shell's points resolves no more. [m]
float alike_faces(const Pair& pair) {
  return static_cast<float>(voxel_size(pair) / 2);
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
      has_face = contact.penetration >= 0 && detail::face_shell(detail::faces_of(field), alike, contact);
      contact.penetration += margin;
    }
    if constexpr (std::is_same_v<Field, PolytopeField>) {
      contact.penetration = detail::value_at(field, contact.position);
      planes.finish(contact, alike);
      contact.penetration += margin;
      has_face = true;
    }
    if (!has_face) contact.inward_normal = detail::normal_at(field, contact.position);
    return detail::settle(field, alike, into_shell, contact);
  };
  return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_none) - contacts.begin());
}

}  // namespace

void finish_polytope(const Pair& pair, const ConvexPlanes& planes, const PolytopeField& field, float reach,
                     FoundContacts& found) {
  const float alike = alike_faces(pair);
  const auto is_none = [&](Contact& contact) {
    const Vec3 into_shell = contact.inward_normal;
    planes.finish(contact, alike);
    return !(contact.penetration >= -reach) || detail::settle(field, alike, into_shell, contact);
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
  const detail::ShellBody shell{pair.shell.vps->distances(), to_asset(pair, found.frame)};
  const auto is_none = [&](Contact& contact) {
    return !found.is_refined(contact) && detail::settle_on_map(map, shell, margin, found.reach, contact);
  };
  return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_none) - contacts.begin());
}

}  // namespace vps::bullet
