// SPDX-License-Identifier: GPL-3.0-or-later
// Finds, checks and adds the entries of a cache folder.
#include "bake/store/cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>

#include "bake/store/cache_folder.h"
#include "bake/store/cache_upkeep.h"

namespace vps::bake {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

using detail::entry_file;
using detail::kAssetEnding;
using detail::kReportEnding;

constexpr std::uintmax_t kMostReportBytes = std::uintmax_t{1} << 24;

std::string hash_line(const std::string& text) {
  return fmt::format("{:016x}\n", hash_bytes(std::as_bytes(std::span(text))));
}

// A line with the hash of the JSON, then the JSON.
std::string to_text(const BakeReport& report) {
  const BakePlan& plan = report.plan;
  const Json json = {{"voxel_size", plan.voxel_size},
                     {"dims", plan.dims},
                     {"voxels", plan.voxels},
                     {"predicted_points", plan.predicted_points},
                     {"predicted_memory_bytes", plan.predicted_memory_bytes},
                     {"repair", report.repair},
                     {"filled_share", report.filled_share},
                     {"notes", report.notes}};
  const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
  return hash_line(text) + text;
}

// Marks the folder as a cache, which backups leave out (bford.info/cachedir). For folders that the cache made itself:
// in a folder with other files the tag would leave those out too.
void tag_cache(const fs::path& folder) {
  std::ofstream(folder / "CACHEDIR.TAG") << "Signature: 8a477f597d28d172789f06886806bc55\n"
                                            "# This folder is a cache of vpsbake. It may be deleted.\n";
}

// Why the folder of an entry cannot be made; empty when it is there.
std::string make_folders(const fs::path& cache, const fs::path& entry) {
  std::error_code failed;
  if (fs::create_directories(cache, failed)) tag_cache(cache);
  if (!failed) fs::create_directory(entry.parent_path(), failed);
  return failed ? "the folder cannot be made (" + failed.message() + ")" : "";
}

}  // namespace

Status detail::open_entry(const fs::path& cache, const CacheKey& key, Asset& asset) {
  const Status status = Asset::open(entry_file(cache, key, kAssetEnding).c_str(), asset);
  return status == Status::ok ? asset.verify() : status;
}

bool detail::read_report(const fs::path& cache, const CacheKey& key, BakeReport& report) {
  const fs::path path = entry_file(cache, key, kReportEnding);
  std::error_code failed;
  // A device, to which a link may lead, has no size and no end.
  if (fs::file_size(path, failed) > kMostReportBytes || failed) return false;
  std::ifstream file(path, std::ios::binary);
  std::string hash;
  std::getline(file, hash);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (hash + '\n' != hash_line(text)) return false;
  try {
    const Json json = Json::parse(text);
    BakePlan& plan = report.plan;
    json.at("voxel_size").get_to(plan.voxel_size);
    json.at("dims").get_to(plan.dims);
    json.at("voxels").get_to(plan.voxels);
    json.at("predicted_points").get_to(plan.predicted_points);
    json.at("predicted_memory_bytes").get_to(plan.predicted_memory_bytes);
    json.at("repair").get_to(report.repair);
    json.at("filled_share").get_to(report.filled_share);
    json.at("notes").get_to(report.notes);
  } catch (const Json::exception&) {
    return false;
  }
  return true;
}

bool AssetCache::open(const CacheKey& key, Asset& asset, BakeReport& report) const {
  Asset entry;
  BakeReport read;
  // Marks the entry as used before it is read, so that another process does not remove it. May fail in a cache that
  // belongs to another user.
  static_cast<void>(::utimensat(AT_FDCWD, entry_file(folder_, key, kAssetEnding).c_str(), nullptr, 0));
  if (detail::open_entry(folder_, key, entry) != Status::ok || cache_key(record_of(entry)) != key) return false;
  if (!detail::read_report(folder_, key, read)) return false;
  asset = std::move(entry);
  report = std::move(read);
  return true;
}

std::string AssetCache::store(const std::optional<CacheKey>& key, std::span<const std::byte> asset,
                              const BakeReport& report) const {
  if (!key) return "the mesh refers to files that cannot be read";
  const fs::path entry = entry_file(folder_, *key, kAssetEnding);
  const fs::path report_file = entry_file(folder_, *key, kReportEnding);
  if (std::string reason = make_folders(folder_, entry); !reason.empty()) return reason;
  try {
    const std::string text = to_text(report);
    // A link in a folder that many may write must not lead to other files.
    write_whole(report_file, std::as_bytes(std::span(text)), Links::replace);
    write_whole(entry, asset, Links::replace);
    keep_small(*key, text.size() + asset.size());
  } catch (const WriteError& error) {
    std::error_code ignored;
    if (!fs::exists(entry, ignored)) fs::remove(report_file, ignored);  // a report alone only takes space
    // Without the advice, which is about outputs.
    const std::string reason = error.what();
    return reason.substr(0, reason.find(';'));
  }
  return {};
}

// Prunes the folder now and then. Scanning it after each entry would cost more than a small bake. Counting bytes in a
// file is not worth it, because processes on other machines add to the folder too. So each entry starts a scan with a
// probability in proportion to its size: on average one scan for 2 % of the limit added. The key serves as the random
// number.
void AssetCache::keep_small(const CacheKey& stored, std::uint64_t bytes) const {
  constexpr double kSlack = 0.02;
  if (max_bytes_ == 0) return;
  const double die = static_cast<double>(std::stoul(stored.digits.substr(24), nullptr, 16)) / 0x1p32;
  const double limit = static_cast<double>(max_bytes_);
  if (die * kSlack * limit >= static_cast<double>(bytes)) return;
  try {
    // Leaves room for entries that come before the next scan.
    prune_cache(folder_, static_cast<std::uint64_t>((1 - kSlack) * limit));
  } catch (const fs::filesystem_error&) {
    // Nothing can be removed from a folder that cannot be read. The entry is stored anyway.
  }
}

}  // namespace vps::bake
