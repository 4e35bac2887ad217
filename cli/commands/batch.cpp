// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/batch.h"

#include <fmt/format.h>

#include <memory>

#include "bake/store/cache.h"
#include "cli/batch/manifest.h"
#include "cli/batch/report.h"
#include "cli/commands/commands.h"
#include "cli/commands/play.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/depfile.h"
#include "cli/tools/output_file.h"
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
    if (arguments.play.verbosity != Verbosity::quiet)
      complain("note", (folder / name).string(), "an earlier batch baked this asset, this one does not");
  // A job that failed or was not started counts as missing, even where an older asset is left.
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i].error.empty()) jobs[i].refusal = results[i].error;
  }
  try {
    write_manifest(folder, gather_manifest(folder, jobs));
  } catch (const WriteError& error) {
    return fail(kIo, manifest_file(arguments).string(), error.what());
  }
  if (arguments.depfile.empty()) return kOk;
  return write_quietly(arguments.depfile, depfile_text(manifest_file(arguments), files));
}

int run_batch(BatchArguments& arguments) {
  const fs::path folder = arguments.folder;
  arguments.inputs.folder = folder;
  SettingsRead settings;
  const std::vector<Job> jobs = find_jobs(arguments.inputs, option_reader(), &settings);
  if (arguments.play.verbosity != Verbosity::quiet) note_idle(settings);
  arguments.play.run.known_failures = known_failures(folder / kLog);
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
    files = dependencies(jobs, settings.files);
    std::vector<fs::path> written = {manifest_file(arguments), arguments.play.log, arguments.play.junit};
    for (const Job& job : jobs) written.push_back(job.asset());
    const std::string reason = depfile_refusal(arguments.depfile, written, files);
    if (!reason.empty()) return fail(kIo, arguments.depfile, reason);
  }
  arguments.play.asked["asked"] = to_json(arguments.inputs);
  const Played played = play(jobs, arguments.play);
  if (played.results.empty()) return played.code;
  const int code = finish_batch(arguments, jobs, played.results, files);
  print_played(jobs, played, arguments.play);
  return code == kOk ? played.code : code;
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
      ->check(not_stream())
      ->option_text("DIR")
      ->group("Output");
  add_play_options(*batch, a.play);
  batch
      ->add_option("--depfile", a.depfile,
                   "Write what the assets depend on, for make and ninja; the target is vpsbake.json "
                   "in the folder of assets")
      ->check(not_stream())
      ->excludes(batch->get_option("--dry-run"))
      ->option_text("FILE")
      ->group("Output");
  batch->footer(
      "Settings come from the command line, and from vpsbake.toml beside the meshes: the nearest to a mesh wins.\n"
      "Example: vpsbake batch meshes -o assets --voxel 5mm --cache ~/.cache/vpsbake --junit bake.xml");
  return {batch,
          [arguments, batch] {
            arguments->inputs.options = given_options(*batch);
            return guarded_batch([&] {
              read_cache_size(*batch, arguments->play.run.cache_bytes);
              return run_batch(*arguments);
            });
          },
          true};
}

}  // namespace vps::cli
