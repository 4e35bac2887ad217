// SPDX-License-Identifier: Zlib
// Reads a manifest's JSON.
#include "runtime/bullet/scene/manifest.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace vps::bullet::manifest {

namespace fs = std::filesystem;

Json read_json(const std::string& path) {
  std::error_code failed;
  if (!fs::is_regular_file(path, failed)) throw Refusal{"the manifest does not exist or is not a file"};
  if (fs::file_size(path, failed) > scene_manifest::kMostBytes || failed)
    throw Refusal{"the manifest is larger than 64 MiB"};
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw Refusal{"the manifest cannot be read"};
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) throw Refusal{"the manifest is not JSON"};
  return json;
}

}  // namespace vps::bullet::manifest
