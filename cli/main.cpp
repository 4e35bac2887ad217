// SPDX-License-Identifier: GPL-3.0-or-later
// The command line: options to structs, one file per command.
#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <system_error>
#include <vector>

#include "cli/bake_command.h"
#include "cli/check_command.h"
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

Repair parse_repair(const std::string& text) {
  for (const Repair repair : {Repair::none, Repair::weld, Repair::stitch, Repair::fill, Repair::wrap}) {
    if (text == describe(repair)) return repair;
  }
  throw CLI::ValidationError("--repair takes none, weld, stitch, fill or wrap, not '" + text + "'");
}

double parse_length(const std::string& text) {
  return parse(text, {"a length",
                      "5mm",
                      {"mm", "m"},
                      {{"km", 1e3}, {"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}}});
}

std::size_t parse_size(const std::string& text) {
  const double size =
      parse(text, {"a size", "4GB", {"MB", "GB"}, {{"B", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}}});
  return static_cast<std::size_t>(std::clamp(size, 1.0, 1e18));
}

// Plain decimal digits: CLI11 would take 010 for 8.
template <class Integer>
CLI::Option* add_integer(CLI::App& app, const char* name, Integer& value, int low, int high, const char* description) {
  return app.add_option_function<std::string>(
      name,
      [=, &value](const std::string& text) {
        const bool digits = !text.empty() && text.size() < 9 && text.find_first_not_of("0123456789") == text.npos;
        const int number = digits ? std::stoi(text) : -1;
        if (number < low || number > high) {
          throw CLI::ValidationError(std::string(name) + " takes a whole number from " + std::to_string(low) + " to " +
                                     std::to_string(high) + ", not '" + text + "'");
        }
        value = static_cast<Integer>(number);
      },
      description);
}

double parse_factor(const char* name, const std::string& text) {
  char* end = nullptr;
  const double factor = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(factor > 0) || !std::isfinite(factor)) {
    throw CLI::ValidationError(std::string(name) + " takes a positive number, not '" + text + "'");
  }
  return factor;
}

double parse_voxels(const std::string& text, const char* example) {
  return parse(text, {"a number of voxels", example, {"vx"}, {{"vx", 1}}});
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
  app.add_option_function<std::string>(
         "--scale", [&](const std::string& text) { arguments.scale = parse_factor("--scale", text); },
         "Enlarge the mesh by this factor [default: 1]")
      ->option_text("X")
      ->group("Mesh");
  app.add_option_function<std::string>(
         "--repair", [&](const std::string& text) { arguments.options.repair = parse_repair(text); },
         "How far to go to close the mesh: none, weld, stitch, fill or wrap [default: the mildest that suffices, but "
         "holes wider than a voxel are refused]")
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
  app.add_option_function<std::string>(
         "--import-memory",
         [&](const std::string& text) { arguments.import_options.memory_limit_bytes = parse_size(text); },
         "Memory for reading the mesh, such as 8GB [default: 4GB]")
      ->option_text("SIZE")
      ->group("Import");
  app.add_option_function<std::string>(
         "--import-timeout", [&](const std::string& text) { arguments.import_options.timeout = parse_time(text); },
         "Time for reading the mesh, such as 500ms, 120s or 10min [default: 120s]")
      ->option_text("TIME")
      ->group("Import");
}

void add_grid_options(CLI::App& app, BakeArguments& arguments) {
  constexpr const char* kGroup = "Grid (a bake needs one of these)";
  auto* const voxel = app.add_option_function<std::string>(
      "--voxel", [&](const std::string& text) { arguments.options.voxel_size = parse_length(text); },
      "Edge of a voxel, such as 5mm");
  voxel->option_text("LENGTH")->group(kGroup);
  add_integer(app, "--resolution", arguments.options.resolution, 1, 8192, "Voxels along the longest side, 1 to 8192")
      ->excludes(voxel)
      ->option_text("N")
      ->group(kGroup);
}

void add_error_option(CLI::App& app, BakeArguments& arguments) {
  app.add_option_function<std::string>(
         "--max-error", [&](const std::string& text) { arguments.max_error = parse_length(text); },
         "The coarsest voxels with which no field is found to be off by more, such as 0.2mm")
      ->excludes(app.get_option("--voxel"), app.get_option("--resolution"))
      ->option_text("LENGTH")
      ->group("Grid (a bake needs one of these)");
}

void add_content_options(CLI::App& app, BakeArguments& arguments) {
  constexpr const char* kGroup = "Contents of the asset";
  app.add_option_function<std::string>(
         "--band-inside", [&](const std::string& text) { arguments.options.band_inside = parse_voxels(text, "2.5vx"); },
         "Depth to which distances are kept, 2vx to 8vx [default: 2.5vx]")
      ->option_text("VOXELS")
      ->group(kGroup);
  app.add_option_function<std::string>(
         "--band-outside",
         [&](const std::string& text) { arguments.options.band_outside = parse_voxels(text, "2.5vx"); },
         "Reach of the distances kept outside, 2vx to 8vx [default: 2.5vx]")
      ->option_text("VOXELS")
      ->group(kGroup);
  app.add_option_function<std::string>(
         "--field-error", [&](const std::string& text) { arguments.options.field_error = parse_voxels(text, "0.1vx"); },
         "Largest error of interpolated distances, 0.01vx to 1vx [default: 0.1vx]")
      ->option_text("VOXELS")
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
  app.add_option_function<std::string>(
         "--alpha", [&](const std::string& text) { arguments.options.alpha = parse_factor("--alpha", text); },
         "Spacing of the pointshell in voxels, 0.25 to 64 [default: 1.41]")
      ->option_text("X")
      ->group(kGroup);
}

CLI::Validator not_empty() {
  return {[](std::string& name) { return std::string(name.empty() ? "is empty" : ""); }, ""};
}

void add_output_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("-o,--output", arguments.output, "Asset to write [default: NAME.vps.hdf beside the mesh]")
      ->check(not_empty())
      ->option_text("FILE")
      ->group("Output");
  app.add_flag("--json", arguments.json, "Print the result as JSON")->group("Output");
  app.add_option_function<std::string>(
         "--memory", [&](const std::string& text) { arguments.options.memory_limit_bytes = parse_size(text); },
         "Refuse to bake when more is needed, such as 4GB [default: 8GB]")
      ->option_text("SIZE")
      ->group("Output");
}

void add_cache_options(CLI::App& app, BakeArguments& arguments) {
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) arguments.cache = folder;  // options win
  auto* const cache = app.add_option("--cache", arguments.cache,
                                     "Take what was baked before from this folder, and keep there what is new "
                                     "[default: the environment's VPSBAKE_CACHE, or none]");
  cache->check(not_empty())->option_text("DIR")->group("Output");
  app.add_flag_callback(
         "--no-cache", [&] { arguments.cache.clear(); }, "Bake without a cache, whatever VPSBAKE_CACHE says")
      ->excludes(cache)
      ->option_text(" ")
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
  add_error_option(app, bake);
  add_content_options(app, bake);
  add_output_options(app, bake);
  add_cache_options(app, bake);
  CLI::App* check = app.add_subcommand("check", "Say what is wrong with a mesh and whether it would bake");
  add_mesh_options(*check, bake);
  add_import_options(*check, bake);
  add_grid_options(*check, bake);
  check->add_flag("--json", bake.json, "Print JSON")->group("Output");
  std::string asset;
  bool json = false;
  CLI::App* info = app.add_subcommand("info", "Check an asset and print what it holds");
  info->add_option("file", asset, "Asset")->required()->option_text("FILE");
  info->add_flag("--json", json, "Print JSON");

  try {
    app.parse(argc, argv);
    if (info->parsed() || check->parsed()) {
      for (const CLI::Option* option : app.get_options()) {
        if (option->count() == 0) continue;
        throw CLI::ArgumentMismatch(option->get_name() + " does not go before " + app.get_subcommands()[0]->get_name());
      }
    }
    if (!info->parsed()) {
      if (bake.mesh.empty()) throw CLI::RequiredError("a mesh");
      if (!check->parsed() && bake.options.voxel_size == 0 && bake.options.resolution == 0 && bake.max_error == 0) {
        throw CLI::RequiredError("--voxel, --resolution or --max-error");
      }
      const bool voxelmap = std::find(bake.parts.begin(), bake.parts.end(), "voxelmap") != bake.parts.end();
      for (const char* const name : {"--fields", "--precision", "--field-error"}) {
        if (!voxelmap && app.get_option(name)->count() > 0)
          throw CLI::ArgumentMismatch(std::string(name) + " needs the voxelmap among --parts");
      }
    }
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    return fail(kCommandLine, "command line", std::string(error.what()) + "; run vpsbake --help");
  }
  if (info->parsed()) return run_info(asset, json);
  return check->parsed() ? run_check(bake) : run_bake(bake);
}

}  // namespace
}  // namespace vps::cli

int main(int argc, char** argv) {
  // Without the standard descriptors the next file opened would take their place.
  int null = -1;
  do {
    null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  } while (null >= 0 && null <= STDERR_FILENO);
  ::close(null);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error of writing, not a crash
  int code = 0;
  try {
    code = vps::cli::run(argc, argv);
  } catch (const std::system_error& error) {
    return vps::cli::fail(vps::cli::kIo, "standard output", std::string(error.what()) + "; free space or redirect it");
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return vps::cli::fail(vps::cli::kIo, "standard output", "it cannot be written; free space or redirect it");
  }
  return code;
}
