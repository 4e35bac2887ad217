// SPDX-License-Identifier: GPL-3.0-or-later
// The command line: options to structs, one file per command.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "cli/bake_command.h"
#include "cli/exit_code.h"
#include "cli/info_command.h"
#include "version.h"

namespace vps::cli {
namespace {

// Units are named in every message, for a wrong one is the commonest mistake.
double unit_size(const std::string& unit, const std::map<std::string, double>& units) {
  const auto it = units.find(unit);
  if (it != units.end()) return it->second;
  std::string names;
  for (const auto& [name, size] : units) names += (names.empty() ? "" : ", ") + name;
  throw CLI::ValidationError("unknown unit '" + unit + "'; use one of " + names);
}

// A quantity on the command line: a positive number with a unit.
struct Quantity {
  const char* kind;     // "a length"
  const char* example;  // "5mm"
  std::vector<const char*> usual;
  std::map<std::string, double> units;
};

// "5mm" to 0.005. CLI11's AsNumberWithUnit would do, but its errors do not say what to write instead.
double parse(const std::string& text, const Quantity& quantity) {
  const std::string kind = quantity.kind;
  std::size_t used = 0;
  double number = 0;
  try {
    number = std::stod(text, &used);
  } catch (const std::exception&) {
    throw CLI::ValidationError(text + " is not " + kind + "; write a number with a unit, such as " + quantity.example);
  }
  const std::string unit = CLI::detail::trim_copy(text.substr(used));
  if (unit.empty()) {
    std::string forms;
    for (const char* const usual : quantity.usual) forms += (forms.empty() ? "" : " or ") + text + usual;
    throw CLI::ValidationError(kind + " needs a unit; write " + forms);
  }
  const double size = unit_size(unit, quantity.units);
  if (!(number > 0 && std::isfinite(number))) throw CLI::ValidationError(text + " is not a positive " + kind.substr(2));
  return number * size;
}

std::map<std::string, Repair> repair_names() {
  return {{"none", Repair::none},
          {"weld", Repair::weld},
          {"stitch", Repair::stitch},
          {"fill", Repair::fill},
          {"wrap", Repair::wrap}};
}

double parse_length(const std::string& text) {
  return parse(text, {"a length",
                      "5mm",
                      {"mm", "m"},
                      {{"km", 1e3}, {"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}}});
}

double parse_time(const std::string& text) {
  return parse(text, {"a time", "120s", {"s", "min"}, {{"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}}});
}

void add_mesh_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("mesh", arguments.mesh, "Mesh to bake: obj, ply, stl, off, gltf, glb, dae, 3ds or fbx")
      ->option_text("MESH");
  app.add_option_function<std::string>(
         "--unit",
         [&](const std::string& unit) {
           arguments.unit = unit_size(unit, {{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}});
         },
         "Unit of the mesh's numbers: m, cm, mm or in [default: m]")
      ->option_text("UNIT")
      ->group("Mesh");
  app.add_option("--scale", arguments.scale, "Enlarge the mesh by this factor [default: 1]")
      ->check(CLI::PositiveNumber)
      ->option_text("X")
      ->group("Mesh");
  app.add_option("--repair", arguments.options.repair,
                 "How far to go to close the mesh: none, weld, stitch, fill or wrap [default: the mildest that "
                 "suffices; holes wider than a voxel are refused]")
      ->transform(CLI::Transformer(repair_names()))
      ->option_text("HOW")
      ->group("Mesh");
  app.add_option_function<std::string>(
         "--open-surface",
         [&](const std::string& text) {
           constexpr std::string_view kThicken = "thicken=";
           if (!text.starts_with(kThicken)) throw CLI::ValidationError("--open-surface takes thicken=2mm");
           arguments.options.sheet_thickness = parse_length(text.substr(kThicken.size()));
         },
         "Bake open surfaces as solids of this thickness")
      ->option_text("thicken=LENGTH")
      ->group("Mesh");
}

void add_import_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("--import-memory", arguments.import_options.memory_limit_bytes,
                 "Memory for reading the mesh, such as 8GB [default: 4GB]")
      ->transform(CLI::AsSizeValue(true))
      ->check(CLI::PositiveNumber)
      ->option_text("SIZE")
      ->group("Import");
  app.add_option_function<std::string>(
         "--import-timeout", [&](const std::string& text) { arguments.import_options.timeout = parse_time(text); },
         "Time for reading the mesh, such as 500ms, 120s or 10min [default: 120s]")
      ->option_text("SECONDS")
      ->group("Import");
}

void add_grid_options(CLI::App& app, BakeArguments& arguments) {
  auto* const voxel = app.add_option_function<std::string>(
      "--voxel", [&](const std::string& text) { arguments.options.voxel_size = parse_length(text); },
      "Edge of a voxel, such as 5mm");
  voxel->option_text("LENGTH")->group("Grid (one of the two is needed)");
  app.add_option("--resolution", arguments.options.resolution, "Voxels along the longest side, 1 to 8192")
      ->check(CLI::Range(1, 8192))
      ->excludes(voxel)
      ->option_text("N")
      ->group("Grid (one of the two is needed)");
}

void add_content_options(CLI::App& app, BakeArguments& arguments) {
  constexpr const char* kGroup = "Contents of the asset";
  app.add_option("--parts", arguments.parts, "Parts to bake: voxelmap,pointshell [default: both]")
      ->delimiter(',')
      ->check(CLI::IsMember({"voxelmap", "pointshell"}))
      ->option_text("LIST")
      ->group(kGroup);
  app.add_option("--fields", arguments.fields, "Fields of the voxelmap: layers,scaled,real [default: scaled]")
      ->delimiter(',')
      ->check(CLI::IsMember({"layers", "scaled", "real"}))
      ->option_text("LIST")
      ->group(kGroup);
  app.add_option("--precision", arguments.options.precision,
                 "Scaled distances in steps of 10^-P m, 0 to 15 [default: a fiftieth of a voxel or finer]")
      ->check(CLI::Range(0, 15))
      ->option_text("P")
      ->group(kGroup);
  app.add_option("--branching", arguments.options.branching, "Children of a tree node, 2 to 64 [default: 8]")
      ->check(CLI::Range(2, 64))
      ->option_text("K")
      ->group(kGroup);
}

void add_output_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("-o,--output", arguments.output, "Asset to write [default: NAME.vps.hdf beside the mesh]")
      ->option_text("FILE")
      ->group("Output");
  app.add_flag("--json", arguments.json, "Print the result as JSON")->group("Output");
  app.add_option("--memory", arguments.options.memory_limit_bytes,
                 "Refuse to bake when more is needed, such as 4GB [default: 8GB]")
      ->transform(CLI::AsSizeValue(true))
      ->option_text("SIZE")
      ->group("Output");
}

int run(int argc, char** argv) {
  CLI::App app("Bakes triangle meshes into collision assets: signed distance voxelmaps and point-sphere trees.",
               "vpsbake");
  app.set_version_flag("--version", "vpsbake " VPSBAKE_VERSION);
  app.footer(
      "Example: vpsbake bunny.obj --voxel 0.5mm\n"
      "Exit codes: 0 ok, 1 command line, 2 I/O, 3 bad input, 4 internal, 5 some items of a batch failed");
  BakeArguments bake;
  add_mesh_options(app, bake);
  add_import_options(app, bake);
  add_grid_options(app, bake);
  add_content_options(app, bake);
  add_output_options(app, bake);
  std::string asset;
  bool json = false;
  CLI::App* info = app.add_subcommand("info", "Check an asset and print what it holds");
  info->add_option("file", asset, "Asset")->required()->option_text("FILE");
  info->add_flag("--json", json, "Print JSON");

  try {
    app.parse(argc, argv);
    if (!info->parsed()) {
      if (bake.mesh.empty()) throw CLI::RequiredError("a mesh");
      if (bake.options.voxel_size == 0 && bake.options.resolution == 0)
        throw CLI::RequiredError("--voxel or --resolution");
    }
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "vpsbake: error: %s; run vpsbake --help\n", error.what());
    return kCommandLine;
  }
  return info->parsed() ? run_info(asset, json) : run_bake(bake);
}

}  // namespace
}  // namespace vps::cli

int main(int argc, char** argv) {
  return vps::cli::run(argc, argv);
}
