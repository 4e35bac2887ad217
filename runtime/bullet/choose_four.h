// SPDX-License-Identifier: Zlib
/// @file Chooses the few contacts that Bullet keeps. Paper: Sec. 3.2. Internal.
#pragma once

#include <array>
#include <span>

#include "runtime/bullet/manifold_contact.h"

namespace vps::bullet {

/// Up to four contacts: the deepest, then those that spread the manifold's area most. Contacts of the step before are
/// preferred while they are nearly as good: a set that flickers feeds energy into a resting body.
/// @param features  of the contacts, as feature_of takes them
/// @param previous  features of the step before
/// @param alike     penetrations that differ by less count as equal. [Limits: value >= 0] [Units: m]
/// @return how many were chosen; `chosen` holds their places in `contacts`
std::size_t choose_four(std::span<const Contact> contacts, std::span<const std::uint32_t> features,
                        std::span<const std::uint32_t> previous, float alike, std::array<std::uint32_t, 4>& chosen);

}  // namespace vps::bullet
