// SPDX-License-Identifier: GPL-3.0-or-later
// Import, plan, bake, write: the main job. Or a copy from the cache.
#include "cli/commands/commands.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <span>
#include <system_error>

#include "bake/quantity_text.h"
#include "bake/store/cache.h"
#include "cli/lab/oracle.h"
#include "cli/terminal/exit_code.h"
#include "cli/terminal/progress.h"
#include "cli/tools/depfile.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/output_file.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

fs::path output_path(const BakeArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  fs::path path = arguments.mesh;
  return path.replace_extension(".vps.hdf");
}

std::string plan_line(const bake::BakePlan& plan) {
  std::string line = fmt::format("grid of {} x {} x {} voxels of {}", plan.dims[0], plan.dims[1], plan.dims[2],
                                 bake::format_length(plan.voxel_size));
  if (plan.predicted_points > 0) line += fmt::format(", about {} points", plan.predicted_points);
  return line +
         fmt::format(", about {} of memory", bake::format_bytes(static_cast<double>(plan.predicted_memory_bytes)));
}

// One bake from the command line.
struct BakeRun {
  const BakeArguments& arguments;
  fs::path output;
  Progress progress = {};
  Clock::time_point begin = Clock::now();
  std::vector<bake::StageTime> times = {};
  const char* cache = "off";  // off, hit or miss
  bake::BakeReport report = {};
};

// Files the time of a stage that is not one of bake's.
template <class Work>
auto timed(BakeRun& run, const char* stage, const Work& work) {
  const auto begin = Clock::now();
  auto result = work();
  run.times.push_back({stage, seconds_since(begin)});
  return result;
}

nlohmann::ordered_json plan_to_json(const bake::BakePlan& plan) {
  return {{"dims", plan.dims},
          {"voxels", plan.voxels},
          {"predicted_points", plan.predicted_points},
          {"predicted_memory_bytes", plan.predicted_memory_bytes}};
}

void print_json(const BakeRun& run, const AssetInfo& info, std::size_t bytes) {
  nlohmann::ordered_json j;
  j["output"] = run.output.string();
  j["bytes"] = bytes;
  j["cache"] = run.cache;
  j["plan"] = plan_to_json(run.report.plan);
  j.update(info_to_json(info));
  j["repair"] = describe(run.report.repair);
  j["filled_share"] = run.report.filled_share;
  j["notes"] = run.report.notes;
  for (const bake::StageTime& time : run.times) j["seconds"][time.stage] = time.seconds;
  fmt::print("{}", to_text(j));
}

void print_plan(const BakeRun& run) {
  if (run.arguments.json) return;
  run.progress.clear();
  fmt::print("{}: {}\n", run.arguments.mesh, plan_line(run.report.plan));
  std::fflush(stdout);
}

void print_result(const BakeRun& run, const AssetInfo& info, std::size_t bytes) {
  if (run.arguments.json) return print_json(run, info, bytes);
  for (const std::string& note : run.report.notes) fmt::print("note: {}\n", note);
  fmt::print("{}", info_to_text(info));
  const std::string cache = run.arguments.cache.empty() ? "" : fmt::format(" (cache: {})", run.cache);
  fmt::print("{}: {} in {:.2f} s{}\n", run.output.string(), bake::format_bytes(static_cast<double>(bytes)),
             seconds_since(run.begin), cache);
}

int fail_output(const BakeRun& run, const std::string& reason) {
  run.progress.clear();
  return fail(kIo, run.output.string(), reason);
}

// Runs `write`, which returns the asset's size.
int deliver(BakeRun& run, const AssetInfo& info, const std::function<std::size_t()>& write) {
  run.progress.show("write", 1);
  try {
    const std::size_t bytes = timed(run, "write", write);
    run.progress.clear();
    print_result(run, info, bytes);
    return kOk;
  } catch (const WriteError& error) {
    return fail_output(run, error.what());
  }
}

// The voxel size and what follows from it.
bake::BakeOptions planned_options(BakeRun& run, const bake::BakeSettings& settings, const ImportedMesh& mesh) {
  bake::BakeOptions options = settings.options;
  if (settings.max_error > 0) {
    run.progress.show("search", 0);
    options.voxel_size = bake::find_voxel_size(mesh, options, settings.max_error);
  }
  run.report.plan = bake::plan_bake(mesh, options);
  return options;
}

int plan_file(BakeRun& run, const bake::BakeSettings& settings) {
  run.progress.show("import", 0);
  (void)planned_options(run, settings, import_mesh(run.arguments.mesh, settings.import));
  run.progress.clear();
  const bake::BakePlan& plan = run.report.plan;
  if (run.arguments.json) {
    nlohmann::ordered_json j = {{"output", run.output.string()}, {"voxel_size", plan.voxel_size}};
    j["plan"] = plan_to_json(plan);
    j["plan"]["predicted_asset_bytes"] = plan.predicted_asset_bytes;
    fmt::print("{}", to_text(j));
  } else {
    fmt::print("{}: {}; {} would have at most {}\n", run.arguments.mesh, plan_line(plan), run.output.string(),
               bake::format_bytes(static_cast<double>(plan.predicted_asset_bytes)));
  }
  return kOk;
}

bake::BakedAsset bake_mesh(BakeRun& run, const bake::BakeSettings& settings, const ImportedMesh& mesh) {
  bake::BakeOptions options = planned_options(run, settings, mesh);
  print_plan(run);
  options.progress = [&](const char* stage, double fraction) { run.progress.show(stage, fraction); };
  bake::BakedAsset asset = bake::bake(mesh, options);
  run.times.insert(run.times.end(), asset.times.begin(), asset.times.end());
  run.report.repair = asset.repair;
  run.report.filled_share = asset.filled_share;
  run.report.notes = mesh.notes;
  run.report.notes.insert(run.report.notes.end(), asset.notes.begin(), asset.notes.end());
  return asset;
}

// The mesh and what it is: imported again when it was written meanwhile, also when that is why it makes no sense.
ImportedMesh import_steady(const BakeArguments& arguments, const bake::BakeSettings& settings, bake::MeshState& state) {
  constexpr int kAttempts = 3;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    ImportedMesh mesh;
    std::exception_ptr failure;
    try {
      mesh = import_mesh(arguments.mesh, settings.import);
    } catch (const ImportError&) {
      failure = std::current_exception();
    }
    bake::MeshState after = bake::mesh_state(arguments.mesh, settings);
    if (after == state && failure) std::rethrow_exception(failure);
    if (after == state) return mesh;
    state = std::move(after);
  }
  throw ImportError(ImportError::Kind::io, "the mesh changes while it is read; bake again when it is complete");
}

int bake_file(const BakeArguments& arguments) {
  BakeRun run{arguments, output_path(arguments)};
  const bake::BakeSettings settings = complete_settings(arguments);
  if (arguments.dry_run) return plan_file(run, settings);
  const bool with_cache = !arguments.cache.empty();
  const bake::AssetCache cache(arguments.cache, arguments.cache_bytes);
  bake::MeshState state;
  const std::optional<bake::BakeRecord>& record = state.record;
  Asset hit;
  const auto look_up = [&] {
    state = bake::mesh_state(arguments.mesh, settings);
    return with_cache && record && cache.open(bake::cache_key(*record), hit, run.report);
  };
  const bool found = with_cache ? timed(run, "cache", look_up) : look_up();
  if (with_cache) run.cache = found ? "hit" : "miss";
  if (hit.is_open()) {
    if (const std::string reason = asset_refusal(run.output); !reason.empty()) return fail_output(run, reason);
    print_plan(run);
    return deliver(run, hit.info(), [&] {
      write_whole(run.output, hit.bytes());
      return hit.bytes().size();
    });
  }
  run.progress.show("import", 0);
  const ImportedMesh mesh = timed(run, "import", [&] { return import_steady(arguments, settings, state); });
  // Better now than after the bake.
  if (const std::string reason = asset_refusal(run.output); !reason.empty()) return fail_output(run, reason);
  bake::BakedAsset asset = bake_mesh(run, settings, mesh);
  if (record) bake::add_record(*record, asset);
  if (with_cache) {
    run.progress.show("store", 1);
    const auto key = record ? std::optional(bake::cache_key(*record)) : std::nullopt;
    const std::string reason = timed(run, "store", [&] { return cache.store(key, asset, run.report); });
    run.progress.clear();
    if (!reason.empty()) complain("warning", arguments.cache, reason + "; the asset is not kept there");
  }
  return deliver(run, asset.info, [&] { return write_asset(run.output, asset.info, asset.sections); });
}

}  // namespace

int guarded(const std::string& mesh, const std::function<int()>& work) {
  try {
    return work();
  } catch (const ImportError& error) {
    return fail(error.kind == ImportError::Kind::io ? kIo : kBadInput, mesh, error.what());
  } catch (const bake::BakeError& error) {
    return fail(kBadInput, mesh, error.what());
  } catch (const lab::MeasureError& error) {
    return fail(kBadInput, mesh, error.what());
  } catch (const WriteError& error) {
    return fail(kIo, mesh, error.what());
  } catch (const fs::filesystem_error& error) {
    return fail(kIo, error.path1().string(), error.code().message() + "; free space or choose another folder");
  } catch (const std::bad_alloc&) {
    return fail(kInternal, mesh, "out of memory; choose larger voxels");
  } catch (const std::system_error&) {
    throw;  // of printing: main knows what to say
  } catch (const std::exception& error) {
    return fail(kInternal, mesh, fmt::format("internal error: {}; please report it", error.what()));
  }
}

int run_bake(const BakeArguments& arguments) {
  std::optional<tbb::global_control> limit;
  if (arguments.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, arguments.threads);
  if (arguments.depfile.empty()) return guarded(arguments.mesh, [&] { return bake_file(arguments); });
  return guarded(arguments.depfile, [&] {
    const fs::path output = output_path(arguments);
    const std::vector<fs::path> files = bake::mesh_files(arguments.mesh);
    const std::string reason = depfile_refusal(arguments.depfile, {output}, files);
    if (!reason.empty()) return fail(kIo, arguments.depfile, reason);
    const int code = guarded(arguments.mesh, [&] { return bake_file(arguments); });
    const std::string text = depfile_text(output, files);
    if (code == kOk && !arguments.dry_run) write_whole(arguments.depfile, std::as_bytes(std::span(text)));
    return code;
  });
}

}  // namespace vps::cli
