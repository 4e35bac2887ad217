// SPDX-License-Identifier: GPL-3.0-or-later
// Import, plan, bake, write: the main job.
#include "cli/bake_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

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
  void clear() const {
    if (terminal_) fmt::print(stderr, "\r\033[K");
  }
  ~Progress() { clear(); }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0;
};

fs::path output_path(const BakeArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  fs::path path = arguments.mesh;
  return path.replace_extension(".vps.hdf");
}

// Why an output cannot be written, as far as that can be told beforehand; empty when it can.
std::string output_refusal(const fs::path& output) {
  std::error_code ignored;
  const fs::path folder = output.has_parent_path() ? output.parent_path() : ".";
  if (fs::is_directory(output, ignored)) return "this is a folder; give a file name with -o";
  if (!fs::is_directory(folder, ignored)) return "the folder does not exist; create it or choose another output";
  if (::access(folder.c_str(), W_OK) != 0) return "the folder may not be written; choose another output";
  if (!fs::exists(output, ignored)) return "";
  if (!fs::is_regular_file(output, ignored)) return "this is not a regular file; choose another output";
  // Not the mesh itself, nor a buffer or material that it refers to.
  std::ifstream file(output, std::ios::binary);
  std::array<char, kMagic.size()> magic{};
  if (file.read(magic.data(), magic.size()) && std::memcmp(magic.data(), kMagic.data(), magic.size()) == 0) return "";
  return "the file exists and is not an asset; remove it or choose another output";
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
  j["filled_share"] = asset.filled_share;
  j["notes"] = asset.notes;
  j["seconds"]["import"] = import_seconds;
  for (const StageTime& time : asset.times) j["seconds"][time.stage] = time.seconds;
  j["seconds"]["write"] = write_seconds;
  fmt::print("{}", to_text(j));
}

int bake_file(const BakeArguments& arguments) {
  const Progress progress;
  progress.show("import", 0);
  const auto import_begin = Clock::now();
  const ImportedMesh mesh = import_with(arguments);
  const double import_seconds = seconds_since(import_begin);

  // Better now than after the bake.
  const fs::path output = output_path(arguments);
  if (const std::string reason = output_refusal(output); !reason.empty()) {
    progress.clear();
    return fail(kIo, output.string(), reason);
  }
  BakeOptions options = complete_options(arguments);
  if (arguments.max_error > 0) {
    progress.show("search", 0);
    options.voxel_size = find_voxel_size(mesh, options, arguments.max_error);
  }
  const BakePlan plan = plan_bake(mesh, options);
  if (!arguments.json) {
    progress.clear();
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
    progress.clear();
  } catch (const WriteError& error) {
    progress.clear();
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

ImportedMesh import_with(const BakeArguments& arguments) {
  ImportOptions options = arguments.import_options;
  options.unit = arguments.unit * arguments.scale;
  return import_mesh(arguments.mesh, options);
}

int guarded(const std::string& mesh, const std::function<int()>& work) {
  try {
    return work();
  } catch (const ImportError& error) {
    return fail(error.kind == ImportError::Kind::io ? kIo : kBadInput, mesh, error.what());
  } catch (const BakeError& error) {
    return fail(kBadInput, mesh, error.what());
  } catch (const std::bad_alloc&) {
    return fail(kInternal, mesh, "out of memory; choose larger voxels");
  } catch (const std::system_error&) {
    throw;  // of printing: main knows what to say
  } catch (const std::exception& error) {
    return fail(kInternal, mesh, fmt::format("internal error: {}; please report it", error.what()));
  }
}

int run_bake(const BakeArguments& arguments) {
  return guarded(arguments.mesh, [&] { return bake_file(arguments); });
}

}  // namespace vps::cli
