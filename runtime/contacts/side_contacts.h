// SPDX-License-Identifier: Zlib
/// @file The contacts of one body's points in the other body for a step: finds, chooses, refines. Internal. Paper:
/// Secs. 2.4 and 3.2.
#pragma once

#include "runtime/contacts/arriving_contacts.h"

namespace vps::detail {

struct SideQuery {
  float distance = 0;         ///< surfaces up to this far apart are in contact, without the margins. [m]
  bool leaves_faces = false;  ///< see QueryOptions
  std::span<const FlatPatch> flat_patches = {};  ///< of the shell, for springs
  Approach approach = {};                        ///< of the pair
  std::size_t most = 4;                          ///< contacts; with segments, kContactsPerSegment for each
  std::size_t most_ahead = 4;  ///< the same in a step with contacts ahead; beyond `most` in further slots
};

struct SideContacts {
  std::span<ManifoldContact> contacts;  ///< in order of their slots; until the workspace's next use
  bool in_shell_frame = false;          ///< else in the field's
  float reach = 0;                      ///< largest distance of a contact off the surface. [m]
  bool are_all = false;                 ///< the other body's points are not needed
};

/// A box about a body, in the frame of its field.
struct FieldBox {
  Vec3 low, high;
  /// Half the diagonal. [m]
  [[nodiscard]] float radius() const noexcept { return length(high - low) / 2; }
};

/// A distance that the bodies surely have, without their margins: between the shell's first sphere and a box about the
/// other body. Cheap, as most pairs whose boxes overlap are apart. At most 0: none. [m]
[[nodiscard]] double distance_to_box(const StepPair& pair, const FieldBox& box) noexcept;

/// The one way from a pair to its contacts. Throws std::bad_alloc.
Status contacts_of_side(const StepPair& pair, const Partner& partner, const SideQuery& query, PairMemory& memory,
                        Workspace& space, SideContacts& out);

/// Chooses more contacts: the deepest if none is chosen, then those that are deep and far from those chosen. One that
/// does not touch yet carries no load, however far out it lies.
/// @param penetration  function of a contact's number. [m]
/// @param squared      distance between two contacts, function of their numbers. [m^2]
/// @param chosen       their numbers
template <class Penetration, class Squared>
void choose_more(std::size_t count, const Penetration& penetration, const Squared& squared, float alike,
                 std::size_t most, std::vector<float>& nearest, std::vector<std::uint32_t>& chosen) {
  nearest.assign(count, std::numeric_limits<float>::max());
  for (std::size_t done = 0; done < most && count > 0; ++done) {
    if (done == chosen.size()) {
      float best = 0;
      std::size_t next = count;
      for (std::size_t i = 0; i < count; ++i) {
        const float v = penetration(i);
        const float off = alike * alike * alike / (v * v + alike * alike);
        const float worth = nearest[i] * (v >= 0 ? v + alike : off);
        const bool is_better = done == 0 ? next == count || v > penetration(next) : worth > best;
        if (!is_better) continue;
        best = worth;
        next = i;
      }
      if (next == count) return;
      chosen.push_back(static_cast<std::uint32_t>(next));
    }
    for (std::size_t i = 0; i < count; ++i) nearest[i] = std::min(nearest[i], squared(i, chosen[done]));
  }
}

}  // namespace vps::detail
