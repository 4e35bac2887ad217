// SPDX-License-Identifier: GPL-3.0-or-later
// The command line: options to structs, one file per command.
#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <system_error>

#include "cli/bake_command.h"
#include "cli/check_command.h"
#include "cli/exit_code.h"
#include "cli/info_command.h"
#include "cli/options.h"
#include "cli/provenance.h"
#include "cli/recommend_command.h"
#include "cli/report_command.h"
#include "cli/scene_command.h"
#include "cli/slice_command.h"
#include "cli/stress_command.h"
#include "cli/view_command.h"
#include "version.h"

namespace vps::cli {
namespace {

void add_error_option(CLI::App& app, BakeArguments& arguments) {
  app.add_option_function<std::string>(
         "--max-error", [&](const std::string& text) { arguments.max_error = parse_length(text); },
         "The coarsest voxels with which no field is found to be off by more, such as 0.2mm; `recommend` counts what "
         "lies between points as well")
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

// What CLI11 cannot check for the command without a name.
void require_bakeable(const CLI::App& app, const BakeArguments& bake) {
  if (bake.mesh.empty()) throw CLI::RequiredError("a mesh");
  if (bake.options.voxel_size == 0 && bake.options.resolution == 0 && bake.max_error == 0) {
    throw CLI::RequiredError("--voxel, --resolution or --max-error");
  }
  if (std::find(bake.parts.begin(), bake.parts.end(), "voxelmap") != bake.parts.end()) return;
  for (const char* const name : {"--fields", "--precision", "--field-error"}) {
    if (app.get_option(name)->count() > 0)
      throw CLI::ArgumentMismatch(std::string(name) + " needs the voxelmap among --parts");
  }
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
  const Command commands[] = {
      add_check_command(app),     add_info_command(app),   add_scene_command(app),
      add_slice_command(app),     add_view_command(app),
#ifdef VPSBAKE_EVALUATE
      add_recommend_command(app), add_report_command(app), add_stress_command(app),
#endif
  };
  const Command* command = nullptr;

  try {
    app.parse(argc, argv);
    for (const Command& one : commands) {
      if (one.app->parsed()) command = &one;
    }
    if (command != nullptr) {
      for (const CLI::Option* option : app.get_options()) {
        if (option->count() == 0) continue;
        throw CLI::ArgumentMismatch(option->get_name() + " does not go before " + command->app->get_name());
      }
    } else {
      require_bakeable(app, bake);
    }
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    return fail(kCommandLine, "command line", std::string(error.what()) + "; run vpsbake --help");
  }
  return command != nullptr ? command->run() : run_bake(bake);
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
  vps::cli::remember_command(argc, argv);
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
