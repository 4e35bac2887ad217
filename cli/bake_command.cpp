// SPDX-License-Identifier: GPL-3.0-or-later
// Import, plan, bake, write: the main job.
#include "cli/bake_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "bake/plan.h"
#include "cli/describe_asset.h"
#include "cli/exit_code.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// One line on a terminal, rewritten in place; nothing when stderr is piped.
class Progress {
 public:
  void show(const char* stage, double fraction) const {
    if (terminal_) fmt::print(stderr, "\r\033[K{:>3.0f} % {}", 100 * fraction, stage);
  }
  ~Progress() {
    if (terminal_) fmt::print(stderr, "\r\033[K");
  }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0;
};

fs::path output_path(const BakeArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  fs::path path = arguments.mesh;
  return path.replace_extension(".vps.hdf");
}

BakeOptions complete_options(const BakeArguments& arguments) {
  const auto has = [](const std::vector<std::string>& list, const char* name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  BakeOptions options = arguments.options;
  options.layers = has(arguments.fields, "layers");
  options.scaled = has(arguments.fields, "scaled");
  options.real = has(arguments.fields, "real");
  options.voxelmap = has(arguments.parts, "voxelmap");
  options.pointshell = has(arguments.parts, "pointshell");
  return options;
}

std::string plan_line(const BakePlan& plan) {
  std::string line = fmt::format("grid of {} x {} x {} voxels of {}", plan.dims[0], plan.dims[1], plan.dims[2],
                                 format_length(plan.voxel_size));
  if (plan.predicted_points > 0) line += fmt::format(", about {} points", plan.predicted_points);
  return line + fmt::format(", about {} of memory", format_bytes(static_cast<double>(plan.predicted_memory_bytes)));
}

void print_json(const fs::path& output, const BakePlan& plan, const BakedAsset& asset, std::size_t bytes,
                double import_seconds, double write_seconds) {
  nlohmann::ordered_json j;
  j["output"] = output.string();
  j["bytes"] = bytes;
  j["plan"] = {{"dims", plan.dims},
               {"voxels", plan.voxels},
               {"predicted_points", plan.predicted_points},
               {"predicted_memory_bytes", plan.predicted_memory_bytes}};
  j.update(info_to_json(asset.info));
  j["repair"] = describe(asset.repair);
  j["notes"] = asset.notes;
  j["seconds"]["import"] = import_seconds;
  for (const StageTime& time : asset.times) j["seconds"][time.stage] = time.seconds;
  j["seconds"]["write"] = write_seconds;
  fmt::print("{}\n", j.dump(2));
}

int bake_file(const BakeArguments& arguments) {
  const fs::path output = output_path(arguments);
  std::error_code ignored;
  if (fs::is_directory(output, ignored))
    return fail(kIo, output.string(), "this is a folder; give a file name with -o");
  // Better now than after the bake.
  if (output.has_parent_path() && !fs::is_directory(output.parent_path(), ignored)) {
    return fail(kIo, output.string(), "the folder does not exist; create it or choose another output");
  }
  if (fs::exists(output, ignored) && fs::equivalent(output, arguments.mesh, ignored)) {
    return fail(kCommandLine, output.string(), "the output would replace the mesh; choose another name with -o");
  }
  const Progress progress;
  progress.show("import", 0);
  const auto import_begin = Clock::now();
  ImportOptions import_options = arguments.import_options;
  import_options.unit = arguments.unit * arguments.scale;
  const ImportedMesh mesh = import_mesh(arguments.mesh, import_options);
  const double import_seconds = seconds_since(import_begin);

  BakeOptions options = complete_options(arguments);
  const BakePlan plan = plan_bake(mesh, options);
  progress.show("plan", 0);
  if (!arguments.json) {
    fmt::print("{}: {}\n", arguments.mesh, plan_line(plan));
    std::fflush(stdout);
  }
  options.progress = [&](const char* stage, double fraction) { progress.show(stage, fraction); };
  BakedAsset asset = bake(mesh, options);
  asset.notes.insert(asset.notes.begin(), mesh.notes.begin(), mesh.notes.end());
  progress.show("write", 1);
  const auto write_begin = Clock::now();
  std::size_t bytes = 0;
  try {
    bytes = write_asset(output, asset.info, asset.sections);
  } catch (const WriteError& error) {
    return fail(kIo, output.string(), error.what());
  }
  const double write_seconds = seconds_since(write_begin);
  if (arguments.json) {
    print_json(output, plan, asset, bytes, import_seconds, write_seconds);
    return kOk;
  }
  for (const std::string& note : asset.notes) fmt::print("note: {}\n", note);
  fmt::print("{}", info_to_text(asset.info));
  fmt::print("{}: {} in {:.2f} s\n", output.string(), format_bytes(static_cast<double>(bytes)),
             seconds_since(import_begin));
  return kOk;
}

}  // namespace

int run_bake(const BakeArguments& arguments) {
  try {
    return bake_file(arguments);
  } catch (const ImportError& error) {
    return fail(error.kind == ImportError::Kind::io ? kIo : kBadInput, arguments.mesh, error.what());
  } catch (const BakeError& error) {
    return fail(kBadInput, arguments.mesh, error.what());
  } catch (const std::bad_alloc&) {
    return fail(kInternal, arguments.mesh, "out of memory; choose larger voxels");
  } catch (const std::exception& error) {
    return fail(kInternal, arguments.mesh, fmt::format("internal error: {}; please report it", error.what()));
  }
}

}  // namespace vps::cli
