// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Options that several commands take. A wrong value throws CLI::ValidationError; its message says what to write
/// instead.
#pragma once

#ifndef VPS_TERMINAL
#error "libraries neither print nor read command lines: link vps_terminal only to programs"
#endif

#include <CLI/CLI.hpp>
#include <cstddef>
#include <functional>
#include <string>

#include "cli/terminal/bake_arguments.h"
#include "cli/terminal/units.h"

namespace vps::cli {

/// Title of the options of add_grid_options.
inline constexpr const char* kGridGroup = "Grid (one of these) [default: --resolution 200]";

/// A sub-command, and the function that runs it.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;      ///< @return the exit code of the program
  bool starts_programs = false;  ///< bakes in child processes
};

/// An option that takes one text, such as a quantity.
/// @param take  uses the text; its UsageError becomes a CLI::ValidationError
CLI::Option* add_text_option(CLI::App& app, const char* name, std::function<void(const std::string&)> take,
                             const char* description);

/// An integer option in plain decimal digits. CLI11's own would read 010 as octal 8.
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

/// Refuses an empty text.
[[nodiscard]] CLI::Validator not_empty();

/// -q and, where it prints something, -v.
/// @param verbose  null: there is no -v
void add_verbosity_options(CLI::App& app, Verbosity& verbosity, const char* quiet, const char* verbose);

/// Refuses an empty text, and "-" where an output is not one file.
[[nodiscard]] CLI::Validator not_stream();

/// Unit of a mesh's numbers: --unit and --scale.
void add_unit_options(CLI::App& app, BakeArguments& arguments);
/// How to read and repair a mesh.
void add_surface_options(CLI::App& app, BakeArguments& arguments);
constexpr const char* kMeshHelp = "Mesh to bake: obj, ply, stl, off, gltf, glb, dae, 3ds or fbx; - is standard input";

/// The mesh, and `add_surface_options`. @return the mesh's own option
CLI::Option* add_mesh_options(CLI::App& app, BakeArguments& arguments);
/// Limits of reading a mesh.
void add_import_options(CLI::App& app, BakeArguments& arguments);
/// Format of the mesh: --format.
void add_format_option(CLI::App& app, BakeArguments& arguments);
/// The voxel size, as a length or by resolution.
void add_grid_options(CLI::App& app, BakeArguments& arguments);
/// Call after parsing: 200 voxels along the longest side where no option sets the grid.
void set_default_grid(BakeArguments& arguments);

/// --cache, --cache-size and --no-cache, with VPSBAKE_CACHE as the default of the folder.
/// @param bytes  0: no limit
void add_cache_options(CLI::App& app, std::string& folder, std::size_t& bytes, const char* group);
/// Reads the limit from VPSBAKE_CACHE_SIZE where --cache-size was not given. Call it after parsing, so that only a
/// command that uses the limit reports an error in it. @throw CLI::ValidationError
void read_cache_size(const CLI::App& app, std::size_t& bytes);

}  // namespace vps::cli
