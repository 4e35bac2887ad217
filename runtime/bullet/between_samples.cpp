// SPDX-License-Identifier: Zlib
// Slides contacts to the place of deepest overlap, and keeps one of those that meet.
#include "runtime/bullet/between_samples.h"

#include <algorithm>
#include <vector>

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
  bool is_found = false;  // without a search
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
  Place place{contact, Slide::sloping};
  for (int i = 0; i < most && place.slide == Slide::sloping; ++i) {
    place.slide = slide_to_deepest(bodies, reach, place.at);
  }
  return place;
}

std::vector<Place>& places_of_this_thread() {
  thread_local std::vector<Place> places;
  return places;
}

// The contacts of one pair on their way to where the bodies overlap most.
class Slides {
 public:
  Slides(const Pair& pair, const FoundContacts& found, SlideMemory& memory, std::span<ManifoldContact> contacts)
      : found_(found),
        memory_(memory),
        contacts_(contacts),
        shell_(pair.shell.vps->distances()),
        places_(places_of_this_thread()) {
    const float other = pair.field.vps != nullptr ? pair.field.vps->voxelmap().voxel_size : 0;
    ring_ = std::max(kRing_vx * shell_.voxel_size, kRingOfOther_vx * other);
    const auto is_shallower = [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; };
    deepest_ =
        static_cast<std::size_t>(std::max_element(contacts.begin(), contacts.end(), is_shallower) - contacts.begin());
    places_.resize(contacts.size());
  }

  // Finds the places that are known without a search. @return whether these are all
  bool recall() {
    bool is_all = true;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      places_[i] = known(i);
      is_all = is_all && places_[i].is_found;
    }
    return is_all;
  }

  // Searches for the other places.
  // @param shell        distances of the shell's body, contacts' frame
  // @param other_body   function that returns the other body near a contact, a FieldAtPlaces
  template <class OtherBody>
  void search(const detail::PlacedField& shell, const OtherBody& other_body) {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      if (!places_[i].is_found) places_[i] = slide(i, {shell, other_body(contacts_[i]), shell_.voxel_size});
    }
  }

  // Moves the contacts that remain to the front. @return their number
  std::size_t keep() {
    places_[deepest_].is_kept = true;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      Place& place = places_[i];
      if (i == deepest_ || place.slide == Slide::sloping) continue;
      place.is_kept = std::none_of(places_.begin(), places_.end(),
                                   [&](const Place& k) { return k.is_kept && meet(place, k, ring_); });
    }
    std::size_t kept = 0;
    for (const Place& place : places_) {
      if (place.is_kept) contacts_[kept++] = place.at;
    }
    return kept;
  }

  [[nodiscard]] float ring() const { return ring_; }

 private:
  [[nodiscard]] int most(std::size_t i) const { return i == deepest_ ? kLongestWay : 1; }

  [[nodiscard]] Place known(std::size_t i) const {
    const ManifoldContact& contact = contacts_[i];
    if (found_.is_on_map(contact)) return {contact, Slide::stayed, true};
    if (found_.is_ahead(contact)) return {contact};
    // So far off the surface the fields are too coarse for a ring.
    if (contact.penetration < -shell_.voxel_size) return {contact, Slide::stayed, true};
    const auto before = std::find_if(memory_.slid.begin(), memory_.slid.end(), [&](const SlideMemory::Slid& one) {
      return one.feature == contact.feature && one.most == most(i);
    });
    if (before == memory_.slid.end()) return {contact};
    Place place{contact, before->slide, true};
    place.at.position = contact.position + before->shift;
    place.at.inward_normal = before->direction;
    place.at.penetration += before->gain;
    return place;
  }

  Place slide(std::size_t i, const detail::TouchingBodies& bodies) {
    const ManifoldContact& contact = contacts_[i];
    if (!found_.is_ahead(contact)) {
      const Place place = slide_far(bodies, {ring_, nullptr}, contact, most(i));
      constexpr std::size_t kMost = 256;
      if (memory_.slid.size() < kMost) {
        memory_.slid.push_back({contact.feature, most(i), place.slide, place.at.position - contact.position,
                                place.at.inward_normal, place.at.penetration - contact.penetration});
      }
      return place;
    }
    if (i != deepest_ && found_.turn > kRolls && is_steep(bodies, contact)) return {contact, Slide::sloping};
    // A contact ahead meets the plane of the place where it arrives.
    const HalfSpaceField plane{contact.inward_normal,
                               detail::dot(contact.inward_normal, contact.position) + contact.penetration};
    return slide_far(bodies, {kRing_vx * shell_.voxel_size, &plane}, contact, most(i));
  }

  const FoundContacts& found_;
  SlideMemory& memory_;
  const std::span<ManifoldContact> contacts_;
  const VoxelmapView& shell_;
  float ring_ = 0;
  std::size_t deepest_ = 0;
  std::vector<Place>& places_;  // of the thread: no allocation in a step
};

}  // namespace

std::size_t move_between_samples(const Pair& pair, const FoundContacts& found, PairMemory& memory,
                                 std::span<ManifoldContact> contacts) {
  const VoxelmapView& shell = pair.shell.vps->distances();
  if (contacts.empty() || shell.field == Field::none) return contacts.size();
  if (pair.field.vps != nullptr && pair.field.vps->voxelmap().field == Field::layers) return contacts.size();
  belong_to(memory.slides, pair, memory.triangles.mesh, kStill_vx * double{shell.voxel_size});
  Slides slides(pair, found, memory.slides, contacts);
  if (slides.recall()) return slides.keep();

  const Pose asset = to_pose(pair.shell.world, pair.shell.asset_frame());
  const detail::PlacedField distances(shell, relative_pose(asset, to_pose(found.frame, btTransform::getIdentity())));
  const auto search = [&](FieldRef field) {
    const detail::PlacedField placed(field, Pose());
    slides.search(distances, [&](const Contact&) -> const detail::PlacedField& { return placed; });
    return Status::ok;
  };
  if (pair.field.vps != nullptr) {
    (void)search(pair.field.vps->voxelmap());
  } else if (is_triangle_mesh(pair.field.shape->getShapeType())) {
    slides.search(distances,
                  [&](const Contact& contact) { return SheetField(found.triangles, contact, 2 * slides.ring()); });
  } else {
    const btVector3 from = pair.field.world.invXform(pair.shell.world.getOrigin());
    (void)on_partner(*pair.field.shape, from, memory.planes,
                     [&](const auto& field, const btTransform&) { return search(field); });
  }
  return slides.keep();
}

}  // namespace vps::bullet
