// SPDX-License-Identifier: GPL-3.0-or-later
// Opens an asset as a simulation would, checks its hashes too, and prints it.
#include "cli/info_command.h"

#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <memory>

#include "bake/plan.h"
#include "cli/describe_asset.h"
#include "cli/exit_code.h"
#include "cli/open_asset.h"

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

Command add_info_command(CLI::App& app) {
  CLI::App* const info = app.add_subcommand("info", "Check an asset and print what it holds");
  struct Arguments {
    std::string path;
    bool json = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  info->add_option("file", arguments->path, "Asset")->required()->option_text("ASSET");
  info->add_flag("--json", arguments->json, "Print JSON");
  info->footer("Example: vpsbake info gear.vps.hdf");
  return {info, [arguments] {
            Asset asset;
            if (const int code = open_asset(arguments->path, asset); code != kOk) return code;
            arguments->json ? print_json(arguments->path, asset.directory())
                            : print_text(arguments->path, asset.directory());
            return int{kOk};
          }};
}

}  // namespace vps::cli
