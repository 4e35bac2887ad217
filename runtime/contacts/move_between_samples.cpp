// SPDX-License-Identifier: Zlib
// Gives the contacts of a pair to what slides them.
#include "runtime/contacts/refine_contacts.h"

#include <algorithm>
#include <array>

namespace vps::detail {
namespace {

constexpr float kRolls = 0.05F;  // turn of a body that may be rolling. [rad]

// Whether the places of a pair are known: it has not moved since. Along a face those that stayed may move, for their
// shifts have no direction.
bool are_known(const StepPair& pair, const PairMemory& of_pair) {
  const SlideMemory& memory = of_pair.slides;
  const auto has_stayed = [](const Slid& slid) { return slid.slide == Slide::stayed; };
  const bool have_stayed = std::all_of(memory.slid.begin(), memory.slid.end(), has_stayed);
  return have_stayed ? stands_still(pair, of_pair.face, memory.stand) : stands_still(pair, memory.stand);
}

// The known places of a pair.
std::vector<Slid>* recalled(const StepPair& pair, std::uint64_t sheet, PairMemory& of_pair) {
  if (!of_pair.is_lasting) return nullptr;
  SlideMemory& memory = of_pair.slides;
  if (memory.sheet != sheet || !are_known(pair, of_pair)) {
    memory.slid.clear();
    memory.stand = pair.shell_to_field;
    memory.sheet = sheet;
  }
  return &memory.slid;
}

SlidingContact to_slide(const FoundContacts& found, ManifoldContact& contact) {
  SlidingContact out{&contact, contact.feature};
  if (found.is_on_map(contact) || found.is_met_alone(contact) || found.is_beside_roll(contact)) {
    out.kind = SlidingContact::Kind::fixed;
  } else if (found.is_ahead(contact)) {
    out.kind = SlidingContact::Kind::ahead;
  }
  return out;
}

// Whether contacts slide at all.
bool slide(const StepPair& pair, const Partner& partner) {
  const VoxelmapView* const map = partner.map();
  return pair.distances.field != Field::none && (map == nullptr || map->field != Field::layers);
}

}  // namespace

bool are_refined(const StepPair& pair, const Partner& partner, const FoundContacts& found, const PairMemory& memory,
                 std::span<ManifoldContact> contacts) {
  const SlideMemory& slides = memory.slides;
  if (!found.are_known || found.way > 0 || partner.map() == nullptr || !slide(pair, partner)) return false;
  if (!memory.is_lasting || !are_known(pair, memory)) return false;
  const auto deepest = std::max_element(contacts.begin(), contacts.end(), [](const Contact& a, const Contact& b) {
    return a.penetration < b.penetration;
  });
  std::array<float, 4> areas{};
  if (contacts.size() > areas.size()) return false;
  for (auto contact = contacts.begin(); contact != contacts.end(); ++contact) {
    const Slid* const before = find_slid(slides.slid, contact->feature, contact == deepest);
    if (before == nullptr || contact->penetration < -pair.distances.voxel_size) return false;
    areas[static_cast<std::size_t>(contact - contacts.begin())] = before->area;
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) contacts[i].area = areas[i];
  return true;
}

std::size_t move_between_samples(const StepPair& pair, const Partner& partner, const FoundContacts& found,
                                 PairMemory& memory, Workspace& space, std::span<ManifoldContact> contacts) {
  const VoxelmapView* const map = partner.map();
  if (contacts.empty() || !slide(pair, partner)) return contacts.size();
  std::vector<SlidingContact>& sliding = space.sliding;
  sliding.resize(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) sliding[i] = to_slide(found, contacts[i]);
  const float voxel = pair.distances.voxel_size;
  const SlideOptions options{voxel, map != nullptr ? map->voxel_size : 0, pair.shell.feature_covering_radius,
                             !(found.rolling.reach > 0), found.turn > kRolls};
  Slides slides(options, sliding, recalled(pair, partner.sheet != nullptr ? partner.sheet->version() : 0, memory));
  if (!slides.recall()) {
    const PlacedField distances(pair.distances,
                                found.in_shell_frame ? Pose() : relative_pose(pair.shell_pose, pair.field_pose));
    if (partner.sheet != nullptr) {
      partner.sheet->slide(distances, slides);
    } else {
      const PlacedField placed(partner.field, Pose());
      slides.search({distances, placed, voxel});
    }
  }
  slides.keep();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (sliding[i].is_kept) contacts[kept++] = contacts[i];
  }
  return kept;
}

}  // namespace vps::detail
