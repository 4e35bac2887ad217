// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "cli/batch/jobs_file.h"
#include "cli/commands/batch.h"
#include "cli/commands/commands.h"
#include "cli/commands/play.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"

namespace vps::cli {
namespace {

using namespace batch;

struct RunArguments {
  std::string file, share;
  std::size_t task = 0;
  PlayArguments play;
};

std::vector<Job> chosen_jobs(const RunArguments& arguments) {
  std::vector<Job> jobs = read_jobs(arguments.file, option_reader());
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
  print_lines("no job in share {}\n", arguments.share);
  return kOk;
}

}  // namespace

Command add_run_command(CLI::App& app) {
  CLI::App* const run = app.add_subcommand("run", "Bake the jobs of a file that plan wrote, or a part of them");
  const auto arguments = std::make_shared<RunArguments>();
  run->add_option("JOBS.jsonl", arguments->file, "File that vpsbake plan wrote; - is standard input")->required();
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
  return {run,
          [arguments, run] {
            return guarded_batch([&] {
              read_cache_size(*run, arguments->play.run.cache_bytes);
              return run_share(*arguments);
            });
          },
          true};
}

}  // namespace vps::cli
