// SPDX-License-Identifier: GPL-3.0-or-later
// Opens an asset as a simulation would, checks its hashes too, and prints it.
#include "cli/info_command.h"

#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <filesystem>

#include "bake/plan.h"
#include "cli/describe_asset.h"
#include "cli/exit_code.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {
namespace {

nlohmann::ordered_json section_to_json(const Section& section) {
  return {{"name", section_name(section.kind)},
          {"kind", static_cast<std::uint32_t>(section.kind)},
          {"type", element_name(section.element)},
          {"shape", std::vector<std::uint64_t>(section.shape.begin(), section.shape.begin() + section.rank)},
          {"offset", section.offset},
          {"bytes", section.bytes},
          {"xxh3_64", fmt::format("{:016x}", section.hash)}};
}

void print_json(const std::string& path, const Directory& directory) {
  nlohmann::ordered_json j;
  j["file"] = path;
  j["format"] = fmt::format("{}.{}", directory.major, directory.minor);
  j["bytes"] = directory.file_bytes;
  j.update(info_to_json(directory.info));
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    j["sections"].push_back(section_to_json(directory.sections[i]));
  }
  fmt::print("{}", to_text(j));
}

void print_text(const std::string& path, const Directory& directory) {
  std::string generator = directory.info.generator.data();
  // Of a forged file it may be anything.
  for (char& c : generator) c = std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  fmt::print("{}: format {}.{}, {}, {}\n", path, directory.major, directory.minor,
             format_bytes(static_cast<double>(directory.file_bytes)), generator);
  fmt::print("{}", info_to_text(directory.info));
  fmt::print("sections\n");
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    const Section& section = directory.sections[i];
    std::string shape;
    for (std::uint32_t axis = 0; axis < section.rank; ++axis) {
      shape += fmt::format("{}{}", axis == 0 ? "" : " x ", section.shape[axis]);
    }
    fmt::print("  {:<21} {:<4} {:<22} at {:>9}, {:>9} bytes\n", section_name(section.kind),
               element_name(section.element), shape, section.offset, section.bytes);
  }
}

}  // namespace

int run_info(const std::string& path, bool json) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return fail(kIo, path, "this is a folder; give a .vps.hdf file");
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) {
    return fail(kIo, path, "this is not a regular file; give a .vps.hdf file");
  }
  Asset asset;
  Status status = Asset::open(path.c_str(), asset);
  if (status == Status::cannot_open || status == Status::cannot_map) return fail(kIo, path, describe(status));
  if (status == Status::ok) status = asset.verify();
  if (status != Status::ok) return fail(kBadInput, path, describe(status));
  json ? print_json(path, asset.directory()) : print_text(path, asset.directory());
  return kOk;
}

}  // namespace vps::cli
