// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A folder of meshes to bake, and the results that a batch reports.
#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/cli/program.h"

namespace vps::test {

/// A temporary folder with meshes/: cubes and pieces that bake in a tenth of a second.
class BatchFolder : public TemporaryFolder {
 public:
  void add(const std::string& name, const char* mesh = "cube") const {
    std::filesystem::create_directories((*this / ("meshes/" + name)).parent_path());
    std::filesystem::copy_file(sample(mesh), *this / ("meshes/" + name));
  }
  void add_text(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((*this / ("meshes/" + name)).parent_path());
    write_file(*this / ("meshes/" + name), text);
  }
  [[nodiscard]] std::string asset(const std::string& name) const { return read_file(*this / ("out/" + name)); }
};

struct BatchOutcome {
  int code = -1;
  std::string err;
  nlohmann::json json;
  /// State by asset, without the folder.
  std::map<std::string, std::string> states;
  /// Reasons and errors by asset, joined.
  std::map<std::string, std::string> said;
};

/// `vpsbake COMMAND --json`, with states of the assets below out/.
inline BatchOutcome run_batch(const BatchFolder& folder, const std::string& command, const std::string& cache = "") {
  const Outcome run = vpsbake(folder, command + " --json", cache);
  BatchOutcome out{run.code, run.err, nlohmann::json::parse(run.out, nullptr, false), {}, {}};
  if (!out.json.is_object()) return out;
  for (const auto& item : out.json["items"]) {
    std::string name = item["asset"];
    name.erase(0, name.find("out/") + 4);
    out.states[name] = item["state"];
    for (const auto& reason : item["reasons"]) out.said[name] += reason.get<std::string>() + "; ";
    if (item.contains("error")) out.said[name] += item["error"].get<std::string>();
  }
  return out;
}

/// The contents of all files below a folder, by relative path.
inline std::map<std::string, std::string> files_below(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[std::filesystem::relative(entry.path(), folder).string()] = read_file(entry.path());
  }
  return files;
}

using States = std::map<std::string, std::string>;

}  // namespace vps::test
