// SPDX-License-Identifier: GPL-3.0-or-later
// Opens an asset as a simulation would, checks its hashes too, and prints it.
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "bake/quantity_text.h"
#include "bake/store/cache.h"
#include "cli/batch/reasons.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/face_jumps.h"
#include "cli/tools/stored_field.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

void print_info(const std::string& path, const Asset& asset) {
  const Directory& directory = asset.directory();
  const std::string generator = printable(directory.info.generator.data());
  print_lines("{}: format {}.{}, {}, {}\n", one_line(path), directory.major, directory.minor,
              bake::format_bytes(static_cast<double>(directory.file_bytes)), generator);
  print_lines("{}", info_to_text(directory.info));
  for (const auto& [field, jump] : face_jumps(asset)) {
    print_lines("faces       V of {} jumps by {} at most between field bricks, at ({:.4g}, {:.4g}, {:.4g}) m\n",
                field_name(field), bake::format_length(jump.largest), jump.place[0], jump.place[1], jump.place[2]);
  }
  if (const bake::BakeRecord record = bake::record_of(asset); !record.text.empty()) {
    print_lines("baked from\n");
    for (const std::string& line : batch::readable_settings(record)) print_lines("  {}\n", printable(line));
  }
  print_lines("sections\n");
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    const Section& section = directory.sections[i];
    std::string shape;
    for (std::uint32_t axis = 0; axis < section.rank; ++axis) {
      shape += fmt::format("{}{}", axis == 0 ? "" : " x ", section.shape[axis]);
    }
    print_lines("  {:<21} {:<4} {:<22} at {:>9}, {:>9} bytes\n", section_name(section.kind),
                element_name(section.element), shape, section.offset, section.bytes);
  }
}

}  // namespace

Command add_info_command(CLI::App& app) {
  CLI::App* const info = app.add_subcommand("info", "Check an asset and print what it holds");
  struct InfoArguments {
    std::vector<std::string> paths;
    bool json = false;
  };
  const auto arguments = std::make_shared<InfoArguments>();
  info->add_option("ASSET...", arguments->paths, "Assets")->required();
  info->add_flag("--json", arguments->json, "Print JSON, of several files a list");
  info->footer("Example: vpsbake info gear.vps.hdf");
  return {info, [arguments] {
            auto list = nlohmann::ordered_json::array();
            int code = kOk;
            for (const std::string& path : arguments->paths) {
              Asset asset;
              std::string reason;
              if (const int one = open_asset(path, asset, &reason); one != kOk) {
                code = arguments->paths.size() > 1 ? int{kSomeFailed} : one;
                if (arguments->paths.size() > 1) list.push_back({{"file", path}, {"error", reason}});
              } else if (arguments->json) {
                list.push_back(asset_to_json(path, asset));
              } else {
                print_info(path, asset);
              }
            }
            if (arguments->paths.size() > 1 && arguments->json) {
              fmt::print("{}", to_text(list));
            } else if (!list.empty()) {
              fmt::print("{}", to_text(list[0]));
            }
            return code;
          }};
}

}  // namespace vps::cli
