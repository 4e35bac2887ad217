// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/bake_options.h"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "bake/plan.h"
#include "cli/terminal/options.h"
#include "cli/terminal/units.h"

namespace vps::cli {
namespace {

// @throw UsageError
void check(const bake::BakeOptions& options) {
  try {
    bake::check_options(options);
  } catch (const bake::BakeError& error) {
    throw UsageError(error.what());
  }
}

void add_error_option(CLI::App& app, BakeArguments& arguments) {
  add_text_option(
      app, "--max-error", [&](const std::string& text) { arguments.max_error = parse_length(text); },
      "The largest voxel whose measured field error stays below this, such as 0.2mm; `recommend` counts what lies "
      "between points as well")
      ->excludes(app.get_option("--voxel"), app.get_option("--resolution"))
      ->option_text("LENGTH")
      ->group(kGridGroup);
}

void add_content_options(CLI::App& app, BakeArguments& arguments) {
  constexpr const char* kGroup = "Contents of the asset";
  // A number out of its range is refused here: in a batch before any mesh is read.
  const auto add_number = [&](const char* name, double bake::BakeOptions::*option,
                              std::function<double(const std::string&)> parse, const char* description) {
    const auto take = [&options = arguments.options, option, parse = std::move(parse)](const std::string& text) {
      options.*option = parse(text);
      check(options);
    };
    return add_text_option(app, name, take, description)->group(kGroup);
  };
  const auto voxels = [](const std::string& text) { return parse_voxels(text, "2.5vx"); };
  add_number("--band-inside", &bake::BakeOptions::band_inside, voxels,
             "Depth to which distances are kept, 2vx to 8vx [default: 2.5vx]")
      ->option_text("VOXELS");
  add_number("--band-outside", &bake::BakeOptions::band_outside, voxels,
             "Reach of the distances kept outside, 2vx to 8vx [default: 2.5vx]")
      ->option_text("VOXELS");
  add_number(
      "--field-error", &bake::BakeOptions::field_error,
      [](const std::string& text) { return parse_voxels(text, "0.1vx"); },
      "Largest error of interpolated distances, 0.01vx to 1vx [default: 0.1vx]")
      ->option_text("VOXELS");
  app.add_flag("--prove-bound", arguments.options.prove_bound,
               "Prove the bound of interpolated distances for every cell: 1.0 to 1.5 times the time")
      ->group(kGroup);
  app.add_option("--parts", arguments.parts, "Parts to bake: voxelmap,pointshell [default: both]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"voxelmap", "pointshell"}))
      ->option_text("LIST")
      ->group(kGroup);
  app.add_option("--fields", arguments.fields, "Fields of the voxelmap: layers,scaled,real [default: scaled]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"layers", "scaled", "real"}))
      ->option_text("LIST")
      ->group(kGroup);
  add_integer(app, "--precision", arguments.options.precision, 0, 15,
              "Scaled distances in steps of 10^-P m, no finer than 16 bits hold, 0 to 15 [default: a fiftieth of a "
              "voxel or finer]")
      ->option_text("P")
      ->group(kGroup);
  add_integer(app, "--branching", arguments.options.branching, 2, 64,
              "Children of a tree node, about, 2 to 64 [default: 14]")
      ->option_text("K")
      ->group(kGroup);
  add_number(
      "--alpha", &bake::BakeOptions::alpha, [](const std::string& text) { return parse_factor("--alpha", text); },
      "Spacing of the pointshell in voxels, 0.25 to 64 [default: 1.41]")
      ->option_text("X");
  add_number(
      "--thin-faces", &bake::BakeOptions::thin_faces,
      [](const std::string& text) { return parse_factor("--thin-faces", text); },
      "Space points inside flat faces up to X times as far, 1 to 4 [default: 1]")
      ->option_text("X");
}

}  // namespace

void add_bake_options(CLI::App& app, BakeArguments& arguments) {
  add_surface_options(app, arguments);
  add_import_options(app, arguments);
  add_grid_options(app, arguments);
  add_error_option(app, arguments);
  add_content_options(app, arguments);
}

void complete_bake_options(const CLI::App& app, BakeArguments& bake) {
  set_default_grid(bake);
  try {
    check(complete_options(bake));
  } catch (const UsageError& error) {
    throw CLI::ValidationError(error.what());
  }
  if (std::find(bake.parts.begin(), bake.parts.end(), "voxelmap") != bake.parts.end()) return;
  for (const char* const name : {"--fields", "--precision", "--field-error"}) {
    if (app.get_option(name)->count() > 0)
      throw CLI::ArgumentMismatch(std::string(name) + " needs the voxelmap among --parts");
  }
}

}  // namespace vps::cli
