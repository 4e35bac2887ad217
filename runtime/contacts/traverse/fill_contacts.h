// SPDX-License-Identifier: Zlib
/// @file Contacts of many points at once. Internal.
#pragma once

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// Points that are hits, one entry each in the rows.
struct HitRows {
  const std::uint32_t* points;
  const std::uint32_t* leaves;
  const float* penetrations;  ///< [unit]
  float unit;                 ///< [m]
};

/// Fills a contact for each of `count` hits. Each instruction set gives the same numbers: those of `transform` and of
/// the functions that decode a shell's points.
void fill_contacts(const PointshellView& shell, const Transform& transform, const HitRows& hits, std::uint32_t count,
                   Contact* out) noexcept;

}  // namespace vps::detail
