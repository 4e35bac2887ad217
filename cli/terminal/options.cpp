// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/options.h"

#include <cstdlib>
#include <string_view>

namespace vps::cli {
namespace {

bake::Repair parse_repair(const std::string& text) {
  for (const bake::Repair repair :
       {bake::Repair::none, bake::Repair::weld, bake::Repair::stitch, bake::Repair::fill, bake::Repair::wrap}) {
    if (text == describe(repair)) return repair;
  }
  throw UsageError("--repair takes none, weld, stitch, fill or wrap, not '" + text + "'");
}

}  // namespace

CLI::Option* add_text_option(CLI::App& app, const char* name, std::function<void(const std::string&)> take,
                             const char* description) {
  const auto checked = [name, take = std::move(take)](const std::string& text) {
    try {
      take(text);
    } catch (const UsageError& error) {
      const std::string reason = error.what();
      throw CLI::ValidationError(reason.starts_with("--") ? reason : std::string(name) + ": " + reason);
    }
  };
  return app.add_option_function<std::string>(name, checked, description);
}

CLI::Validator not_empty() {
  return {[](std::string& name) { return std::string(name.empty() ? "is empty" : ""); }, ""};
}

void add_verbosity_options(CLI::App& app, Verbosity& verbosity, const char* quiet, const char* verbose) {
  auto* const less = app.add_flag_callback(
                            "-q,--quiet", [&] { verbosity = Verbosity::quiet; }, quiet)
                         ->group("Output");
  if (verbose == nullptr) return;
  app.add_flag_callback(
         "-v,--verbose", [&] { verbosity = Verbosity::verbose; }, verbose)
      ->excludes(less)
      ->group("Output");
}

CLI::Validator not_stream() {
  return {[](std::string& name) {
            return std::string(name.empty() ? "is empty" : name == "-" ? "takes a name, not -" : "");
          },
          ""};
}

void add_unit_options(CLI::App& app, BakeArguments& arguments) {
  add_text_option(
      app, "--unit", [&](const std::string& unit) { arguments.unit = parse_unit(unit); },
      "Unit of the mesh's numbers: m, cm, mm or in [default: m, with a warning where it is unlikely]")
      ->option_text("UNIT")
      ->type_name("{m,cm,mm,in}")
      ->group("Mesh");
  add_text_option(
      app, "--scale", [&](const std::string& text) { arguments.scale = parse_factor("--scale", text); },
      "Enlarge the mesh by this factor, above 0 [default: 1]")
      ->option_text("X")
      ->group("Mesh");
}

CLI::Option* add_mesh_options(CLI::App& app, BakeArguments& arguments) {
  auto* const mesh = app.add_option("MESH", arguments.mesh, kMeshHelp);
  add_surface_options(app, arguments);
  return mesh;
}

void add_surface_options(CLI::App& app, BakeArguments& arguments) {
  add_unit_options(app, arguments);
  add_text_option(
      app, "--repair", [&](const std::string& text) { arguments.options.repair = parse_repair(text); },
      "How far to go to close the mesh: none, weld, stitch, fill or wrap [default: the least invasive that works; "
      "refused where the mesh may be solid or hollow]")
      ->option_text("HOW")
      ->type_name("{none,weld,stitch,fill,wrap}")
      ->group("Mesh");
  add_text_option(
      app, "--open-surface",
      [&](const std::string& text) {
        constexpr std::string_view kThicken = "thicken=";
        if (!text.starts_with(kThicken)) throw UsageError("--open-surface takes thicken=2mm");
        arguments.options.sheet_thickness = parse_length(text.substr(kThicken.size()));
      },
      "Bake open surfaces as solids of this thickness, such as thicken=2mm [default: they are refused]")
      ->option_text("thicken=LENGTH")
      ->group("Mesh");
}

void add_import_options(CLI::App& app, BakeArguments& arguments) {
  add_text_option(
      app, "--import-memory",
      [&](const std::string& text) { arguments.import_options.memory_limit_bytes = parse_size(text); },
      "Memory for reading the mesh, such as 8GB [default: 4GB]")
      ->option_text("SIZE")
      ->group("Import");
  add_text_option(
      app, "--import-timeout", [&](const std::string& text) { arguments.import_options.timeout = parse_time(text); },
      "Time for reading the mesh, such as 500ms, 120s or 10min [default: 120s]")
      ->option_text("TIME")
      ->group("Import");
}

void add_format_option(CLI::App& app, BakeArguments& arguments) {
  app.add_option("--format", arguments.import_options.format,
                 "Format of the mesh, such as stl [default: the ending of its name; for standard input, its content "
                 "shows it]")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kMeshFormats), std::end(kMeshFormats))))
      ->option_text("FORMAT")
      ->group("Import");
}

void add_grid_options(CLI::App& app, BakeArguments& arguments) {
  auto* const voxel = add_text_option(
      app, "--voxel", [&](const std::string& text) { arguments.options.voxel_size = parse_length(text); },
      "Edge of a voxel, such as 5mm");
  voxel->option_text("LENGTH")->group(kGridGroup);
  add_integer(app, "--resolution", arguments.options.resolution, 1, 8192, "Voxels along the longest side, 1 to 8192")
      ->excludes(voxel)
      ->option_text("N")
      ->group(kGridGroup);
}

void set_default_grid(BakeArguments& arguments) {
  constexpr std::uint32_t kResolution = 200;
  bake::BakeOptions& options = arguments.options;
  arguments.default_grid = options.voxel_size == 0 && options.resolution == 0 && arguments.max_error == 0;
  if (arguments.default_grid) options.resolution = kResolution;
}

void add_cache_options(CLI::App& app, std::string& folder, std::size_t& bytes, const char* group) {
  if (const char* const name = std::getenv("VPSBAKE_CACHE")) folder = name;  // options override it
  auto* const cache = app.add_option("--cache", folder,
                                     "Take what was baked before from this folder, and keep there what is new "
                                     "[default: the environment's VPSBAKE_CACHE, or none]");
  cache->check(not_stream())->option_text("DIR")->group(group);
  add_text_option(
      app, "--cache-size", [&bytes](const std::string& text) { bytes = parse_size(text); },
      "Remove what was used least recently from that folder when it grows larger, such as 20GB [default: the "
      "environment's VPSBAKE_CACHE_SIZE, or no limit]")
      ->option_text("SIZE")
      ->group(group);
  app.add_flag_callback(
         "--no-cache", [&folder] { folder.clear(); }, "Bake without a cache, whatever VPSBAKE_CACHE says")
      ->excludes(cache)
      ->group(group);
}

void read_cache_size(const CLI::App& app, std::size_t& bytes) {
  const char* const text = std::getenv("VPSBAKE_CACHE_SIZE");
  if (text == nullptr || *text == '\0' || app.get_option("--cache-size")->count() > 0) return;
  try {
    bytes = parse_size(text);
  } catch (const UsageError& error) {
    throw CLI::ValidationError("VPSBAKE_CACHE_SIZE: " + std::string(error.what()));
  }
}

}  // namespace vps::cli
