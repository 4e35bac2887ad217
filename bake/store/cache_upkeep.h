// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a cache folder holds, which of it is damaged, and how it is kept small. All of it may run while other
/// processes bake, hit and prune: what is removed stays whole for those that have it open, and is baked again for
/// others. Files that are not of an entry, such as what `vpsbake report` keeps there, are neither counted nor touched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bake/store/cache.h"

namespace vps::bake {

struct CacheUsage {
  std::uint64_t entries = 0;
  std::uint64_t bytes = 0;      ///< sizes of the entries' files
  std::int64_t oldest_use = 0;  ///< of the entry that was used least recently; 0 without any. [s since 1970]
  std::int64_t newest_use = 0;  ///< [s since 1970]
  std::uint64_t leftovers = 0;  ///< temporary files, and reports without assets: of writers at work, or killed ones
  std::uint64_t leftover_bytes = 0;
};

/// @throw std::filesystem::filesystem_error when the folder, or one in it, cannot be read
[[nodiscard]] CacheUsage cache_usage(const std::filesystem::path& cache);

enum class PruneMode : std::uint8_t { remove, dry_run };

struct PrunedCache {
  std::uint64_t removed = 0;  ///< entries
  std::uint64_t removed_bytes = 0;
  std::uint64_t leftovers = 0;  ///< removed: those of more than an hour
  std::uint64_t leftover_bytes = 0;
  std::uint64_t failed = 0;   ///< files that could not be removed
  std::uint64_t entries = 0;  ///< that are left
  std::uint64_t bytes = 0;    ///< of them
};

/// Removes the entries that were used least recently until the others fit, and what killed writers left.
/// @param max_bytes  for the entries' files
/// @throw std::filesystem::filesystem_error as cache_usage
PrunedCache prune_cache(const std::filesystem::path& cache, std::uint64_t max_bytes,
                        PruneMode mode = PruneMode::remove);

struct DamagedEntry {
  std::filesystem::path file;  ///< the asset
  std::string reason;          ///< without a full stop
  bool removed = false;
};

struct CheckedCache {
  std::uint64_t entries = 0;  ///< all, the damaged ones included
  std::uint64_t bytes = 0;
  std::uint64_t other_versions = 0;  ///< entries of another version of the format, which are not checked
  std::vector<DamagedEntry> damaged;
};

enum class VerifyMode : std::uint8_t { report, remove_damaged };

/// Reads every entry and compares every hash in it. Damage is harmless to bakes, which compare too, but says that
/// something is wrong with the disk or the people.
/// @throw std::filesystem::filesystem_error as cache_usage
[[nodiscard]] CheckedCache verify_cache(const std::filesystem::path& cache, VerifyMode mode = VerifyMode::report);

}  // namespace vps::bake
