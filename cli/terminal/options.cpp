// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/options.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string_view>

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

enum class Sign : std::uint8_t { positive, any };

// A quantity on the command line: a number with a unit.
struct Quantity {
  const char* kind;     // "a length"
  const char* example;  // "5mm"
  std::vector<const char*> usual;
  std::map<std::string, double> units;
};

// "5mm" to 0.005. CLI11's AsNumberWithUnit would do, but its errors do not say what to write instead.
double parse(const std::string& text, const Quantity& quantity, Sign sign = Sign::positive) {
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
  if (!std::isfinite(number) || (sign == Sign::positive && !(number > 0)))
    throw CLI::ValidationError(text + " is not " +
                               (sign == Sign::positive ? "a positive " + kind.substr(kind.find(' ') + 1) : kind));
  return number * size;
}

const Quantity kLength = {
    "a length", "5mm", {"mm", "m"}, {{"km", 1e3}, {"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}}};

bake::Repair parse_repair(const std::string& text) {
  for (const bake::Repair repair :
       {bake::Repair::none, bake::Repair::weld, bake::Repair::stitch, bake::Repair::fill, bake::Repair::wrap}) {
    if (text == describe(repair)) return repair;
  }
  throw CLI::ValidationError("--repair takes none, weld, stitch, fill or wrap, not '" + text + "'");
}

}  // namespace

double parse_length(const std::string& text) {
  return parse(text, kLength);
}

double parse_coordinate(const std::string& text) {
  return parse(text, kLength, Sign::any);
}

double parse_velocity(const std::string& text) {
  return parse(text,
               {"a speed",
                "3m/s",
                {"m/s", "mm/s"},
                {{"m/s", 1}, {"cm/s", 1e-2}, {"mm/s", 1e-3}, {"km/h", 1 / 3.6}, {"in/s", 0.0254}}},
               Sign::any);
}

double parse_acceleration(const std::string& text) {
  return parse(text, {"an acceleration", "9.81m/s2", {"m/s2"}, {{"m/s2", 1}, {"m/s^2", 1}}}, Sign::any);
}

double parse_angle(const std::string& text) {
  return parse(text, {"an angle", "90deg", {"deg", "rad"}, {{"deg", std::numbers::pi / 180}, {"rad", 1}}}, Sign::any);
}

double parse_mass(const std::string& text) {
  return parse(text, {"a mass", "20g", {"g", "kg"}, {{"mg", 1e-6}, {"g", 1e-3}, {"kg", 1}, {"t", 1e3}}});
}

double parse_unit(const std::string& unit) {
  return unit_size(unit, {{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}});
}

std::size_t parse_size(const std::string& text) {
  const double size =
      parse(text, {"a size", "4GB", {"MB", "GB"}, {{"B", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}}});
  return static_cast<std::size_t>(std::clamp(size, 1.0, 1e18));
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
  return parse(text,
               {"a time", "120s", {"s", "min"}, {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}}});
}

CLI::Validator not_empty() {
  return {[](std::string& name) { return std::string(name.empty() ? "is empty" : ""); }, ""};
}

void add_unit_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option_function<std::string>(
         "--unit", [&](const std::string& unit) { arguments.unit = parse_unit(unit); },
         "Unit of the mesh's numbers: m, cm, mm or in [default: m]")
      ->option_text("UNIT")
      ->type_name("{m,cm,mm,in}")
      ->group("Mesh");
  app.add_option_function<std::string>(
         "--scale", [&](const std::string& text) { arguments.scale = parse_factor("--scale", text); },
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
  app.add_option_function<std::string>(
         "--repair", [&](const std::string& text) { arguments.options.repair = parse_repair(text); },
         "How far to go to close the mesh: none, weld, stitch, fill or wrap [default: the mildest that suffices, but "
         "holes wider than a voxel are refused]")
      ->option_text("HOW")
      ->type_name("{none,weld,stitch,fill,wrap}")
      ->group("Mesh");
  app.add_option_function<std::string>(
         "--open-surface",
         [&](const std::string& text) {
           constexpr std::string_view kThicken = "thicken=";
           if (!text.starts_with(kThicken)) throw CLI::ValidationError("--open-surface takes thicken=2mm");
           arguments.options.sheet_thickness = parse_length(text.substr(kThicken.size()));
         },
         "Bake open surfaces as solids of this thickness, such as thicken=2mm [default: they are refused]")
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
  auto* const voxel = app.add_option_function<std::string>(
      "--voxel", [&](const std::string& text) { arguments.options.voxel_size = parse_length(text); },
      "Edge of a voxel, such as 5mm");
  voxel->option_text("LENGTH")->group(kGridGroup);
  add_integer(app, "--resolution", arguments.options.resolution, 1, 8192, "Voxels along the longest side, 1 to 8192")
      ->excludes(voxel)
      ->option_text("N")
      ->group(kGridGroup);
}

void add_cache_options(CLI::App& app, std::string& folder, std::size_t& bytes, const char* group) {
  if (const char* const name = std::getenv("VPSBAKE_CACHE")) folder = name;  // options win
  auto* const cache = app.add_option("--cache", folder,
                                     "Take what was baked before from this folder, and keep there what is new "
                                     "[default: the environment's VPSBAKE_CACHE, or none]");
  cache->check(not_empty())->option_text("DIR")->group(group);
  app.add_option_function<std::string>(
         "--cache-size", [&bytes](const std::string& text) { bytes = parse_size(text); },
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
  } catch (const CLI::ValidationError& error) {
    throw CLI::ValidationError("VPSBAKE_CACHE_SIZE: " + std::string(error.what()));
  }
}

}  // namespace vps::cli
