// SPDX-License-Identifier: GPL-3.0-or-later
// The command line: options to structs, one file per command.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "cli/bake_command.h"
#include "cli/exit_code.h"
#include "cli/info_command.h"
#include "version.h"

namespace vps::cli {
namespace {

// "5mm" to 0.005. CLI11's AsNumberWithUnit would do, but its errors do not say what to write instead.
double parse_length(const std::string& text) {
  static const std::map<std::string, double> kUnits = {{"km", 1e3},  {"m", 1},     {"cm", 1e-2},
                                                       {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}};
  std::size_t used = 0;
  double number = 0;
  try {
    number = std::stod(text, &used);
  } catch (const std::exception&) {
    throw CLI::ValidationError(text + " is not a length; write a number with a unit, such as 5mm");
  }
  const std::string unit = CLI::detail::trim_copy(text.substr(used));
  const auto it = kUnits.find(unit);
  if (unit.empty()) throw CLI::ValidationError("a length needs a unit; write " + text + "mm or " + text + "m");
  if (it == kUnits.end()) throw CLI::ValidationError("unknown unit '" + unit + "'; use km, m, cm, mm, um or in");
  if (!(number > 0 && std::isfinite(number))) throw CLI::ValidationError(text + " is not a positive length");
  return number * it->second;
}

void add_bake_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("mesh", arguments.mesh, "Mesh to bake: obj, ply, stl, off, gltf, glb, dae, 3ds or fbx")->type_name("MESH");
  app.add_option("-o,--output", arguments.output, "Asset to write [default: beside the mesh, NAME.vps.hdf]")->type_name("FILE");

  auto* grid = app.add_option_group("Grid", "How fine: one of the two is needed");
  auto* voxel = grid->add_option_function<std::string>(
      "--voxel", [&](const std::string& text) { arguments.options.voxel_size = parse_length(text); },
      "Edge of a voxel, such as 5mm");
  voxel->type_name("LENGTH");
  grid->add_option("--resolution", arguments.options.resolution, "Voxels along the longest side")
      ->check(CLI::Range(1, 8192))
      ->excludes(voxel)
      ->type_name("N");
  app.add_option("--unit", arguments.unit, "Unit of the mesh's numbers: m, cm, mm or in [default: m]")
      ->transform(CLI::Transformer(std::map<std::string, double>{{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}},
                                   CLI::ignore_case))
      ->check(CLI::IsMember(std::set<double>{1, 0.01, 0.001, 0.0254}))
      ->type_name("UNIT");

  app.add_option("--scale", arguments.scale, "Enlarge the mesh by this factor")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->type_name("X");

  app.add_option("--parts", arguments.parts, "Parts to bake: voxelmap,pointshell [default: both]")
      ->delimiter(',')
      ->check(CLI::IsMember({"voxelmap", "pointshell"}))
      ->type_name("LIST");
  app.add_option("--fields", arguments.fields, "Fields of the voxelmap: layers,scaled,real [default: scaled]")
      ->delimiter(',')
      ->check(CLI::IsMember({"layers", "scaled", "real"}))
      ->type_name("LIST");
  app.add_option("--precision", arguments.options.precision,
                 "Decimal digits p of scaled distances in metres: steps of 10^-p m [default: s/50 or finer]")
      ->check(CLI::Range(0, 15))
      ->type_name("P");
  app.add_option("--branching", arguments.options.branching, "Children K of a tree node")
      ->check(CLI::Range(2, 64))
      ->capture_default_str()
      ->type_name("K");
  app.add_option("--memory", arguments.options.memory_limit_bytes, "Refuse to bake when more is needed, such as 4GB [default: 8GB]")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
  app.add_flag("--json", arguments.json, "Print the result as JSON");
}

int run(int argc, char** argv) {
  CLI::App app("Bakes triangle meshes into collision assets: signed distance voxelmaps and point-sphere trees.", "vpsbake");
  app.set_version_flag("--version", "vpsbake " VPSBAKE_VERSION);
  app.footer("Example: vpsbake bunny.obj --voxel 0.5mm\n"
             "Exit codes: 0 ok, 1 command line, 2 I/O, 3 bad input, 4 internal, 5 some items of a batch failed");
  BakeArguments bake;
  add_bake_options(app, bake);
  std::string asset;
  bool json = false;
  CLI::App* info = app.add_subcommand("info", "Check an asset and print what it holds");
  info->add_option("file", asset, "Asset")->required()->type_name("FILE");
  info->add_flag("--json", json, "Print JSON");

  try {
    app.parse(argc, argv);
    if (!info->parsed()) {
      if (bake.mesh.empty()) throw CLI::RequiredError("a mesh");
      if (bake.options.voxel_size == 0 && bake.options.resolution == 0) throw CLI::RequiredError("--voxel or --resolution");
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

int main(int argc, char** argv) { return vps::cli::run(argc, argv); }
