// SPDX-License-Identifier: GPL-3.0-or-later
// Imports, plans, bakes and writes one asset, or copies it from the cache.
#include "cli/commands/commands.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "bake/quantity_text.h"
#include "bake/store/vps_store.h"
#include "cli/lab/oracle.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/terminal/stage_words.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/depfile.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/field_surface.h"
#include "cli/tools/likely_unit.h"
#include "cli/tools/output_file.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/utf8.h"
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
  if (is_standard_stream(path)) return path;
  return path.replace_extension(".vps.hdf");
}

std::string plan_line(const bake::BakePlan& plan) {
  std::string line = fmt::format("grid of {} x {} x {} voxels of {}", plan.dims[0], plan.dims[1], plan.dims[2],
                                 bake::format_length(plan.voxel_size));
  if (plan.predicted_points > 0) line += fmt::format(", about {} points", plan.predicted_points);
  return line +
         fmt::format(", about {} of memory", bake::format_bytes(static_cast<double>(plan.predicted_memory_bytes)));
}

constexpr double kBaked = 0.98;  // of the command, when only the writing is left

// @param fraction  of the whole command
void show_stage(const Progress& progress, std::string_view stage, double fraction) {
  progress.show(stage_words(stage), fraction);
}

std::vector<fs::path> files_of_mesh(const BakeArguments& arguments) {
  return bake::mesh_files(arguments.mesh, arguments.import_options);
}

// One bake from the command line.
struct BakeRun {
  const BakeArguments& arguments;
  fs::path output;
  Progress progress{arguments.verbosity};
  Clock::time_point begin = Clock::now();
  std::vector<bake::StageTime> times = {};
  const char* cache = "off";  // off, hit or miss
  bake::BakeReport report = {};
  double longest = 0;  // of the grid's sides; 0 before it is planned. [m]
};

// "16 mm x 18.5 mm x 7.5 mm, voxel 0.25 mm, error up to 0.02 mm": of several fields the largest error.
std::string contents_of(const AssetInfo& info) {
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis)
    text += (axis > 0 ? " x " : "") + bake::format_length(info.bounds_max[axis] - info.bounds_min[axis]);
  text += ", voxel " + bake::format_length(info.voxel_size);
  if (info.dims[0] == 0) return text + fmt::format(", {} points", info.points);
  const double error = std::max({info.layers_error.max, info.scaled_error.max, info.real_error.max});
  return text + ", error up to " + bake::format_length(error);
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
  for (const bake::StageTime& time : run.times) {
    j["seconds"][time.stage] = time.seconds;
    if (time.critical) j["critical_path"].push_back(time.stage);
  }
  fmt::print("{}", to_text(j));
}

void print_plan(const BakeRun& run, const bake::BakePlan& plan) {
  if (run.arguments.json || run.arguments.verbosity == Verbosity::quiet) return;
  run.progress.clear();
  if (run.arguments.verbosity == Verbosity::verbose)
    print_lines(messages_beside(run.output), "{}: {}\n", one_line(run.arguments.mesh), plan_line(plan));
  if (run.arguments.default_grid) {
    print_lines(messages_beside(run.output),
                "note: {} voxels along the longest side, as no size is given; --voxel or --resolution sets it\n",
                run.arguments.options.resolution);
  }
  std::fflush(stdout);
}

// A size that hardly any body has: the unit is likely wrong.
void note_size(const BakeArguments& arguments, const std::array<double, 3>& size) {
  constexpr double kLeast = 1e-3, kMost = 1e3;  // of the longest side. [m]
  const double longest = *std::max_element(size.begin(), size.end());
  if (arguments.verbosity == Verbosity::quiet || (longest >= kLeast && longest <= kMost)) return;
  complain("note", arguments.mesh,
           fmt::format("it is {} x {} x {} large; check --unit, which says what its numbers mean",
                       bake::format_length(size[0]), bake::format_length(size[1]), bake::format_length(size[2])));
}

std::array<double, 3> size_of(const AssetInfo& info) {
  std::array<double, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis) size[axis] = info.bounds_max[axis] - info.bounds_min[axis];
  return size;
}
std::array<double, 3> size_of(const TriangleMesh& mesh) {
  std::array<double, 3> size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(mesh.vertices.begin(), mesh.vertices.end(),
                                                   [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    size[axis] = (*most)[axis] - (*least)[axis];
  }
  return size;
}

// The unit that a mesh's numbers likely have, where none was given; "m" else.
std::string unit_of(const BakeArguments& arguments, double longest) {
  if (arguments.unit > 0 || arguments.scale != 1) return "m";
  return likely_unit(mesh_format(arguments.mesh, complete_settings(arguments).import), longest);
}

// One line at most about a size that points to a wrong unit.
void warn_of_unit(const BakeArguments& arguments, const std::array<double, 3>& size) {
  const std::string unit = unit_of(arguments, *std::max_element(size.begin(), size.end()));
  if (unit == "m") return note_size(arguments, size);
  complain("warning", arguments.mesh,
           fmt::format("its numbers are likely {0}, but were read as metres; add --unit {0}, or --unit m to keep them",
                       unit));
}

void print_result(const BakeRun& run, const AssetInfo& info, std::size_t bytes) {
  if (run.arguments.json) return print_json(run, info, bytes);
  if (run.arguments.verbosity == Verbosity::quiet) return;
  for (const std::string& note : run.report.notes) print_lines(messages_beside(run.output), "note: {}\n", note);
  const std::string cache = run.arguments.cache.empty() ? "" : fmt::format(" (cache: {})", run.cache);
  const std::string size = bake::format_bytes(static_cast<double>(bytes));
  if (run.arguments.verbosity == Verbosity::verbose) {
    print_lines(messages_beside(run.output), "{}", info_to_text(info));
    print_lines(messages_beside(run.output), "{}: {} in {:.2f} s{}\n", one_line(run.output.string()), size,
                seconds_since(run.begin), cache);
  } else {
    print_lines(messages_beside(run.output), "{}: {}, {}, {:.2f} s{}\n", one_line(run.output.string()),
                contents_of(info), size, seconds_since(run.begin), cache);
  }
}

int deliver(BakeRun& run, const Asset& asset) {
  show_stage(run.progress, "done", kBaked);
  // Before the asset: without a depfile, make would not notice changes of the mesh's files.
  if (const std::string& depfile = run.arguments.depfile; !depfile.empty()) {
    const std::string text = depfile_text(run.output, files_of_mesh(run.arguments));
    run.progress.clear();
    if (const int code = write_quietly(depfile, text); code != kOk) return code;
  }
  const auto begin = Clock::now();
  write_bytes(run.output, asset.bytes());
  run.times.push_back({"write", seconds_since(begin)});
  run.progress.clear();
  warn_of_unit(run.arguments, size_of(asset.info()));
  print_result(run, asset.info(), asset.bytes().size());
  return kOk;
}

int print_dry_run(const BakeRun& run, const bake::BakePlan& plan) {
  run.progress.clear();
  if (run.arguments.json) {
    nlohmann::ordered_json j = {{"output", run.output.string()}, {"voxel_size", plan.voxel_size}};
    j["plan"] = plan_to_json(plan);
    j["plan"]["predicted_asset_bytes"] = plan.predicted_asset_bytes;
    fmt::print("{}", to_text(j));
  } else {
    print_lines(messages_beside(run.output), "{}: {}; {} would have at most {}\n", one_line(run.arguments.mesh),
                plan_line(plan), one_line(run.output.string()),
                bake::format_bytes(static_cast<double>(plan.predicted_asset_bytes)));
  }
  return kOk;
}

int plan_file(BakeRun& run, const bake::BakeSettings& settings) {
  show_stage(run.progress, "import", 0);
  const ImportedMesh mesh = import_mesh(mesh_file(run.arguments), settings.import);
  const bake::BakePlan plan = bake::plan_bake(mesh, settings);
  run.progress.clear();
  warn_of_unit(run.arguments, size_of(mesh));
  return print_dry_run(run, plan);
}

// A refusal, which also says what unit the mesh likely has: sizes in it may be off by a thousand.
std::string with_unit(const BakeRun& run, const std::string& reason) {
  const std::string unit = unit_of(run.arguments, run.longest);
  if (unit == "m" || reason.find("--unit") != reason.npos) return reason;
  return fmt::format("{0}; its numbers are likely {1}: then add --unit {1}", reason, unit);
}

// Ends a bake that becomes a dry run.
struct DryRun {
  bake::BakePlan plan;
};

// Refuses an unusable output. Called before the bake, so that no time is lost.
void check_output(const BakeRun& run) {
  if (const std::string reason = asset_refusal(run.output); !reason.empty()) throw WriteError(reason);
}

int bake_output(BakeRun& run, const bake::BakeSettings& settings) {
  const BakeArguments& arguments = run.arguments;
  const bake::AssetCache folder(arguments.cache, arguments.cache_bytes);
  const bake::AssetCache* const cache = arguments.cache.empty() ? nullptr : &folder;
  const auto imported = [&] { check_output(run); };
  const bake::StoredAsset stored = bake::bake_stored(mesh_file(arguments), settings, cache, imported);
  run.report = stored.report;
  run.times = stored.times;
  if (cache != nullptr) run.cache = stored.baked ? "miss" : "hit";
  if (!stored.baked) {
    check_output(run);
    print_plan(run, run.report.plan);
  }
  run.progress.clear();
  if (!stored.warning.empty()) complain("warning", arguments.cache, stored.warning + "; the asset is not kept there");
  return deliver(run, *stored.asset);
}

int bake_file(const BakeArguments& arguments) {
  BakeRun run{arguments, output_path(arguments)};
  bake::BakeSettings settings = complete_settings(arguments);
  settings.options.progress = [&](const char* stage, double fraction) {
    show_stage(run.progress, stage, kBaked * fraction);
  };
  settings.options.planned = [&](const bake::BakePlan& plan) {
    run.longest = plan.voxel_size * std::max({plan.dims[0], plan.dims[1], plan.dims[2]});
    if (plan.predicted_memory_bytes > arguments.dry_run_above) throw DryRun{plan};
    print_plan(run, plan);
  };
  if (arguments.dry_run) return plan_file(run, settings);
  try {
    return bake_output(run, settings);
  } catch (const DryRun& dry) {
    return print_dry_run(run, dry.plan);
  } catch (const bake::BakeError& error) {
    throw bake::BakeError(error.stage, with_unit(run, error.what()));
  } catch (const WriteError& error) {
    run.progress.clear();
    return fail(kIo, run.output.string(), error.what());
  }
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
  } catch (const FieldSurfaceError& error) {
    return fail(kBadInput, mesh, error.what());
  } catch (const WriteError& error) {
    return fail(kIo, mesh, error.what());
  } catch (const fs::filesystem_error& error) {
    return fail(kIo, error.path1().string(), error.code().message() + "; free space or choose another folder");
  } catch (const std::bad_alloc&) {
    return fail(kInternal, mesh, "out of memory; choose larger voxels");
  } catch (const std::system_error&) {
    throw;  // an error of standard output, which main reports
  } catch (const std::exception& error) {
    return fail(kInternal, mesh, fmt::format("internal error: {}; please report it", error.what()));
  }
}

int run_bake(const BakeArguments& arguments) {
  if (std::error_code ignored; fs::is_directory(arguments.mesh, ignored))
    return fail(kIo, arguments.mesh,
                "this is a folder; give a mesh file, or bake all of its meshes with vpsbake batch");
  std::optional<tbb::global_control> limit;
  if (arguments.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, arguments.threads);
  if (arguments.depfile.empty()) return guarded(arguments.mesh, [&] { return bake_file(arguments); });
  return guarded(arguments.depfile, [&] {
    const std::string reason = depfile_refusal(arguments.depfile, {output_path(arguments)}, files_of_mesh(arguments));
    if (!reason.empty()) return fail(kIo, arguments.depfile, reason);
    return guarded(arguments.mesh, [&] { return bake_file(arguments); });
  });
}

}  // namespace vps::cli
