// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/play.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <thread>

#include "cli/batch/memory_budget.h"
#include "cli/batch/report.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/options.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/junit.h"
#include "cli/tools/output_file.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using namespace batch;
using Clock = std::chrono::steady_clock;

std::atomic<bool> stop_all = false;

void stop_at_signal(int) {
  stop_all = true;
}

// Shows the running bakes on one line of a terminal.
class ProgressLine {
 public:
  ProgressLine(std::size_t count, Verbosity verbosity) : progress_(verbosity), count_(count) {}
  void began(const Job& job) { running_.push_back(&job), show(); }
  void ended(const Job& job) {
    std::erase(running_, &job);
    ++done_;
    show();
  }
  void clear() const { progress_.clear(); }

 private:
  void show() const {
    std::string names;
    for (const Job* job : running_) names += (names.empty() ? "" : ", ") + job->mesh.filename().string();
    progress_.show(fmt::format("[{}/{}] {}", done_, count_, one_line(names)), double(done_) / double(count_));
  }
  Progress progress_;
  std::size_t count_, done_ = 0;
  std::vector<const Job*> running_;
};

bool has_default_grid(const Job& job) {
  return job.refusal.empty() &&
         job.options.count("voxel") + job.options.count("resolution") + job.options.count("max-error") == 0;
}

}  // namespace

void add_play_options(CLI::App& app, PlayArguments& arguments) {
  constexpr const char* kGroup = "Running";
  app.add_flag("--dry-run", arguments.run.dry_run, "Say what would be baked, why, and how large; bake nothing")
      ->group(kGroup);
  add_integer(app, "--jobs", arguments.run.jobs, 1, 1024, "Bakes at once, 1 to 1024 [default: processor cores]")
      ->option_text("N")
      ->group(kGroup);
  add_integer(app, "--threads", arguments.run.threads, 1, 1024,
              "Processor cores of each bake, 1 to 1024 [default: all cores, shared out]")
      ->option_text("N")
      ->group(kGroup);
  add_text_option(
      app, "--memory", [&](const std::string& text) { arguments.run.memory_bytes = parse_size(text); },
      "Memory for all bakes together, such as 12GB; what fits is baked at once [default: nine tenths of what is "
      "free]")
      ->option_text("SIZE")
      ->group(kGroup);
  add_text_option(
      app, "--timeout", [&](const std::string& text) { arguments.run.timeout = parse_time(text); },
      "Give up a bake after this, such as 90s or 10min [default: never]")
      ->option_text("TIME")
      ->group(kGroup);
  add_cache_options(app, arguments.run.cache, arguments.run.cache_bytes, kGroup);
  add_verbosity_options(app, arguments.verbosity, "Print errors and warnings only", "List what was up to date, too");
  app.add_flag("--json", arguments.json, "Print what was done as JSON")->group("Reports");
  app.add_option("--junit", arguments.junit, "Write JUnit XML, for CI; - is standard output")
      ->check(not_empty())
      ->option_text("FILE")
      ->group("Reports");
}

Played play(const std::vector<Job>& jobs, PlayArguments arguments) {
  RunOptions& run = arguments.run;
  if (run.jobs == 0) run.jobs = std::max(1U, std::thread::hardware_concurrency());
  if (run.memory_bytes == 0) run.memory_bytes = available_memory();
  if (arguments.json && is_standard_stream(arguments.junit))
    return {fail(kCommandLine, "command line", "--json and --junit - both go to standard output; choose one"), {}, 0};
  if (!arguments.junit.empty()) {
    const fs::path name = fs::path(arguments.junit).filename();
    for (const Job& job : jobs) {
      if (job.asset().filename() == name && is_same_place(job.asset(), arguments.junit))
        return {fail(kIo, arguments.junit, "this is an asset; choose another --junit"), {}, 0};
    }
    if (const std::string reason = output_refusal(arguments.junit, kJUnitBeginning, "a JUnit report"); !reason.empty())
      return {fail(kIo, arguments.junit, reason), {}, 0};
  }
  // A signal that is ignored, as under nohup, stays ignored.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(signal, stop_at_signal) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
  const auto begin = Clock::now();
  ProgressLine line(jobs.size(), arguments.verbosity);
  Observer observer;
  observer.began = [&](const Job& job) { line.began(job); };
  observer.ended = [&](const Job& job, const JobResult& result) {
    if (result.state == JobResult::State::failed && !stop_all) {
      line.clear();
      complain("error", job.mesh.string(), result.error);
    }
    line.ended(job);
  };
  observer.warned = [&](const Job& job, const std::string& text) {
    line.clear();
    complain("warning", job.mesh.string(), text);
  };
  if (arguments.verbosity != Verbosity::quiet && std::any_of(jobs.begin(), jobs.end(), has_default_grid)) {
    complain("note", "batch",
             "200 voxels along the longest side where no size is given; --voxel or --resolution sets it");
  }
  std::vector<JobResult> results = run_jobs(jobs, run, observer, stop_all);
  line.clear();
  if (stop_all) complain("error", "batch", "stopped; what is not baked is left for the next run");
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  int code = any_failed(results) ? kSomeFailed : kOk;
  if (!arguments.junit.empty() && !is_standard_stream(arguments.junit) &&
      write_quietly(arguments.junit, to_junit(jobs, results)) != kOk)
    code = kIo;
  if (!arguments.log.empty()) {
    nlohmann::ordered_json json = to_json(jobs, results);
    json.update(arguments.asked);
    json["cwd"] = fs::current_path().string();
    if (write_quietly(arguments.log, to_text(json)) != kOk) code = kIo;
  }
  return {code, std::move(results), seconds};
}

void print_played(const std::vector<Job>& jobs, const Played& played, const PlayArguments& arguments) {
  if (played.results.empty()) return;
  if (arguments.json) return fmt::print("{}", to_text(to_json(jobs, played.results)));
  if (is_standard_stream(arguments.junit)) fmt::print("{}", to_junit(jobs, played.results));
  if (arguments.verbosity == Verbosity::quiet) return;
  std::FILE* const file = messages_beside(arguments.junit);
  constexpr std::string_view kFailed = "FAILED";
  const TableRows rows = arguments.verbosity == Verbosity::verbose ? TableRows::all : TableRows::made;
  std::istringstream table(to_table(jobs, played.results, played.seconds, rows));
  for (std::string line; std::getline(table, line);) {
    if (const std::size_t failed = line.find(kFailed); failed != line.npos)
      line.replace(failed, kFailed.size(), painted(std::string(kFailed), TextColour::red, ::fileno(file)));
    print_lines(file, "{}\n", line);
  }
}

int play_and_print(const std::vector<Job>& jobs, const PlayArguments& arguments) {
  const Played played = play(jobs, arguments);
  print_played(jobs, played, arguments);
  return played.code;
}

}  // namespace vps::cli
