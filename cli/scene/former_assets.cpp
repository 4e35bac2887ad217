// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/former_assets.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "cli/tools/output_file.h"
#include "formats/scene_manifest.h"

namespace vps::cli {

namespace fs = std::filesystem;

std::set<std::string> assets_of(const fs::path& manifest) {
  std::set<std::string> names;
  std::error_code failed;
  if (fs::file_size(manifest, failed) > scene_manifest::kMostBytes || failed) return names;
  std::ifstream file(manifest, std::ios::binary);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object() || !json.contains("format") || json["format"] != "vps-scene") return names;
  const auto assets = json.find("assets");
  if (assets == json.end() || !assets->is_array()) return names;
  for (const auto& asset : *assets) {
    const auto name = asset.is_object() ? asset.find("file") : asset.end();
    if (name == asset.end() || !name->is_string()) continue;
    const fs::path path = fs::path(name->get<std::string>()).lexically_normal();
    if (path.filename() == path) names.insert(path);
  }
  return names;
}

std::vector<std::string> remove_unlisted(const fs::path& folder, const std::set<std::string>& former) {
  std::vector<std::string> removed;
  if (former.empty()) return removed;
  std::set<std::string> listed;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    if (entry->path().filename().string().ends_with(".vps.json")) listed.merge(assets_of(entry->path()));
  }
  if (failed) return removed;  // manifests that were not read may list them
  for (const std::string& name : former) {
    const fs::path file = folder / name;
    const bool is_asset = fs::is_regular_file(file, failed) && asset_refusal(file).empty();
    if (is_asset && listed.count(name) == 0 && fs::remove(file, failed)) removed.push_back(name);
  }
  return removed;
}

}  // namespace vps::cli
