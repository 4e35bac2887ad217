// SPDX-License-Identifier: Zlib
/// @file Contacts at the places between the shell's points where the bodies overlap most. Internal.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/contacts/slide_to_deepest.h"

namespace vps::detail {

/// A contact on its way from a point of the shell to where the bodies overlap most.
struct SlidingContact {
  enum class Kind : std::uint8_t {
    fixed,     ///< it stays
    touching,  ///< it slides
    ahead,     ///< it meets the other body later in the step: it slides in the plane where it arrives
  };
  Contact* at = nullptr;  ///< with its final direction; then where it slid to
  std::uint32_t feature = 0;
  Kind kind = Kind::touching;
  // Results.
  Slide slide = Slide::stayed;
  bool is_found = false;  ///< without a search
  bool is_kept = false;
  const SlidingContact* moved_before = nullptr;  ///< another one that is kept and has moved; null: none
};

/// Where a contact slid to. While a pair stands still it need not be sought again.
struct Slid {
  std::uint32_t feature = 0;
  bool is_deepest = false;  ///< see find_slid
  Slide slide = Slide::stayed;
  Vec3 shift;      ///< of the position, contacts' frame. [m]
  Vec3 direction;  ///< contacts' frame, unit
  float gain = 0;  ///< of the penetration. [m]
  float area = 0;  ///< of the contact, along its direction before it slid. [m^2]
};

/// What is known of a contact; null: nothing.
/// @param is_deepest  of the pair's contacts: it may go farther
const Slid* find_slid(std::span<const Slid> memory, std::uint32_t feature, bool is_deepest) noexcept;

struct SlideOptions {
  float voxel_size = 0;        ///< of the shell's distances. [m]
  float other_voxel_size = 0;  ///< of the other body's; 0: it has none. [m]
  float spacing = 0;           ///< of the shell: a place of its surface may be so far from a point. [m]
  bool only_deepest = false;   ///< the others stay
  bool rolls = false;  ///< contacts ahead lie on surfaces that roll past: those where the shell is steep are none
};

/// Moves contacts from the points of the shell to where the bodies overlap most, so that they change continuously as a
/// body rolls. Points that lead or follow such a contact on a round body would brake it: they end at the same place,
/// and one contact remains; or the overlap grows beyond their neighbourhood, and they are removed. The deepest contact
/// always remains.
class Slides {
 public:
  /// @param contacts  one at least
  /// @param memory    of a pair that stands where it stood; null: none
  Slides(const SlideOptions& options, std::span<SlidingContact> contacts, std::vector<Slid>* memory);

  /// Finds the places that are known without a search. @return whether these are all
  bool recall();
  /// Searches for the other places.
  /// @param bodies  contacts' frame
  void search(const TouchingBodies& bodies) { search(bodies, 0, contacts_.size()); }
  /// The same, where the other body is another one at each contact.
  /// @param body_near  function that returns it near a contact, a FieldAtPlaces
  template <class BodyNear>
  void search_each(const PlacedField& shell, const BodyNear& body_near) {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      if (!contacts_[i].is_found) search({shell, body_near(*contacts_[i].at), options_.voxel_size}, i, i + 1);
    }
  }
  /// Marks the contacts that remain.
  void keep();

  /// Radius of the neighbourhood that decides. [m]
  [[nodiscard]] float ring() const { return ring_; }

 private:
  void search(const TouchingBodies& bodies, std::size_t first, std::size_t last);
  void slide(const TouchingBodies& bodies, std::size_t first, std::size_t last);
  [[nodiscard]] bool is_known(std::size_t i);

  const SlideOptions options_;
  const std::span<SlidingContact> contacts_;
  std::vector<Slid>* const memory_;
  float ring_ = 0;
  int rings_ = 1;  // that a contact may go
  std::size_t deepest_ = 0;
};

}  // namespace vps::detail
