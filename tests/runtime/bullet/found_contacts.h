// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The contacts of a pair of Bullet's before a few are chosen.
#pragma once

#include "runtime/bullet/partners/partner.h"
#include "runtime/contacts/find_contacts.h"

namespace vps::test {

struct PairSearch {
  detail::PairMemory memory;
  bullet::PairPartner partner;
  detail::FoundContacts found;  // until the thread's next search

  Status find(const bullet::Pair& pair, const QueryOptions& options) {
    found = {};
    found.reach = options.contact_distance;
    return detail::find_contacts(bullet::in_step(pair), *partner.of(pair, false), options, memory, bullet::workspace(),
                                 found);
  }
};

}  // namespace vps::test
