// SPDX-License-Identifier: Zlib
/// @file Checks the octree of the field. Internal to formats.
#pragma once

#include <cstdint>
#include <span>

namespace vps::detail {

/// Whether all entries refer to nodes and samples that are there. Nodes refer to later ones only, so no walk down is
/// endless.
/// @param nodes   eight entries each
/// @param slices  of samples
/// @param planes  eights of planes, of which nodes of roots have the first; 0: there are no planes
[[nodiscard]] bool octree_is_good(std::span<const std::uint32_t> roots, std::span<const std::uint32_t> nodes,
                                  std::uint64_t slices, std::uint64_t planes) noexcept;

}  // namespace vps::detail
