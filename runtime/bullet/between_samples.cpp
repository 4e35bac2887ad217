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
constexpr int kLongestWay = 8;        // of the deepest contact. [rings]
constexpr float kInto_vx = 0.5F;      // a contact ahead slides no deeper into the plane where it arrives

// A contact after its slide.
struct Place {
  ManifoldContact at;
  Slide slide = Slide::stayed;
  bool is_found = false;  // without a search
  bool is_kept = false;
  HalfSpaceField arrival{};  // of a contact ahead: the plane of the place where it arrives
};

// Forgets places from which the pair has moved.
void belong_to(SlideMemory& memory, const Pair& pair, const Stand& now, std::uint64_t mesh) {
  if (memory.mesh == mesh && stands_still(pair, memory.stand, now)) return;
  memory.slid.clear();
  memory.stand = now;
  memory.mesh = mesh;
}

// Whether two contacts are one, as at least one of them has moved there.
bool meet(const Place& a, const Place& b, float ring) {
  if (a.slide == Slide::stayed && b.slide == Slide::stayed) return false;
  return detail::length(a.at.position - b.at.position) < ring &&
         detail::dot(a.at.inward_normal, b.at.inward_normal) > kOneNormal;
}

// Of a thread: no allocation in a step.
struct SlideScratch {
  std::vector<Place> places;
  std::vector<detail::Slider> sliders;
  static SlideScratch& of_this_thread() {
    thread_local SlideScratch scratch;
    return scratch;
  }
};

// The contacts of one pair on their way to where the bodies overlap most.
class Slides {
 public:
  Slides(const Pair& pair, const FoundContacts& found, SlideMemory& memory, std::span<ManifoldContact> contacts)
      : found_(found),
        memory_(memory),
        contacts_(contacts),
        shell_(pair.shell.vps->distances()),
        scratch_(SlideScratch::of_this_thread()) {
    const float other = pair.field.vps != nullptr ? pair.field.vps->voxelmap().voxel_size : 0;
    ring_ = std::max(kRing_vx * shell_.voxel_size, kRingOfOther_vx * other);
    const auto is_shallower = [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; };
    deepest_ =
        static_cast<std::size_t>(std::max_element(contacts.begin(), contacts.end(), is_shallower) - contacts.begin());
    scratch_.places.resize(contacts.size());
  }

  // Finds the places that are known without a search. @return whether these are all
  bool recall() {
    bool is_all = true;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      place(i) = known(i);
      is_all = is_all && place(i).is_found;
    }
    return is_all;
  }

  // Searches for the other places, all at once.
  // @param bodies  contacts' frame
  void search(const detail::TouchingBodies& bodies) { search(bodies, 0, contacts_.size()); }
  // @param body_near  function that returns the other body near a contact, a FieldAtPlaces
  template <class BodyNear>
  void search_each(const detail::PlacedField& shell, const BodyNear& body_near) {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      if (!place(i).is_found) search({shell, body_near(contacts_[i]), shell_.voxel_size}, i, i + 1);
    }
  }

  // Moves the contacts that remain to the front. @return their number
  std::size_t keep() {
    const std::vector<Place>& places = scratch_.places;
    place(deepest_).is_kept = true;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      Place& p = place(i);
      if (i == deepest_ || p.slide == Slide::sloping) continue;
      p.is_kept =
          std::none_of(places.begin(), places.end(), [&](const Place& k) { return k.is_kept && meet(p, k, ring_); });
    }
    std::size_t kept = 0;
    for (const Place& p : places) {
      if (p.is_kept) contacts_[kept++] = p.at;
    }
    return kept;
  }

  [[nodiscard]] float ring() const { return ring_; }

 private:
  [[nodiscard]] int most(std::size_t i) const { return i == deepest_ ? kLongestWay : 1; }

  [[nodiscard]] Place known(std::size_t i) const {
    const ManifoldContact& contact = contacts_[i];
    if (found_.is_on_map(contact)) return {contact, Slide::stayed, true};
    if (found_.is_met_alone(contact)) return {contact, Slide::stayed, true};
    if (!found_.may_slide && i != deepest_) return {contact, Slide::stayed, true};
    if (found_.is_ahead(contact)) return {contact};
    // So far off the surface the fields are too coarse for a ring.
    if (contact.penetration < -shell_.voxel_size) return {contact, Slide::stayed, true};
    const auto before = std::find_if(memory_.slid.begin(), memory_.slid.end(), [&](const SlideMemory::Slid& one) {
      return one.feature == contact.feature && one.most == most(i);
    });
    if (before == memory_.slid.end()) return {contact};
    Place p{contact, before->slide, true};
    p.at.position = contact.position + before->shift;
    p.at.inward_normal = before->direction;
    p.at.penetration += before->gain;
    return p;
  }

  void search(const detail::TouchingBodies& bodies, std::size_t first, std::size_t last) {
    std::vector<detail::Slider>& sliders = scratch_.sliders;
    sliders.clear();
    std::size_t deepest = contacts_.size();  // among the sliders
    for (std::size_t i = first; i < last; ++i) {
      Place& p = place(i);
      if (p.is_found) continue;
      detail::Reach reach{ring_, nullptr};
      if (found_.is_ahead(p.at)) {
        if (i != deepest_ && found_.turn > kRolls && is_steep(bodies, p.at)) {
          p.slide = Slide::sloping;
          continue;
        }
        p.arrival = {p.at.inward_normal, detail::dot(p.at.inward_normal, p.at.position) + p.at.penetration};
        reach = {kRing_vx * shell_.voxel_size, &p.arrival};
      }
      if (i == deepest_) deepest = sliders.size();
      sliders.push_back({&p.at, &p.slide, reach});
    }
    slide_to_deepest(bodies, sliders);
    if (deepest < sliders.size()) {
      const std::span<detail::Slider> alone(&sliders[deepest], 1);
      for (int i = 1; i < kLongestWay && *alone[0].slide == Slide::sloping; ++i) slide_to_deepest(bodies, alone);
    }
    for (std::size_t i = first; i < last; ++i) {
      // The other body ends somewhere, the plane does not. What touches now is no contact ahead.
      Place& p = place(i);
      if (p.is_found || !found_.is_ahead(contacts_[i]) || p.at.penetration <= kInto_vx * shell_.voxel_size) continue;
      p.at = contacts_[i];
      p.slide = Slide::stayed;
    }
    constexpr std::size_t kMost = 256;
    for (std::size_t i = first; i < last && memory_.slid.size() < kMost; ++i) {
      const ManifoldContact& contact = contacts_[i];
      const Place& p = place(i);
      if (p.is_found || found_.is_ahead(contact)) continue;
      memory_.slid.push_back({contact.feature, most(i), p.slide, p.at.position - contact.position, p.at.inward_normal,
                              p.at.penetration - contact.penetration});
    }
  }

  [[nodiscard]] Place& place(std::size_t i) { return scratch_.places[i]; }

  const FoundContacts& found_;
  SlideMemory& memory_;
  const std::span<ManifoldContact> contacts_;
  const VoxelmapView& shell_;
  float ring_ = 0;
  std::size_t deepest_ = 0;
  SlideScratch& scratch_;
};

}  // namespace

std::size_t move_between_samples(const Pair& pair, const FoundContacts& found, PairMemory& memory,
                                 std::span<ManifoldContact> contacts) {
  const VoxelmapView& shell = pair.shell.vps->distances();
  if (contacts.empty() || shell.field == Field::none) return contacts.size();
  if (pair.field.vps != nullptr && pair.field.vps->voxelmap().field == Field::layers) return contacts.size();
  belong_to(memory.slides, pair, memory.now, memory.triangles.mesh);
  Slides slides(pair, found, memory.slides, contacts);
  if (slides.recall()) return slides.keep();

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
  return slides.keep();
}

}  // namespace vps::bullet
