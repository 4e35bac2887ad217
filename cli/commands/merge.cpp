// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>
#include <set>

#include "cli/batch/jobs_file.h"
#include "cli/batch/manifest.h"
#include "cli/commands/batch.h"
#include "cli/commands/commands.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/provenance.h"
#include "cli/tools/utf8.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using namespace batch;

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
  const std::size_t there = jobs.size() - manifest.missing.size();
  print_lines("{}: {} asset{}, {} missing\n", one_line((folder / kManifest).string()), there, there == 1 ? "" : "s",
              manifest.missing.size());
  return manifest.missing.empty() ? kOk : kSomeFailed;
}

}  // namespace

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
