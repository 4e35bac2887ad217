// SPDX-License-Identifier: Zlib
/// @file Chooses the few contacts that Bullet keeps. Paper: Sec. 3.2. Internal.
#pragma once

#include <array>
#include <span>

#include "runtime/bullet/manifold_contact.h"

namespace vps::bullet {

/// Chooses up to four contacts: the deepest, then those that spread the manifold's area most. Contacts of the last step
/// are preferred while they are nearly as good: a set that changes in each step adds energy to a resting body.
/// @param features  see feature_of
/// @param previous  features of the contacts chosen in the last step
/// @param alike     penetrations that differ by less count as equal. [Limits: value >= 0] [Units: m]
/// @return how many were chosen; `chosen` holds their indices in `contacts`
std::size_t choose_four(std::span<const Contact> contacts, std::span<const std::uint32_t> features,
                        std::span<const std::uint32_t> previous, float alike, std::array<std::uint32_t, 4>& chosen);

}  // namespace vps::bullet
