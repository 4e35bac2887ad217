// SPDX-License-Identifier: Zlib
// Slides contacts to the place of deepest overlap, and keeps one of those that meet.
#include "runtime/bullet/between_samples.h"

#include <algorithm>

#include "runtime/bullet/partners/partner_field.h"
#include "runtime/contacts/slide_to_deepest.h"
#include "runtime/fields/penetration.h"

namespace vps::bullet {
namespace {

using detail::operator+;
using detail::operator-;
using detail::Slide;

// Smaller rings see the rounding of the fields, larger ones the edges of the bodies (docs/benchmarks/motion.md).
constexpr float kRing_vx = 4;
constexpr float kRingOfOther_vx = 1.5F;
constexpr float kOneNormal = 0.966F;  // 15 degrees
constexpr float kRolls = 0.05F;       // turn of a body that may be rolling. [rad]
constexpr double kStill_vx = 0.01;    // motion of a pair without a new search
constexpr int kLongestWay = 8;        // of the deepest contact. [rings]

// A contact after its slide.
struct Place {
  ManifoldContact at;
  Slide slide = Slide::stayed;
  bool is_kept = false;
};

// Forgets places from which the pair has moved.
void belong_to(SlideMemory& memory, const Pair& pair, std::uint64_t mesh, double far) {
  const Pose shell_pose = to_pose(pair.shell.world, pair.shell.asset_frame());
  const Pose pose = relative_pose(to_pose(pair.field.world, btTransform::getIdentity()), shell_pose);
  const btScalar shell_scale = pair.shell.shape->getLocalScaling().x();
  const btScalar field_scale = pair.field.shape->getLocalScaling().x();
  const bool is_same = memory.shell == pair.shell.shape && memory.field == pair.field.shape && memory.mesh == mesh &&
                       memory.shell_scale == shell_scale && memory.field_scale == field_scale &&
                       detail::largest_displacement(pair.shell.vps->pointshell(), memory.pose, pose) <= far;
  if (is_same) return;
  memory.slid.clear();
  memory.shell = pair.shell.shape;
  memory.field = pair.field.shape;
  memory.mesh = mesh;
  memory.shell_scale = shell_scale;
  memory.field_scale = field_scale;
  memory.pose = pose;
}

// Whether two contacts are one, as at least one of them has moved there.
bool meet(const Place& a, const Place& b, float ring) {
  if (a.slide == Slide::stayed && b.slide == Slide::stayed) return false;
  return detail::length(a.at.position - b.at.position) < ring &&
         detail::dot(a.at.inward_normal, b.at.inward_normal) > kOneNormal;
}

// @param most  [rings]
Place slide_far(const detail::TouchingBodies& bodies, const detail::Reach& reach, const ManifoldContact& contact,
                int most) {
  Place place{contact, Slide::sloping, false};
  for (int i = 0; i < most && place.slide == Slide::sloping; ++i) {
    place.slide = slide_to_deepest(bodies, reach, place.at);
  }
  return place;
}

// Slides a contact, or moves it as in a step before.
Place slide_remembered(SlideMemory& memory, const detail::TouchingBodies& bodies, float ring,
                       const ManifoldContact& contact, int most) {
  const auto known = std::find_if(memory.slid.begin(), memory.slid.end(), [&](const SlideMemory::Slid& one) {
    return one.feature == contact.feature && one.most == most;
  });
  if (known != memory.slid.end()) {
    Place place{contact, known->slide, false};
    place.at.position = contact.position + known->shift;
    place.at.inward_normal = known->direction;
    place.at.penetration += known->gain;
    return place;
  }
  const Place place = slide_far(bodies, {ring, nullptr}, contact, most);
  constexpr std::size_t kMost = 256;
  if (memory.slid.size() < kMost) {
    memory.slid.push_back({contact.feature, most, place.slide, place.at.position - contact.position,
                           place.at.inward_normal, place.at.penetration - contact.penetration});
  }
  return place;
}

}  // namespace

std::size_t move_between_samples(const Pair& pair, const FoundContacts& found, PairMemory& memory,
                                 std::span<ManifoldContact> contacts) {
  const VoxelmapView& shell = pair.shell.vps->distances();
  if (contacts.empty() || shell.field == Field::none) return contacts.size();
  if (pair.field.vps != nullptr && pair.field.vps->voxelmap().field == Field::layers) return contacts.size();
  const float other = pair.field.vps != nullptr ? pair.field.vps->voxelmap().voxel_size : 0;
  const float ring = std::max(kRing_vx * shell.voxel_size, kRingOfOther_vx * other);
  belong_to(memory.slides, pair, memory.triangles.mesh, kStill_vx * double{shell.voxel_size});

  const auto is_deeper = [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; };
  const auto deepest =
      static_cast<std::size_t>(std::max_element(contacts.begin(), contacts.end(), is_deeper) - contacts.begin());
  thread_local std::vector<Place> places;
  places.assign(contacts.size(), {});
  const Pose asset = to_pose(pair.shell.world, pair.shell.asset_frame());
  const detail::PlacedField distances(shell, relative_pose(asset, to_pose(found.frame, btTransform::getIdentity())));
  const auto slide = [&](std::size_t i, const detail::FieldAtPlaces& field) {
    const ManifoldContact& contact = contacts[i];
    const detail::TouchingBodies bodies{distances, field, shell.voxel_size};
    const int most = i == deepest ? kLongestWay : 1;
    if (!found.is_ahead(contact)) return slide_remembered(memory.slides, bodies, ring, contact, most);
    if (i != deepest && found.turn > kRolls && is_steep(bodies, contact)) return Place{contact, Slide::sloping, false};
    // A contact ahead meets the plane of the place where it arrives.
    const HalfSpaceField plane{contact.inward_normal,
                               detail::dot(contact.inward_normal, contact.position) + contact.penetration};
    return slide_far(bodies, {kRing_vx * shell.voxel_size, &plane}, contact, most);
  };
  const auto slide_all = [&](FieldRef field) {
    const detail::PlacedField placed(field, Pose());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      places[i].at = contacts[i];
      if (!found.is_on_map(contacts[i])) places[i] = slide(i, placed);
    }
    return Status::ok;
  };
  if (pair.field.vps != nullptr) {
    (void)slide_all(pair.field.vps->voxelmap());
  } else if (is_triangle_mesh(pair.field.shape->getShapeType())) {
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      places[i] = slide(i, SheetField(found.triangles, contacts[i], 2 * ring));
    }
  } else {
    const btVector3 from = pair.field.world.invXform(pair.shell.world.getOrigin());
    (void)on_partner(*pair.field.shape, from, memory.planes,
                     [&](const auto& field, const btTransform&) { return slide_all(field); });
  }

  places[deepest].is_kept = true;
  contacts[deepest] = places[deepest].at;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Place& place = places[i];
    const bool is_sloping = place.slide == Slide::sloping;
    if (i == deepest || is_sloping) continue;
    if (std::any_of(places.begin(), places.end(), [&](const Place& k) { return k.is_kept && meet(place, k, ring); }))
      continue;
    place.is_kept = true;
    contacts[i] = place.at;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (places[i].is_kept) contacts[kept++] = contacts[i];
  }
  return kept;
}

}  // namespace vps::bullet
