// SPDX-License-Identifier: Zlib
/// @file What the writer and the reader of a scene's manifest agree on, beside docs/schemas/scene_manifest.schema.json.
/// Internal.
#pragma once

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>

#include "formats/vps_format.h"

namespace vps::scene_manifest {

/// Of lengths, masses and speeds: far beyond what anyone simulates, and far below what floats hold when multiplied.
inline constexpr double kFarthest = 1e9;
/// Of sizes and masses.
inline constexpr double kLeast = 1e-9;

inline constexpr std::size_t kMostBytes = std::size_t{1} << 26;  ///< of the file
inline constexpr std::size_t kMostAssets = 4096;
inline constexpr std::size_t kMostBodies = 65536;
inline constexpr std::size_t kMostShapes = 1024;   ///< of a body
inline constexpr std::size_t kLongestText = 1024;  ///< [Units: bytes]

/// What an asset is known by: XXH3-64 of its user block, which has the hashes of all else. 16 hexadecimal digits.
/// @param file  an asset's, of kUserBlockBytes or more
[[nodiscard]] inline std::string asset_key(std::span<const std::byte> file) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash_bytes(file.first(kUserBlockBytes))));
  return text;
}

}  // namespace vps::scene_manifest
