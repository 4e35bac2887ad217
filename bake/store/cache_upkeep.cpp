// SPDX-License-Identifier: GPL-3.0-or-later
// Scans a cache folder. Only files with names that the cache gives belong to it; all others are left alone.
#include "bake/store/cache_upkeep.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include "bake/store/cache_folder.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::bake {
namespace {

namespace fs = std::filesystem;
using detail::entry_file;
using detail::kAssetEnding;
using detail::kFolderDigits;
using detail::kKeyDigits;
using detail::kReportEnding;

constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]
// A writer finishes much sooner with its temporary file, and with the asset that follows its report.
constexpr std::int64_t kLeftoverAge = 3600 * kSecond;

struct File {
  std::string name;
  std::int64_t time = 0;  // of its last change. [ns since 1970]
  std::uint64_t bytes = 0;
};

struct Entry {
  CacheKey key;
  std::int64_t used = 0;  // [ns since 1970]
  std::uint64_t bytes = 0;
};

struct Leftover {
  fs::path path;
  std::int64_t time = 0;  // [ns since 1970]
  std::uint64_t bytes = 0;
};

struct Contents {
  std::vector<Entry> entries;  // by key
  std::vector<Leftover> leftovers;
};

std::int64_t change_time(const struct stat& facts) {
  return facts.st_mtim.tv_sec * kSecond + facts.st_mtim.tv_nsec;
}

[[noreturn]] void fail_reading(const fs::path& folder) {
  throw fs::filesystem_error("cannot be read", folder, std::error_code(errno, std::generic_category()));
}

// Regular files of a folder by name; none when it does not exist.
std::vector<File> list_files(const fs::path& folder) {
  const std::unique_ptr<DIR, int (*)(DIR*)> list(::opendir(folder.c_str()), ::closedir);
  if (!list && errno == ENOENT) return {};
  if (!list) fail_reading(folder);
  std::vector<File> files;
  while (true) {
    errno = 0;
    const dirent* const one = ::readdir(list.get());
    if (one == nullptr && errno != 0) fail_reading(folder);
    if (one == nullptr) break;
    struct stat facts {};
    // Skips files that were removed meanwhile.
    if (::fstatat(::dirfd(list.get()), one->d_name, &facts, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(facts.st_mode))
      continue;
    files.push_back({one->d_name, change_time(facts), static_cast<std::uint64_t>(facts.st_size)});
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.name < b.name; });
  return files;
}

// The key in the name of an entry's file; empty for other files.
std::string_view key_in(std::string_view name, std::string_view folder) {
  const std::string_view key = name.substr(0, kKeyDigits);
  const bool ours =
      key.size() == kKeyDigits && key.starts_with(folder) && key.find_first_not_of("0123456789abcdef") == key.npos;
  return ours ? key : std::string_view();
}

void read_folder(const fs::path& cache, const std::string& name, Contents& contents) {
  const fs::path folder = cache / name;
  const File* report = nullptr;  // a report whose asset was not seen yet
  const auto leave = [&](const File* file) {
    if (file != nullptr) contents.leftovers.push_back({folder / file->name, file->time, file->bytes});
  };
  const std::vector<File> files = list_files(folder);
  // KEY.json comes before KEY.vps.hdf.
  for (const File& file : files) {
    const std::string_view key = key_in(file.name, name);
    const std::string_view ending = std::string_view(file.name).substr(key.size());
    if (!key.empty() && ending == kReportEnding) {
      leave(std::exchange(report, &file));
    } else if (!key.empty() && ending == kAssetEnding) {
      const bool complete = report != nullptr && report->name.starts_with(key);
      contents.entries.push_back({{std::string(key)}, file.time, file.bytes + (complete ? report->bytes : 0)});
      if (!complete) leave(report);
      report = nullptr;
    } else if (file.name.starts_with(kTemporaryPrefix)) {
      leave(&file);
    }
  }
  leave(report);
}

Contents read_cache(const fs::path& cache) {
  Contents contents;
  if (!fs::is_directory(cache)) throw fs::filesystem_error("", cache, std::make_error_code(std::errc::not_a_directory));
  for (int i = 0; i < 256; ++i) read_folder(cache, fmt::format("{:02x}", i), contents);
  return contents;
}

// What is wrong with an entry; empty when nothing is.
std::string damage(const fs::path& cache, const CacheKey& key, Status status, const Asset& asset) {
  if (status != Status::ok) return describe(status);
  if (cache_key(record_of(asset)) != key) return "its record is not the one of its name";
  BakeReport ignored;
  return detail::read_report(cache, key, ignored) ? "" : "its report is missing or damaged";
}

}  // namespace

CacheUsage cache_usage(const fs::path& cache) {
  const Contents contents = read_cache(cache);
  CacheUsage usage;
  for (const Entry& entry : contents.entries) {
    const std::int64_t used = entry.used / kSecond;
    usage.oldest_use = usage.entries == 0 ? used : std::min(usage.oldest_use, used);
    usage.newest_use = usage.entries == 0 ? used : std::max(usage.newest_use, used);
    ++usage.entries;
    usage.bytes += entry.bytes;
  }
  usage.leftovers = contents.leftovers.size();
  for (const Leftover& leftover : contents.leftovers) usage.leftover_bytes += leftover.bytes;
  return usage;
}

PrunedCache prune_cache(const fs::path& cache, std::uint64_t max_bytes, PruneMode mode) {
  Contents contents = read_cache(cache);
  PrunedCache pruned;
  const auto remove = [&](const fs::path& file) {
    const bool gone = mode == PruneMode::dry_run || ::unlink(file.c_str()) == 0 || errno == ENOENT;
    if (!gone) ++pruned.failed;
    return gone;
  };
  const std::int64_t now = std::time(nullptr) * kSecond;
  for (const Leftover& leftover : contents.leftovers) {
    if (now - leftover.time < kLeftoverAge || !remove(leftover.path)) continue;
    ++pruned.leftovers;
    pruned.leftover_bytes += leftover.bytes;
  }
  pruned.entries = contents.entries.size();
  for (const Entry& entry : contents.entries) pruned.bytes += entry.bytes;
  std::stable_sort(contents.entries.begin(), contents.entries.end(),
                   [](const Entry& a, const Entry& b) { return a.used < b.used; });
  for (const Entry& entry : contents.entries) {
    if (pruned.bytes <= max_bytes) break;
    const fs::path asset = entry_file(cache, entry.key, kAssetEnding);
    struct stat facts {};
    if (::stat(asset.c_str(), &facts) == 0 && change_time(facts) != entry.used) continue;  // used meanwhile
    // Removes the asset first: a report alone is no entry.
    if (!remove(asset)) continue;
    remove(entry_file(cache, entry.key, kReportEnding));
    ++pruned.removed;
    pruned.removed_bytes += entry.bytes;
    --pruned.entries;
    pruned.bytes -= entry.bytes;
  }
  return pruned;
}

CheckedCache verify_cache(const fs::path& cache, VerifyMode mode) {
  CheckedCache checked;
  for (const Entry& entry : read_cache(cache).entries) {
    const fs::path file = entry_file(cache, entry.key, kAssetEnding);
    Asset asset;
    const Status status = detail::open_entry(cache, entry.key, asset);
    std::string reason = damage(cache, entry.key, status, asset);
    std::error_code unknown;
    if (!reason.empty() && !fs::exists(file, unknown)) continue;  // removed meanwhile
    ++checked.entries;
    checked.bytes += entry.bytes;
    if (status == Status::wrong_version) {
      ++checked.other_versions;
    } else if (!reason.empty()) {
      const bool removed = mode == VerifyMode::remove_damaged && fs::remove(file, unknown);
      if (removed) fs::remove(entry_file(cache, entry.key, kReportEnding), unknown);
      checked.damaged.push_back({file, std::move(reason), removed});
    }
  }
  return checked;
}

}  // namespace vps::bake
