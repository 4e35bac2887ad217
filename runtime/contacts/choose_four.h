// SPDX-License-Identifier: Zlib
/// @file Chooses the few contacts that a manifold keeps. Paper: Sec. 3.2. Internal.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// Contacts in rows, as the kernels load them. Each row has kLanePadding entries beyond the last contact's.
struct ContactRows {
  float* position[3] = {};           ///< [m]
  float* penetration = nullptr;      ///< [m]
  std::uint32_t* feature = nullptr;  ///< the same number for the same contact from step to step
  std::uint32_t count = 0;
};

/// Chooses up to four contacts: the deepest, then those that spread the manifold's area most. Contacts of the last step
/// are preferred while they are nearly as good: a set that changes in each step adds energy to a resting body.
/// @param previous  features of the contacts chosen in the last step; at most four
/// @param alike     penetrations that differ by less count as equal. [Limits: value >= 0] [Units: m]
/// @param chosen    their indices in the rows
/// @return how many were chosen
std::size_t choose_four(const ContactRows& contacts, std::span<const std::uint32_t> previous, float alike,
                        std::array<std::uint32_t, 4>& chosen) noexcept;

/// Removes the contacts with a penetration of `least` or less, and keeps the order of the others.
void keep_deeper(float least, ContactRows& contacts) noexcept;

}  // namespace vps::detail
