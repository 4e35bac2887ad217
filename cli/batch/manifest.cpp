// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <span>

#include "cli/batch/reasons.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/output_file.h"
#include "formats/scene_manifest.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Whether a record has the settings of a job. The mesh is not compared.
bool has_settings_of(const bake::BakeRecord& record, const Job& job) {
  return record.text.starts_with(bake::describe_settings(job.settings));
}

// Null when the asset is missing or has other settings.
Json item_of(const fs::path& folder, const Job& job, Checking checking) {
  Asset asset;
  // Reads only the header, which has the hashes of the rest. The bake compared them.
  if (!job.refusal.empty() || Asset::open(job.asset().c_str(), asset, Use{}) != Status::ok) return nullptr;
  if (checking == Checking::everything && asset.verify() != Status::ok) return nullptr;
  const bake::BakeRecord record = bake::record_of(asset);
  if (!has_settings_of(record, job)) return nullptr;
  const AssetInfo& info = asset.info();
  return {{"asset", job.output},
          {"mesh", path_from(job.mesh, folder)},
          {"key", bake::cache_key(record).digits},
          {"bytes", asset.bytes().size()},
          {"xxh3_64", scene_manifest::asset_key(asset.bytes())},
          {"voxel_size", info.voxel_size},
          {"voxelmap", info.dims[0] > 0},
          {"pointshell", info.points > 0},
          {"bounds_min", info.bounds_min},
          {"bounds_max", info.bounds_max},
          {"volume", info.volume}};
}

}  // namespace

Manifest gather_manifest(const fs::path& folder, const std::vector<Job>& jobs, Checking checking) {
  Manifest out;
  Json assets = Json::array();
  for (const Job& job : jobs) {
    Json item = item_of(folder, job, checking);
    if (item.is_null()) {
      out.missing.push_back(job.output);
    } else {
      assets.push_back(std::move(item));
    }
  }
  out.json = {{"format", "vpsbake batch manifest 1"}, {"assets", std::move(assets)}, {"missing", out.missing}};
  return out;
}

std::string manifest_refusal(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder / kManifest, ignored)) return "";
  return output_refusal(folder / kManifest, "{\n  \"format\": \"vpsbake batch manifest", "a manifest of vpsbake batch");
}

void write_manifest(const fs::path& folder, const Manifest& manifest) {
  const std::string text = to_text(manifest.json);
  const fs::path file = folder / kManifest;
  if (read_text(file) == text && ::utimensat(AT_FDCWD, file.c_str(), nullptr, 0) == 0) return;
  std::error_code failed;
  fs::create_directories(folder, failed);
  write_whole(file, std::as_bytes(std::span(text)));
}

std::vector<std::string> left_over(const fs::path& folder, const std::vector<Job>& jobs) {
  std::set<std::string> made;
  std::vector<std::string> unknown;  // folders that could not be read
  for (const Job& job : jobs) {
    made.insert(job.output);
    if (!job.output.ends_with(".vps.hdf")) unknown.push_back(job.output == "." ? "" : job.output);
  }
  const auto is_known = [&](const std::string& name) {
    return std::none_of(unknown.begin(), unknown.end(), [&](const auto& one) { return name.starts_with(one); });
  };
  std::vector<std::string> out;
  const Json json = Json::parse(read_text(folder / kManifest), nullptr, false);
  if (!json.is_object() || !json.contains("assets") || !json["assets"].is_array()) return out;
  for (const Json& item : json["assets"]) {
    if (!item.is_object() || !item.contains("asset") || !item["asset"].is_string()) continue;
    const std::string name = item["asset"];
    std::error_code ignored;
    if (made.count(name) == 0 && is_known(name) && fs::exists(folder / name, ignored)) out.push_back(name);
  }
  return out;
}

}  // namespace vps::cli::batch
