// SPDX-License-Identifier: GPL-3.0-or-later
// Entries of a cache folder: found, checked, added.
#include "bake/cache.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>

namespace vps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kAsset = ".vps.hdf";
constexpr const char* kReport = ".json";

std::string hash_line(const std::string& text) {
  return fmt::format("{:016x}\n", hash_bytes(std::as_bytes(std::span(text))));
}

// JSON behind a line with its hash.
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

bool read_report(const fs::path& path, BakeReport& report) {
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

}  // namespace

bool AssetCache::open(const CacheKey& key, Asset& asset, BakeReport& report) const {
  Asset entry;
  BakeReport read;
  if (Asset::open(file(key, kAsset).c_str(), entry) != Status::ok || entry.verify() != Status::ok) return false;
  if (!read_report(file(key, kReport), read)) return false;
  asset = std::move(entry);
  report = std::move(read);
  return true;
}

std::string AssetCache::store(const std::optional<CacheKey>& key, const BakedAsset& baked,
                              const BakeReport& report) const {
  if (!key) return "the mesh changed while it was read, or refers to files that are not found";
  std::error_code failed;
  fs::create_directories(folder_, failed);
  if (failed) return "the folder cannot be made (" + failed.message() + ")";
  try {
    const std::string text = to_text(report);
    write_whole(file(*key, kReport), std::as_bytes(std::span(text)));
    write_asset(file(*key, kAsset), baked.info, baked.sections);
  } catch (const WriteError& error) {
    // Without the advice: it is about outputs.
    const std::string reason = error.what();
    return reason.substr(0, reason.find(';'));
  }
  return {};
}

}  // namespace vps
