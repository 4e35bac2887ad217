// SPDX-License-Identifier: Zlib
// Gives contacts of Bullet's pairs to what slides them.
#include "runtime/bullet/between_samples.h"

#include <vector>

#include "runtime/bullet/partners/partner_field.h"
#include "runtime/contacts/between_samples.h"

namespace vps::bullet {
namespace {

using detail::SlidingContact;

constexpr float kRolls = 0.05F;  // turn of a body that may be rolling. [rad]

// Forgets places from which the pair has moved.
void belong_to(SlideMemory& memory, const Pair& pair, const Stand& now, std::uint64_t mesh) {
  if (memory.mesh == mesh && stands_still(pair, memory.stand, now)) return;
  memory.slid.clear();
  memory.stand = now;
  memory.mesh = mesh;
}

SlidingContact to_slide(const FoundContacts& found, ManifoldContact& contact) {
  SlidingContact out{&contact, contact.feature};
  if (found.is_on_map(contact) || found.is_met_alone(contact)) {
    out.kind = SlidingContact::Kind::fixed;
  } else if (found.is_ahead(contact)) {
    out.kind = SlidingContact::Kind::ahead;
  }
  return out;
}

// @return number of contacts left; they come first, in their order
std::size_t keep(detail::Slides& slides, std::span<const SlidingContact> sliding, std::span<ManifoldContact> contacts) {
  slides.keep();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (sliding[i].is_kept) contacts[kept++] = contacts[i];
  }
  return kept;
}

}  // namespace

std::size_t move_between_samples(const Pair& pair, const FoundContacts& found, PairMemory& memory,
                                 std::span<ManifoldContact> contacts) {
  const VoxelmapView& shell = pair.shell.vps->distances();
  if (contacts.empty() || shell.field == Field::none) return contacts.size();
  if (pair.field.vps != nullptr && pair.field.vps->voxelmap().field == Field::layers) return contacts.size();
  belong_to(memory.slides, pair, memory.now, memory.triangles.mesh);
  thread_local std::vector<SlidingContact> sliding;
  sliding.resize(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) sliding[i] = to_slide(found, contacts[i]);
  const float other = pair.field.vps != nullptr ? pair.field.vps->voxelmap().voxel_size : 0;
  detail::Slides slides({shell.voxel_size, other, !found.may_slide, found.turn > kRolls}, sliding, &memory.slides.slid);
  if (slides.recall()) return keep(slides, sliding, contacts);

  const Pose asset = to_pose(pair.shell.world, pair.shell.asset_frame());
  const detail::PlacedField distances(shell, relative_pose(asset, to_pose(found.frame, btTransform::getIdentity())));
  const auto search = [&](FieldRef field) {
    const detail::PlacedField placed(field, Pose());
    slides.search({distances, placed, shell.voxel_size});
    return Status::ok;
  };
  if (pair.field.vps != nullptr) {
    (void)search(pair.field.vps->voxelmap());
  } else if (is_triangle_mesh(pair.field.shape->getShapeType())) {
    slides.search_each(distances,
                       [&](const Contact& contact) { return SheetField(found.triangles, contact, 2 * slides.ring()); });
  } else {
    const btVector3 from = pair.field.world.invXform(pair.shell.world.getOrigin());
    (void)on_partner(*pair.field.shape, from, memory.planes,
                     [&](const auto& field, const btTransform&) { return search(field); });
  }
  return keep(slides, sliding, contacts);
}

}  // namespace vps::bullet
