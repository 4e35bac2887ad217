// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <system_error>

#include "bake/quantity_text.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/export/export.h"
#include "cli/tools/output_file.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/stored_field.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

struct ExportArguments {
  std::string asset;
  std::string format;
  std::string output;
  std::string field;            ///< empty: the finest stored
  double step = 0;              ///< 0: a voxel. [m]
  std::optional<double> reach;  ///< of cdf; none: the band. [m]
};

// The group's name is in the root group's header, which follows the superblock.
bool holds_vtkhdf(std::string_view start) {
  return start.find("VTKHDF") != std::string_view::npos;
}

// A .cdf file starts with two corners, the numbers of cells, the cell size and its inverse. Checks that they agree.
bool starts_as_cdf(std::string_view start) {
  double corners[2][3], sizes[2][3];
  std::uint32_t cells[3];
  if (start.size() < sizeof corners + sizeof cells + sizeof sizes) return false;
  std::memcpy(corners, start.data(), sizeof corners);
  std::memcpy(cells, start.data() + sizeof corners, sizeof cells);
  std::memcpy(sizes, start.data() + sizeof corners + sizeof cells, sizeof sizes);
  for (int axis = 0; axis < 3; ++axis) {
    const double length = corners[1][axis] - corners[0][axis], off = length - cells[axis] * sizes[0][axis];
    if (!(std::abs(off) <= 1e-6 * length && std::abs(sizes[0][axis] * sizes[1][axis] - 1) < 1e-6)) return false;
  }
  return true;
}

struct Format {
  const char* name;
  const char* ending;          ///< of the default output
  std::string_view beginning;  ///< of such files; a file that begins otherwise is not overwritten
  const char* kind;
  bool of_field;                               ///< takes --field and --step
  bool (*is_own)(std::string_view) = nullptr;  ///< further test where the beginning does not suffice
};
constexpr Format kFormats[] = {
    {"vtkhdf", ".vtk.hdf", "\x89HDF\r\n\x1a\n", "a VTKHDF file", true, holds_vtkhdf},
    {"ply", "_points.ply", "ply\nformat binary_little_endian 1.0\ncomment vpsbake", "a pointshell of vpsbake", false},
    {"cdf", ".cdf", "", "a .cdf file", true, starts_as_cdf},
    {"obj", "_field.obj", "# vpsbake", "a surface of vpsbake", true},
    {"json", ".json", R"({"schema":"vpsbake asset)", "an asset's JSON", false},
};

const Format& format_of(const std::string& name) {
  for (const Format& format : kFormats) {
    if (name == format.name) return format;
  }
  throw std::logic_error("a format that is not in the list");
}

std::string refusal(const Format& format, const std::filesystem::path& output) {
  std::string reason = output_refusal(output, format.beginning, format.kind);
  std::error_code ignored;
  if (!reason.empty() || format.is_own == nullptr || !std::filesystem::exists(output, ignored)) return reason;
  std::string start(512, '\0');
  std::ifstream file(output, std::ios::binary);
  file.read(start.data(), std::streamsize(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  if (format.is_own(start)) return "";
  return fmt::format("the file exists and is not {}; remove it or choose another output", format.kind);
}

int write_format(const ExportArguments& arguments, const Asset& asset, const VoxelmapView& map,
                 const std::filesystem::path& output) {
  const double step = arguments.step > 0 ? arguments.step : asset.info().voxel_size;
  if (arguments.format == "ply") return write_output(output, to_ply(asset));
  if (arguments.format == "json") return write_output(output, to_json_text(arguments.asset, asset));
  if (!(step >= 0.25 * asset.info().voxel_size)) {
    throw ExportError(fmt::format("the field has no samples finer than a quarter of a voxel; choose --step {} or more",
                                  bake::format_length(0.25 * asset.info().voxel_size)));
  }
  if (arguments.format == "obj") return write_output(output, to_obj(map, step));
  if (arguments.format == "cdf")
    return write_output(output, to_cdf(map, {step, arguments.reach.value_or(asset.info().band_outer)}));
  const std::size_t bytes = write_vtkhdf_field(asset, map, step, output);
  print_lines("{}: {}\n", one_line(output.string()), bake::format_bytes(double(bytes)));
  return kOk;
}

int run_export(const ExportArguments& arguments) {
  Asset asset;
  if (const int code = open_asset(arguments.asset, asset); code != kOk) return code;
  const Format& format = format_of(arguments.format);
  VoxelmapView map;
  if (format.of_field) {
    if (!asset.has_voxelmap())
      return fail(kBadInput, arguments.asset, "it has no voxelmap; bake it with --parts voxelmap");
    if (asset.voxelmap(map, field_of(arguments.field)) != Status::ok)
      return fail_field(arguments.asset, arguments.field);
  }
  const std::filesystem::path output =
      arguments.output.empty() ? beside(arguments.asset, format.ending) : std::filesystem::path(arguments.output);
  if (const std::string reason = refusal(format, output); !reason.empty()) return fail(kIo, output.string(), reason);
  try {
    return write_format(arguments, asset, map, output);
  } catch (const ExportError& error) {
    return fail(kBadInput, arguments.asset, error.what());
  } catch (const WriteError& error) {
    return fail(kIo, output.string(), error.what());
  }
}

void check_options(const CLI::App& app, const ExportArguments& arguments) {
  if (arguments.format == "vtkhdf" && is_standard_stream(arguments.output.empty() ? arguments.asset : arguments.output))
    throw CLI::ArgumentMismatch("a VTKHDF file does not go to standard output; give -o FILE");
  if (arguments.reach && arguments.format != "cdf") throw CLI::ArgumentMismatch("--reach is for --to cdf");
  if (format_of(arguments.format).of_field) return;
  for (const char* const name : {"--field", "--step"}) {
    if (app.get_option(name)->count() > 0)
      throw CLI::ArgumentMismatch(std::string(name) + " is for --to vtkhdf, cdf and obj");
  }
}

}  // namespace

Command add_export_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("export", "Write an asset for other programs");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("ASSET", arguments->asset, "Asset")->required();
  command
      ->add_option("--to", arguments->format,
                   "vtkhdf: the field as a grid for ParaView and VTK; ply: the points; cdf: the field for Bullet's "
                   "btSdfCollisionShape and Discregrid; obj: the field's surface; json: scalars, points and tree")
      ->required()
      ->check(CLI::IsMember({"vtkhdf", "ply", "cdf", "obj", "json"}))
      ->option_text("FORMAT");
  command->add_option("--field", arguments->field, "Field: layers, scaled or real [default: the finest stored]")
      ->check(CLI::IsMember({"layers", "scaled", "real"}))
      ->option_text("FIELD");
  add_text_option(
      *command, "--step", [arguments](const std::string& text) { arguments->step = parse_length(text); },
      "Of vtkhdf between points, of cdf and obj edge of a cell, such as 2mm [default: a voxel]")
      ->option_text("LENGTH");
  add_text_option(
      *command, "--reach", [arguments](const std::string& text) { arguments->reach = parse_length(text); },
      "Of cdf how far outside distances go, no less than the radius of the largest sphere [default: the band]")
      ->option_text("LENGTH");
  command->add_option("-o,--output", arguments->output, "File to write [default: beside the asset]")
      ->check(not_empty())
      ->option_text("FILE");
  command->callback([command, arguments] { check_options(*command, *arguments); });
  command->footer("Example: vpsbake export gear.vps.hdf --to vtkhdf -o gear.vtkhdf");
  return {command, [arguments] { return guarded(arguments->asset, [&] { return run_export(*arguments); }); }};
}

}  // namespace vps::cli
