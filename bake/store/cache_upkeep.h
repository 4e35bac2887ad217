// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Measures, prunes and verifies a cache folder. All functions may run while other processes bake, read and prune
/// there: a removed asset stays whole for processes that have it open, and the others bake it again. Unknown files,
/// such as those that `vpsbake report` keeps there, are neither counted nor touched.
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
  std::int64_t oldest_use = 0;  ///< least recent use of an entry; 0 without entries. [s since 1970]
  std::int64_t newest_use = 0;  ///< most recent use of an entry. [s since 1970]
  std::uint64_t leftovers = 0;  ///< temporary files, and reports without assets, of running or killed writers
  std::uint64_t leftover_bytes = 0;
};

/// @throw std::filesystem::filesystem_error when the folder, or one in it, cannot be read
[[nodiscard]] CacheUsage cache_usage(const std::filesystem::path& cache);

enum class PruneMode : std::uint8_t { remove, dry_run };

struct PrunedCache {
  std::uint64_t removed = 0;  ///< entries
  std::uint64_t removed_bytes = 0;
  std::uint64_t leftovers = 0;  ///< removed leftovers: those older than an hour
  std::uint64_t leftover_bytes = 0;
  std::uint64_t failed = 0;   ///< files that could not be removed
  std::uint64_t entries = 0;  ///< entries that remain
  std::uint64_t bytes = 0;    ///< sizes of their files
};

/// Removes what killed writers left, and the least recently used entries until the others fit.
/// @param max_bytes  limit for the sizes of the entries' files
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

/// Reads every entry and compares every hash in it. Damage does not harm bakes, which compare the hashes too, but it is
/// a sign of a faulty disk or of changes by other people.
/// @throw std::filesystem::filesystem_error as cache_usage
[[nodiscard]] CheckedCache verify_cache(const std::filesystem::path& cache, VerifyMode mode = VerifyMode::report);

}  // namespace vps::bake
