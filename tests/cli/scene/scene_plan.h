// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Plans scenes with the program.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli/program.h"

namespace vps::test {

using Json = nlohmann::json;

/// One [[body]] with a sample mesh.
inline std::string body(const std::string& name, const char* mesh, const std::string& rest) {
  return "[[body]]\nname = \"" + name + "\"\nmesh = \"" + sample(mesh) + "\"\n" + rest + "\n";
}

inline constexpr const char* kPlane = "[[body]]\nname = \"ground\"\nshape = \"plane\"\ntype = \"static\"\n";

/// The report of `vpsbake scene --json` on a TOML file.
inline Json plan(const TemporaryFolder& folder, const std::string& text, const std::string& options = "--dry-run") {
  write_file(folder / "scene.toml", text);
  const Outcome run = vpsbake(folder, "scene scene.toml --json " + options);
  EXPECT_EQ(run.code, 0) << run.err;
  return run.code == 0 ? Json::parse(run.out) : Json();
}

inline std::filesystem::path asset_at(const TemporaryFolder& folder, const char* output, const Json& report,
                                      std::size_t number) {
  return std::filesystem::path(folder / output) / report["assets"][number]["file"].get<std::string>();
}

// Exit codes.
inline constexpr int kMissing = 2;
inline constexpr int kBad = 3;

}  // namespace vps::test
