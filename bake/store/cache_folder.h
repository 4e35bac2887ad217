// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Where the files of a cache lie: DIR/ab/KEY.vps.hdf and DIR/ab/KEY.json, where ab is the key's first two
/// digits. Subfolders are there because a folder of a million files is slow. Internal to the cache.
#pragma once

#include <filesystem>

#include "bake/store/cache.h"

namespace vps::bake::detail {

constexpr const char* kAssetEnding = ".vps.hdf";
constexpr const char* kReportEnding = ".json";
constexpr std::size_t kKeyDigits = 32;
constexpr std::size_t kFolderDigits = 2;

/// @param ending  kAssetEnding or kReportEnding
[[nodiscard]] inline std::filesystem::path entry_file(const std::filesystem::path& cache, const CacheKey& key,
                                                      const char* ending) {
  return cache / key.digits.substr(0, kFolderDigits) / (key.digits + ending);
}

/// Maps an entry's asset and compares every hash in it.
[[nodiscard]] Status open_entry(const std::filesystem::path& cache, const CacheKey& key, Asset& asset);

/// @return false when an entry's report is missing or damaged
[[nodiscard]] bool read_report(const std::filesystem::path& cache, const CacheKey& key, BakeReport& report);

}  // namespace vps::bake::detail
