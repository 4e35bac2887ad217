// SPDX-License-Identifier: Zlib
/// @file The contacts of a pair before a few are chosen, for every kind of partner. Internal. Paper: Secs. 2.3 and 2.4.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "runtime/contacts/find_hits.h"
#include "runtime/contacts/step_pair.h"

namespace vps::detail {

/// A body that rolls: surfaces near the deepest contact roll past.
struct Rolling {
  float reach = std::numeric_limits<float>::infinity();  ///< how far along the way; 0: it does not roll. [m]
  Vec3 from, along;                                      ///< the deepest contact; unit. Contacts' frame

  [[nodiscard]] bool is_beside(Vec3 place) const { return std::abs(dot(along, place - from)) > reach; }
};

struct FoundContacts {
  /// Points of the shell that are not among `contacts`: few of them are chosen later.
  ContactRows hits;
  bool are_known = false;  ///< those of ChoiceMemory or SegmentMemory, and no others were sought

  /// In tree order. Until `refine`, their `inward_normal` and area are the shell's.
  std::span<Contact> contacts;
  std::span<std::uint32_t> features;  ///< see feature_of
  bool in_shell_frame = false;        ///< the contacts are in the shell's frame, not the field's
  float way = 0;                      ///< of any point in the step; 0: contacts ahead are not sought. [m]
  bool is_joint = false;              ///< see Approach
  RelativeMotion motion;              ///< of the step, contacts' frame; only with contacts ahead
  float reach = 0;                    ///< largest distance of a contact off the surface. [m]
  /// Upper bound of the true V of the shell's points in the other body, without margins. [m]
  float most = std::numeric_limits<float>::max();

  /// Which of them have their final direction, penetration and area. `refine` leaves these as they are.
  enum class Refined : std::uint8_t {
    none,
    arriving,  ///< those farther off the surface than `arriving_beyond`
    all,
  };
  Refined refined = Refined::none;
  float arriving_beyond = std::numeric_limits<float>::infinity();  ///< [m]
  float turn = 0;  ///< of the bodies relative to each other, in a step with contacts ahead. [rad]
  /// Where contacts other than the deepest may leave the shell's samples. Those of a body that falls stay spread out:
  /// they stop it in time.
  Rolling rolling;
  /// Some are places in the shell's distance field (see is_on_map): a sphere's, or corners. There are no segments then.
  bool has_map_contacts = false;
  std::uint32_t shell_points = 0;

  /// Whether a contact is a place of the partner in the distance field of the shell's body. It is final.
  [[nodiscard]] bool is_on_map(const Contact& contact) const {
    return has_map_contacts && contact.point >= shell_points;
  }

  /// Whether a contact is speculative: it meets the partner later in the step.
  [[nodiscard]] bool is_ahead(const Contact& contact) const { return contact.penetration < -arriving_beyond; }
  /// Whether bodies that move together meet there only if one of them is stopped.
  [[nodiscard]] bool is_met_alone(const Contact& contact) const {
    return is_joint && is_ahead(contact) && !closes(contact);
  }
  /// Whether a contact ahead lies on a surface that does not roll past.
  [[nodiscard]] bool is_beside_roll(const Contact& contact) const {
    return is_ahead(contact) && rolling.is_beside(contact.position) && closes(contact);
  }
  /// Whether the gap of a contact ahead closes in the step, in the plane where it arrives.
  [[nodiscard]] bool closes(const Contact& contact) const {
    return -contact.penetration <= arriving_beyond - dot(contact.inward_normal, way_at(motion, contact.position));
  }
  [[nodiscard]] bool is_refined(const Contact& contact) const {
    return refined == Refined::all || is_on_map(contact) || (refined == Refined::arriving && is_ahead(contact));
  }
};

/// Finds the contacts of a pair. With segments, it tests the points in contact in the last step again, except on
/// sheets: a node may then have more than one contact.
/// @param options  of the query; this function sets the cache and adds the margins
/// @param found    has hits unless the contacts are of segments or springs, or of a round body
Status find_contacts(const StepPair& pair, const Partner& partner, QueryOptions options, PairMemory& memory,
                     Workspace& space, FoundContacts& found);

/// Upper bound of the true V of the shell's points, without margins, from a query with a budget. [m]
/// @param distance  up to which it is of use. [m]
[[nodiscard]] float bound_farther(const StepPair& pair, const Partner& partner, float distance, Workspace& space);

/// Remembers the hits and the contacts with sheets among the rows that were chosen.
void remember_choice(const StepPair& pair, const FoundContacts& found, std::span<const std::uint32_t> rows,
                     PairMemory& memory);

/// Rows for the choice of a few: of the hits, then of `contacts`. Valid until the thread's next query.
ContactRows rows_of(const FoundContacts& found, Workspace& space);
/// Adds the contacts of some of these rows.
void add_contacts_of_rows(const StepPair& pair, const FoundContacts& found, std::span<const std::uint32_t> rows,
                          std::vector<ManifoldContact>& contacts);

}  // namespace vps::detail
