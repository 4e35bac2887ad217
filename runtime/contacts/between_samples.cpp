// SPDX-License-Identifier: Zlib
// Slides contacts to the place of deepest overlap, and keeps one of those that meet.
#include "runtime/contacts/between_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/fields/penetration.h"

namespace vps::detail {
namespace {

// Smaller rings see the rounding of the fields, larger ones the edges of the bodies
// (docs/internals/benchmarks/motion.md).
constexpr float kRing_vx = 4;
constexpr float kRingOfOther_vx = 1.5F;
constexpr float kOneNormal = 0.966F;  // 15 degrees
constexpr int kLongestWay = 8;        // of the deepest contact. [rings]
constexpr float kInto_vx = 0.5F;      // a contact ahead slides no deeper into the plane where it arrives
constexpr std::size_t kTogether = 32;
constexpr std::size_t kMostRemembered = 256;

// Whether two contacts are one, if at least one of them has moved there.
bool meet(const SlidingContact& a, const SlidingContact& b, float ring) {
  return length(a.at->position - b.at->position) < ring && dot(a.at->inward_normal, b.at->inward_normal) > kOneNormal;
}

}  // namespace

Slides::Slides(const SlideOptions& options, std::span<SlidingContact> contacts, std::vector<Slid>* memory)
    : options_(options),
      contacts_(contacts),
      memory_(memory),
      ring_(std::max(kRing_vx * options.voxel_size, kRingOfOther_vx * options.other_voxel_size)),
      rings_(std::clamp(static_cast<int>(std::ceil(options.spacing / ring_)), 1, kLongestWay)) {
  const auto is_shallower = [](const SlidingContact& a, const SlidingContact& b) {
    return a.at->penetration < b.at->penetration;
  };
  deepest_ =
      static_cast<std::size_t>(std::max_element(contacts.begin(), contacts.end(), is_shallower) - contacts.begin());
}

const Slid* find_slid(std::span<const Slid> memory, std::uint32_t feature, bool is_deepest) noexcept {
  const auto found = std::find_if(memory.begin(), memory.end(), [&](const Slid& one) {
    return one.feature == feature && one.is_deepest == is_deepest;
  });
  return found != memory.end() ? &*found : nullptr;
}

bool Slides::is_known(std::size_t i) {
  SlidingContact& contact = contacts_[i];
  if (contact.kind == SlidingContact::Kind::fixed || (options_.only_deepest && i != deepest_)) return true;
  if (contact.kind == SlidingContact::Kind::ahead) return false;
  // So far off the surface the fields are too coarse for a ring.
  if (contact.at->penetration < -options_.voxel_size) return true;
  if (memory_ == nullptr) return false;
  const Slid* const before = find_slid(*memory_, contact.feature, i == deepest_);
  if (before == nullptr) return false;
  contact.slide = before->slide;
  contact.at->position = contact.at->position + before->shift;
  contact.at->inward_normal = before->direction;
  contact.at->penetration += before->gain;
  return true;
}

bool Slides::recall() {
  bool is_all = true;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    contacts_[i].is_found = is_known(i);
    is_all = is_all && contacts_[i].is_found;
  }
  return is_all;
}

void Slides::search(const TouchingBodies& bodies, std::size_t first, std::size_t last) {
  for (; first < last; first += kTogether) slide(bodies, first, std::min(first + kTogether, last));
}

void Slides::slide(const TouchingBodies& bodies, std::size_t first, std::size_t last) {
  std::array<Slider, kTogether> sliders;
  std::array<Contact, kTogether> before;
  std::array<HalfSpaceField, kTogether> arrivals;
  std::array<Vec3, kTogether> from;  // of the sliders, before they last slid
  std::size_t count = 0;
  std::size_t deepest = kTogether;  // among the sliders
  for (std::size_t i = first; i < last; ++i) {
    SlidingContact& contact = contacts_[i];
    if (contact.is_found) continue;
    before[i - first] = *contact.at;
    Reach reach{ring_, nullptr};
    if (contact.kind == SlidingContact::Kind::ahead) {
      if (i != deepest_ && options_.rolls && is_steep(bodies, *contact.at)) {
        contact.slide = Slide::sloping;
        continue;
      }
      const Vec3 n = contact.at->inward_normal;
      arrivals[i - first] = {n, dot(n, contact.at->position) + contact.at->penetration};
      reach = {kRing_vx * options_.voxel_size, &arrivals[i - first]};
    }
    if (i == deepest_) deepest = count;
    from[count] = contact.at->position;
    sliders[count++] = {contact.at, &contact.slide, reach};
  }
  slide_to_deepest(bodies, {sliders.data(), count});
  // From the same place a contact would go nowhere again.
  const auto goes_on = [&](std::size_t i) {
    const Vec3 at = sliders[i].contact->position;
    const bool has_moved = length(at - from[i]) > 0;
    from[i] = at;
    return has_moved && *sliders[i].slide == Slide::sloping;
  };
  for (int ring = 1; ring < rings_; ++ring) {
    std::array<Slider, kTogether> farther;
    std::size_t going = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (sliders[i].reach.arrival == nullptr && goes_on(i)) farther[going++] = sliders[i];
    }
    slide_to_deepest(bodies, {farther.data(), going});
  }
  for (int ring = rings_; deepest < count && ring < kLongestWay && goes_on(deepest); ++ring) {
    slide_to_deepest(bodies, {&sliders[deepest], 1});
  }
  for (std::size_t i = first; i < last; ++i) {
    SlidingContact& contact = contacts_[i];
    if (contact.is_found) continue;
    const Contact& start = before[i - first];
    if (contact.kind == SlidingContact::Kind::ahead) {
      // The other body ends somewhere, the plane does not. What touches now is no contact ahead.
      if (contact.at->penetration <= kInto_vx * options_.voxel_size) continue;
      *contact.at = start;
      contact.slide = Slide::stayed;
    } else if (memory_ != nullptr && memory_->size() < kMostRemembered) {
      memory_->push_back({contact.feature, i == deepest_, contact.slide, contact.at->position - start.position,
                          contact.at->inward_normal, contact.at->penetration - start.penetration, start.area});
    }
  }
}

void Slides::keep() {
  // Two that stayed are never one, and a landing body has a hundred of them.
  const SlidingContact* moved = nullptr;
  const auto take = [&](SlidingContact& contact) {
    contact.is_kept = true;
    if (contact.slide == Slide::stayed) return;
    contact.moved_before = moved;
    moved = &contact;
  };
  const auto meets_any = [&](const SlidingContact& contact) {
    if (contact.slide != Slide::stayed) {
      return std::any_of(contacts_.begin(), contacts_.end(),
                         [&](const SlidingContact& other) { return other.is_kept && meet(contact, other, ring_); });
    }
    for (const SlidingContact* other = moved; other != nullptr; other = other->moved_before) {
      if (meet(contact, *other, ring_)) return true;
    }
    return false;
  };
  take(contacts_[deepest_]);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    SlidingContact& contact = contacts_[i];
    if (i != deepest_ && contact.slide != Slide::sloping && !meets_any(contact)) take(contact);
  }
}

}  // namespace vps::detail
