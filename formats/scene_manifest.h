// SPDX-License-Identifier: Zlib
/// @file Limits and keys that the writer and the reader of a scene's manifest share, in addition to
/// docs/schemas/scene_manifest.schema.json. Internal.
#pragma once

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>

#include "formats/vps_format.h"

namespace vps::scene_manifest {

/// Largest length, mass and speed. Far beyond any simulation, and small enough that products fit in floats.
inline constexpr double kFarthest = 1e9;
/// Smallest size and mass.
inline constexpr double kLeast = 1e-9;
/// Smallest principal moment of inertia. [kg m^2]
inline constexpr double kLeastInertia = 1e-18;
inline constexpr double kMostGravity = 1e6;  ///< along an axis. [m/s^2]

inline constexpr std::size_t kMostBytes = std::size_t{1} << 26;  ///< of the file
inline constexpr std::size_t kMostAssets = 4096;
inline constexpr std::size_t kMostBodies = 65536;
inline constexpr std::size_t kMostShapes = 1024;   ///< of a body
inline constexpr std::size_t kMostJoints = 512;    ///< of a multibody
inline constexpr std::size_t kLongestText = 1024;  ///< [Units: bytes]

/// Key of an asset: XXH3-64 of its user block, which has the hashes of all other bytes. 16 hexadecimal digits.
/// @param file  an asset's bytes, at least kUserBlockBytes of them
[[nodiscard]] inline std::string asset_key(std::span<const std::byte> file) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash_bytes(file.first(kUserBlockBytes))));
  return text;
}

}  // namespace vps::scene_manifest
