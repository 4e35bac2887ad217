// SPDX-License-Identifier: Zlib
// Refines the contacts of a pair with each kind of partner.
#include "runtime/contacts/refine_contacts.h"

#include <algorithm>
#include <type_traits>

#include "runtime/contacts/refine_contact.h"
#include "runtime/fields/analytic_fields.h"

namespace vps::detail {
namespace {

// Finishes a contact with a body that is no voxelmap. @return whether it is none
template <class Field>
bool settle_on(const StepPair& pair, const Partner& partner, const Field& field, Contact& contact) {
  const float alike = pair.alike_faces();
  const Vec3 into_shell = contact.inward_normal;
  bool has_face = false;
  if constexpr (std::is_same_v<Field, BoxField>) {
    // The faces do not include the margin.
    contact.penetration -= pair.margin;
    has_face = contact.penetration >= 0 && face_shell(faces_of(field), alike, contact);
    contact.penetration += pair.margin;
  }
  if (partner.convex != nullptr) {
    contact.penetration = value_at(field, contact.position);
    partner.convex->finish(contact, alike);
    contact.penetration += pair.margin;
    has_face = true;
  }
  if (!has_face) contact.inward_normal = normal_at(field, contact.position);
  return settle(field, alike, into_shell, contact);
}

}  // namespace

void finish_convex(const StepPair& pair, const Partner& partner, float reach, FoundContacts& found) {
  const float alike = pair.alike_faces();
  const auto is_none = [&](Contact& contact) {
    const Vec3 into_shell = contact.inward_normal;
    partner.convex->finish(contact, alike);
    return !(contact.penetration >= -reach) || partner.field.visit([&](const auto& field) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, PolytopeField>) {
        return settle(field, alike, into_shell, contact);
      } else {
        return false;
      }
    });
  };
  const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), is_none);
  found.contacts = {found.contacts.begin(), last};
  found.refined = FoundContacts::Refined::all;
}

std::size_t refine(const StepPair& pair, const Partner& partner, const FoundContacts& found,
                   std::span<ManifoldContact> contacts) {
  if (found.refined == FoundContacts::Refined::all) return contacts.size();
  const auto left = [&](const auto& is_none) {
    const auto is_removed = [&](Contact& contact) { return !found.is_refined(contact) && is_none(contact); };
    return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_removed) - contacts.begin());
  };
  return partner.field.visit([&](const auto& field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, VoxelmapView>) {
      const ShellBody shell{pair.distances, pair.to_shell()};
      return left([&](Contact& contact) { return settle_on_map(field, shell, pair.margin, found.reach, contact); });
    } else {
      return left([&](Contact& contact) { return settle_on(pair, partner, field, contact); });
    }
  });
}

}  // namespace vps::detail
