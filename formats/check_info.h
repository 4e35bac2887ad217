// SPDX-License-Identifier: Zlib
/// @file Ranges of the header's scalars. Internal to formats.
#pragma once

#include "formats/vps_format.h"

namespace vps::detail {

/// Bricks of a grid, as the vector kernels number them in signed integers of 32 bits.
inline constexpr std::uint64_t kMostBricks = (std::uint64_t{1} << 31) - 1;
/// Points, facets, nodes of the tree and corners of hulls. Queries keep four numbers for each of them in 32 bits.
inline constexpr std::uint64_t kMostCount = std::uint64_t{1} << 30;

/// Whether every scalar is in its range, and those of the mesh fit each other: docs/internals/format.md, "Ranges".
[[nodiscard]] bool info_is_good(const AssetInfo& info) noexcept;

}  // namespace vps::detail
