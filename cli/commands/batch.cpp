// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

#include "bake/store/cache.h"
#include "cli/batch/jobs_file.h"
#include "cli/batch/manifest.h"
#include "cli/batch/report.h"
#include "cli/commands/commands.h"
#include "cli/commands/play.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/depfile.h"
#include "cli/tools/output_file.h"
#include "cli/tools/provenance.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using namespace batch;

struct BatchArguments {
  Inputs inputs;
  BakeArguments scratch;  // options are parsed into it only to check them; the bakes get them as texts
  PlayArguments play;
  std::string folder, depfile;
};

fs::path manifest_file(const BatchArguments& arguments) {
  return fs::path(arguments.folder) / kManifest;
}

// The files that the manifest depends on: meshes, the files they refer to, vpsbake.toml, and lists of meshes.
std::vector<fs::path> dependencies(const std::vector<Job>& jobs, const std::vector<fs::path>& settings) {
  std::vector<fs::path> files;
  for (const Job& job : jobs) {
    for (fs::path& file : bake::mesh_files(job.mesh)) files.push_back(std::move(file));
  }
  files.insert(files.end(), settings.begin(), settings.end());
  return files;
}

int finish_batch(const BatchArguments& arguments, std::vector<Job> jobs, const std::vector<JobResult>& results,
                 const std::vector<fs::path>& files) {
  const fs::path folder = arguments.folder;
  for (const std::string& name : left_over(folder, jobs))
    complain("note", (folder / name).string(), "an earlier batch baked this asset, this one does not");
  // A failed job counts as missing, even where an older asset is left.
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].state == JobResult::State::failed) jobs[i].refusal = results[i].error;
  }
  try {
    write_manifest(folder, gather_manifest(folder, jobs));
  } catch (const WriteError& error) {
    return fail(kIo, manifest_file(arguments).string(), error.what());
  }
  if (arguments.depfile.empty()) return kOk;
  return write_quietly(arguments.depfile, depfile_text(manifest_file(arguments), files));
}

int play_and_print(const std::vector<Job>& jobs, const PlayArguments& arguments) {
  const Played played = play(jobs, arguments);
  print_played(jobs, played, arguments.json);
  return played.code;
}

int run_batch(BatchArguments& arguments) {
  const fs::path folder = arguments.folder;
  arguments.inputs.folder = folder;
  std::vector<fs::path> settings;
  const std::vector<Job> jobs = find_jobs(arguments.inputs, option_reader(), &settings);
  if (arguments.play.run.dry_run) return play_and_print(jobs, arguments.play);
  if (const std::string reason = manifest_refusal(folder); !reason.empty())
    return fail(kIo, manifest_file(arguments).string(), reason);
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed)
    return fail(kIo, folder.string(), fmt::format("the folder cannot be made ({}); choose another", failed.message()));
  arguments.play.log = (folder / kLog).string();
  std::vector<fs::path> files;
  if (!arguments.depfile.empty()) {
    files = dependencies(jobs, settings);
    std::vector<fs::path> written = {manifest_file(arguments), arguments.play.log, arguments.play.junit};
    for (const Job& job : jobs) written.push_back(job.asset());
    const std::string reason = depfile_refusal(arguments.depfile, written, files);
    if (!reason.empty()) return fail(kIo, arguments.depfile, reason);
  }
  arguments.play.asked["asked"] = to_json(arguments.inputs);
  const Played played = play(jobs, arguments.play);
  if (played.results.empty()) return played.code;
  const int code = finish_batch(arguments, jobs, played.results, files);
  print_played(jobs, played, arguments.play.json);
  return code == kOk ? played.code : code;
}

struct RunArguments {
  std::string file, share;
  std::size_t task = 0;
  PlayArguments play;
};

std::vector<Job> chosen_jobs(const RunArguments& arguments) {
  const std::vector<Job> jobs = read_jobs(arguments.file, option_reader());
  if (arguments.task > 0) {
    if (arguments.task > jobs.size())
      throw BatchError(arguments.file, fmt::format("there is no job {}; it has {}", arguments.task, jobs.size()));
    return {jobs[arguments.task - 1]};
  }
  if (arguments.share.empty()) return jobs;
  std::size_t i = 0, n = 0;
  int used = 0;
  if (std::sscanf(arguments.share.c_str(), "%8zu/%8zu%n", &i, &n, &used) != 2 ||
      static_cast<std::size_t>(used) != arguments.share.size() || i < 1 || i > n)
    throw UsageError("--shard takes i/n with 1 <= i <= n, such as 3/100, not '" + arguments.share + "'");
  return share_of(jobs, i, n);
}

int run_share(const RunArguments& arguments) {
  const std::vector<Job> jobs = chosen_jobs(arguments);
  if (!jobs.empty()) return play_and_print(jobs, arguments.play);
  fmt::print("no job in share {}\n", arguments.share);
  return kOk;
}

// The folder that all jobs write to.
fs::path common_folder(const std::string& file, const std::vector<Job>& jobs) {
  for (const Job& job : jobs) {
    if (job.folder != jobs.front().folder)
      throw BatchError(file, "its jobs write to several folders; make one file for each");
  }
  return jobs.front().folder;
}

int run_merge(const std::string& file, Checking checking) {
  const std::vector<Job> jobs = read_jobs(file, option_reader());
  const fs::path folder = common_folder(file, jobs);
  const std::string reason = manifest_refusal(folder);
  if (!reason.empty()) return fail(kIo, (folder / kManifest).string(), reason);
  const Manifest manifest = gather_manifest(folder, jobs, checking);
  try {
    write_manifest(folder, manifest);
  } catch (const WriteError& error) {
    return fail(kIo, (folder / kManifest).string(), error.what());
  }
  constexpr std::size_t kNamed = 20;
  std::size_t named = 0;
  const std::set<std::string> missing(manifest.missing.begin(), manifest.missing.end());
  for (std::size_t i = 0; i < jobs.size() && named < kNamed; ++i) {
    if (missing.count(jobs[i].output) == 0) continue;
    ++named;
    complain("error", jobs[i].asset().string(),
             !jobs[i].refusal.empty()
                 ? jobs[i].refusal
                 : fmt::format("it is not there or not what was planned; bake it with vpsbake run {} --task {}",
                               quoted_word(file), i + 1));
  }
  if (manifest.missing.size() > kNamed)
    complain("error", file, fmt::format("and {} more are missing", manifest.missing.size() - kNamed));
  fmt::print("{}: {} assets, {} missing\n", (folder / kManifest).string(), jobs.size() - manifest.missing.size(),
             manifest.missing.size());
  return manifest.missing.empty() ? kOk : kSomeFailed;
}

}  // namespace

Command add_batch_command(CLI::App& app) {
  CLI::App* const batch = app.add_subcommand(
      "batch", "Bake folders of meshes; what is up to date is left alone; exit code 5 when some fail");
  const auto arguments = std::make_shared<BatchArguments>();
  BatchArguments& a = *arguments;
  add_input_options(*batch, a.inputs, a.scratch);
  batch->add_option("-o,--output", a.folder, "Folder of the assets, made when missing")
      ->required()
      ->check(not_empty())
      ->option_text("DIR")
      ->group("Output");
  add_play_options(*batch, a.play);
  batch
      ->add_option("--depfile", a.depfile,
                   "Write what the assets depend on, for make and ninja; the target is vpsbake.json "
                   "in the folder of assets")
      ->check(not_empty())
      ->excludes(batch->get_option("--dry-run"))
      ->option_text("FILE")
      ->group("Output");
  batch->footer(
      "Settings come from the command line, and from vpsbake.toml beside the meshes: the nearest to a mesh wins.\n"
      "Example: vpsbake batch meshes -o assets --voxel 5mm --cache ~/.cache/vpsbake --junit bake.xml");
  return {batch, [arguments, batch] {
            arguments->inputs.options = given_options(*batch);
            return guarded_batch([&] {
              read_cache_size(*batch, arguments->play.run.cache_bytes);
              return run_batch(*arguments);
            });
          }};
}

Command add_run_command(CLI::App& app) {
  CLI::App* const run = app.add_subcommand("run", "Bake the jobs of a file that plan wrote, or a part of them");
  const auto arguments = std::make_shared<RunArguments>();
  run->add_option("JOBS.jsonl", arguments->file, "File that vpsbake plan wrote")->required();
  auto* const task = add_integer(*run, "--task", arguments->task, 1, 99999999,
                                 "Only the job of this number, counted from 1 to 99999999");
  task->option_text("N")->group("Which jobs");
  run->add_option("--shard", arguments->share, "Only the jobs of share i of n: i, i + n, i + 2 n and so on")
      ->excludes(task)
      ->check(not_empty())
      ->option_text("i/n")
      ->group("Which jobs");
  add_play_options(*run, arguments->play);
  run->footer("Example: vpsbake run jobs.jsonl --shard 1/4");
  return {run, [arguments, run] {
            return guarded_batch([&] {
              read_cache_size(*run, arguments->play.run.cache_bytes);
              return run_share(*arguments);
            });
          }};
}

Command add_merge_command(CLI::App& app) {
  CLI::App* const merge =
      app.add_subcommand("merge", "Write the manifest of what jobs have baked; exit code 5 when some are missing");
  const auto file = std::make_shared<std::string>();
  merge->add_option("JOBS.jsonl", *file, "File that vpsbake plan wrote")->required();
  merge->footer("Example: vpsbake merge jobs.jsonl");
  const auto checking = std::make_shared<Checking>(Checking::header);
  merge->add_flag_callback(
      "--verify", [checking] { *checking = Checking::everything; },
      "Read all of every asset and compare its hashes [default: sizes and headers]");
  return {merge, [=] { return guarded_batch([&] { return run_merge(*file, *checking); }); }};
}

}  // namespace vps::cli
