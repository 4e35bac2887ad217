// SPDX-License-Identifier: Zlib
/// @file The points of a pair in contact, before they become contacts. Internal. Paper: Algorithm 1 (Sec. 2.3).
#pragma once

#include "runtime/contacts/choose_four.h"

namespace vps::detail {

/// Rows that may be added to those of the hits.
inline constexpr std::uint32_t kExtraRows = 16;

/// The regular traverse without forces: a flat face touches with thousands of points, of which few become contacts.
/// @param options  contact distance and cache; no budget, level, segments or facets
/// @param hits     in the field's frame, in tree order; the features are the points' numbers. The rows are the
/// scratch's, with room for kExtraRows more
Status find_hits(const PointshellView& shell, FieldRef field, const Pose& shell_to_field, const QueryOptions& options,
                 Scratch& scratch, ContactRows& hits) noexcept;

}  // namespace vps::detail
