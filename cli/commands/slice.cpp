// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "bake/quantity_text.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/output_file.h"
#include "cli/tools/slice/slice_picture.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

struct SliceArguments {
  std::string asset;
  std::string output;
  std::string axis = "z";
  std::string field;         ///< empty: the finest stored
  std::optional<double> at;  ///< none: the middle of the body. [m]
  int width = 900;           ///< of the picture. [px]
};

int run_slice(const SliceArguments& arguments) {
  Asset asset;
  if (const int code = open_asset(arguments.asset, asset); code != kOk) return code;
  VoxelmapView map;
  if (!asset.has_voxelmap())
    return fail(kBadInput, arguments.asset, "it has no voxelmap; bake it with --parts voxelmap");
  if (asset.voxelmap(map, field_of(arguments.field)) != Status::ok) return fail_field(arguments.asset, arguments.field);
  const AssetInfo& info = asset.info();
  const auto axis = static_cast<std::size_t>(arguments.axis[0] - 'x');
  const SliceRange range = slice_range(info, axis);
  const double at = arguments.at.value_or(range.middle);
  if (!(at >= range.low && at <= range.high)) {
    const LengthUnit unit(std::max(std::abs(range.low), std::abs(range.high)));
    return fail(kBadInput, arguments.asset,
                fmt::format("--at {0}{3} lies beyond the field; choose {4} from {1}{3} to {2}{3}", unit.number(at),
                            unit.number(range.low), unit.number(range.high), unit.name(), arguments.axis));
  }
  const std::filesystem::path output = arguments.output.empty()
                                           ? beside(arguments.asset, ("_" + arguments.axis + ".png").c_str())
                                           : std::filesystem::path(arguments.output);
  if (const std::string reason = output_refusal(output, "\x89PNG\r\n", "a PNG picture"); !reason.empty())
    return fail(kIo, output.string(), reason);
  const SlicePicture slice = draw_slice(info, map, {asset_name(arguments.asset), axis, at, arguments.width});
  const int code = write_output(output, slice.picture.png());
  if (code == kOk) {
    print_lines(messages_beside(output), "field {} at {}, asset frame; a pixel is {}, a colour one voxel of {}\n",
                field_name(map.field), slice.place, bake::format_length(slice.pixel),
                bake::format_length(info.voxel_size));
    if (!slice.no_line.empty()) complain("note", output.string(), slice.no_line);
  }
  return code;
}

}  // namespace

Command add_slice_command(CLI::App& app) {
  CLI::App* const slice = app.add_subcommand("slice", "Draw a slice of an asset's field as a PNG picture");
  const auto arguments = std::make_shared<SliceArguments>();
  slice->add_option("ASSET", arguments->asset, "Asset")->required();
  slice->add_option("--axis", arguments->axis, "Across which axis of the asset: x, y or z [default: z]")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->option_text("AXIS");
  add_text_option(
      *slice, "--at", [arguments](const std::string& text) { arguments->at = parse_coordinate(text); },
      "Where on that axis, such as 12mm or -0.5in [default: the middle of the body]")
      ->option_text("LENGTH");
  slice->add_option("--field", arguments->field, "Field: layers, scaled or real [default: the finest stored]")
      ->check(CLI::IsMember({"layers", "scaled", "real"}))
      ->option_text("FIELD");
  add_integer(*slice, "--width", arguments->width, 600, 8000,
              "Width of the picture in pixels, 600 to 8000 [default: 900]")
      ->option_text("PIXELS");
  slice->add_option("-o,--output", arguments->output, "PNG picture to write [default: NAME_AXIS.png beside the asset]")
      ->check(not_empty())
      ->option_text("FILE");
  slice->footer("Example: vpsbake slice gear.vps.hdf --axis z --at 12mm");
  return {slice, [arguments] { return guarded(arguments->asset, [&] { return run_slice(*arguments); }); }};
}

}  // namespace vps::cli
