// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/run_jobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>

#include "cli/batch/child_program.h"
#include "cli/batch/memory_budget.h"
#include "cli/batch/reasons.h"
#include "cli/tools/exit_code.h"
#include "cli/tools/output_file.h"
#include "cli/tools/utf8.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using State = JobResult::State;

JobResult failure(int code, std::string error) {
  JobResult result;
  result.code = code;
  result.error = std::move(error);
  return result;
}

// @param result  what is known of the job
JobResult not_started(JobResult result) {
  result.state = State::not_started;
  result.code = kIo;
  result.error = "the batch was stopped before; run it again";
  return result;
}

// The first error, warning or note of a child, without the names of the program and of the file.
std::string complaint(const std::string& err, const std::string& kind, const std::string& file) {
  std::istringstream lines(err);
  const std::string start = "vpsbake: " + kind + ": ";
  const std::string name = one_line(file);  // as the child prints it
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(start)) continue;
    line.erase(0, start.size());
    if (line.starts_with(name + ": ")) line.erase(0, name.size() + 2);
    return line;
  }
  return {};
}

// Memory for reading a mesh, estimated from the sizes of its files. docs/batch.md has the measurements.
std::size_t import_memory(const fs::path& mesh, const ImportOptions& limits) {
  std::error_code failed;
  std::uintmax_t bytes = 0;
  for (const fs::path& file : bake::mesh_files(mesh)) {
    const std::uintmax_t size = fs::file_size(file, failed);
    if (!failed) bytes += size;
  }
  constexpr std::size_t kProgram = 100'000'000, kPerByte = 12;
  return std::min(kProgram + kPerByte * static_cast<std::size_t>(bytes), kProgram + limits.memory_limit_bytes);
}

// Memory that is set aside for a bake whose plan is unknown. [bytes]
constexpr std::size_t kSmallBake = 250'000'000;

class Runner {
 public:
  Runner(const std::vector<Job>& jobs, const RunOptions& options, const Observer& observer,
         const std::atomic<bool>& stop)
      : jobs_(jobs),
        options_(options),
        observer_(observer),
        stop_(stop),
        budget_(options.memory_bytes),
        results_(jobs.size()) {}

  std::vector<JobResult> run() {
    std::vector<std::thread> workers;
    const std::size_t count = std::min<std::size_t>(options_.jobs, jobs_.size());
    try {
      for (std::size_t i = 1; i < count; ++i) workers.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      // No more threads can be started. The present ones do all jobs.
    }
    work();
    for (std::thread& worker : workers) worker.join();
    return std::move(results_);
  }

 private:
  void work() {
    for (std::size_t i = next_++; i < jobs_.size(); i = next_++) {
      tell([&] { observer_.began(jobs_[i]); });
      std::vector<std::size_t> twins;
      if (!finish_job(i, twins)) continue;
      tell([&] { observer_.ended(jobs_[i], results_[i]); });
      for (const std::size_t twin : twins) {
        results_[twin] = *guarded([&] { return std::optional(copy_of(i, twin)); });
        tell([&] { observer_.ended(jobs_[twin], results_[twin]); });
      }
    }
  }

  template <class Call>
  void tell(const Call& call) {
    const std::lock_guard lock(observing_);
    call();
  }

  // An error of one job becomes its result.
  template <class Call>
  static std::optional<JobResult> guarded(const Call& call) {
    try {
      return call();
    } catch (const BatchError& error) {
      return failure(kBadInput, error.what());
    } catch (const fs::filesystem_error& error) {
      return failure(kIo, error.code().message() + "; free space or choose another folder");
    } catch (const std::bad_alloc&) {
      return failure(kInternal, "out of memory; bake fewer at once with --jobs");
    } catch (const std::exception& error) {
      return failure(kInternal, fmt::format("internal error: {}; please report it", error.what()));
    }
  }

  // False when the job waits for its twin: the worker that bakes the twin completes it.
  bool finish_job(std::size_t i, std::vector<std::size_t>& twins) {
    std::string key;
    std::optional<JobResult> result = guarded([&] { return run_job(i, key); });
    if (!result) return false;
    const std::lock_guard lock(planning_);
    results_[i] = std::move(*result);
    if (!key.empty()) {
      twins = std::move(waiting_[key]);
      finished_.insert(key);
    }
    return true;
  }

  // Nothing when another worker bakes the same asset: it completes this job, too.
  std::optional<JobResult> run_job(std::size_t i, std::string& key) {
    const Job& job = jobs_[i];
    if (stop_) return not_started({});
    if (!job.refusal.empty()) return failure(kBadInput, job.refusal);
    const Standing standing = compare_with_asset(job);
    JobResult result;
    result.reasons = standing.reasons;
    if (standing.wanted) result.key = bake::cache_key(*standing.wanted).digits;
    if (standing.reasons.empty()) {
      result.state = State::unchanged;
      result.bytes = fs::file_size(job.asset());
      const std::lock_guard lock(planning_);
      if (first_.try_emplace(result.key, i).second) key = result.key;  // its twins copy it
      return result;
    }
    if (const auto known = options_.known_failures.find(result.key); known != options_.known_failures.end()) {
      result.error = known->second;
      result.code = kBadInput;
      result.known = true;
      return result;
    }
    if (options_.dry_run && fs::exists(job.asset())) {
      if (const std::string refusal = asset_refusal(job.asset()); !refusal.empty()) return unwritable(job, refusal);
    }
    if (!result.key.empty()) {
      std::unique_lock lock(planning_);
      const auto [it, is_first] = first_.try_emplace(result.key, i);
      if (!is_first) {
        results_[i] = result;  // copy_of completes it
        const std::size_t first = it->second;
        if (finished_.count(result.key) == 0) {
          waiting_[result.key].push_back(i);
          return std::nullopt;
        }
        lock.unlock();
        return copy_of(first, i);
      }
    }
    key = result.key;
    if (!key.empty() && !options_.cache.empty() && take_from_cache(job, result)) return result;
    return bake(job, std::move(result));
  }

  bool take_from_cache(const Job& job, JobResult& result) const {
    Asset entry;
    bake::BakeReport report;
    if (!bake::AssetCache(options_.cache).open({result.key}, entry, report)) return false;
    result.bytes = entry.bytes().size();
    result.notes = report.notes;
    result.state = State::cached;
    if (!options_.dry_run) deliver(job, entry, result);
    return true;
  }

  static void deliver(const Job& job, const Asset& asset, JobResult& result) {
    std::string refusal = prepare(job.asset());
    try {
      if (refusal.empty()) write_whole(job.asset(), asset.bytes());
    } catch (const WriteError& error) {
      refusal = error.what();
    }
    if (!refusal.empty()) result = unwritable(job, refusal);
  }

  JobResult copy_of(std::size_t first, std::size_t twin) {
    JobResult result = results_[twin];
    const JobResult& done = results_[first];
    // The first asset could not be written, but this one may be.
    if (done.state == State::failed && done.code == kIo) return bake(jobs_[twin], std::move(result));
    result.notes = done.notes;
    result.code = done.code;
    if (done.state == State::failed) {
      result.state = State::failed;
      result.error = fmt::format("{} (as {}, the same mesh)", done.error, jobs_[first].mesh.string());
      return result;
    }
    result.bytes = done.bytes;
    result.state = options_.dry_run ? State::would_bake : State::copied;
    if (options_.dry_run) return result;
    Asset asset;
    if (Asset::open(jobs_[first].asset().c_str(), asset) != Status::ok)
      return failure(kIo, jobs_[first].asset().string() + " went away meanwhile; run the batch again");
    // The first one's mesh may have changed before it was baked.
    if (bake::cache_key(bake::record_of(asset)).digits != result.key) return bake(jobs_[twin], std::move(result));
    deliver(jobs_[twin], asset, result);
    return result;
  }

  // The line of a failure begins with the mesh.
  static JobResult unwritable(const Job& job, const std::string& reason) {
    return failure(kIo, fmt::format("{}: {}", job.asset().string(), reason));
  }

  static std::string prepare(const fs::path& output) {
    std::error_code failed;
    fs::create_directories(output.parent_path(), failed);
    if (failed)
      return fmt::format("the folder {} cannot be made ({}); choose another output", output.parent_path().string(),
                         failed.message());
    return asset_refusal(output);
  }

  // Whether the bake tries several voxel sizes. Their memory is known only during the search.
  static bool searches(const Job& job) { return job.options.count("max-error") > 0; }

  [[nodiscard]] std::vector<std::string> words_for(const Job& job) const {
    std::vector<std::string> words = {"--json", "--output=" + job.asset().string()};
    for (std::string& word : command_words(job.options)) words.push_back(std::move(word));
    words.push_back(fmt::format("--memory={}B", options_.memory_bytes));
    const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
    const unsigned share = std::max(1U, searches(job) ? cores : cores / options_.jobs);
    words.push_back(fmt::format("--threads={}", options_.threads > 0 ? options_.threads : share));
    words.insert(words.end(), {"--", job.mesh.string()});
    return words;
  }

  // @return the child's JSON, or why there is none in `result`
  std::optional<Json> ask(const Job& job, const std::vector<std::string>& words, JobResult& result) {
    constexpr double kLeast = 1e-3;  // a timeout of 0 would mean none. [s]
    const double left = options_.timeout > 0 ? std::max(kLeast, options_.timeout - result.seconds) : 0;
    const ProgramResult run = run_program(words, left, stop_);
    result.seconds += run.seconds;
    result.memory_bytes = std::max(result.memory_bytes, run.peak_memory_bytes);
    using End = ProgramResult::End;
    const std::string warning = complaint(run.err, "warning", job.mesh.string());
    if (!warning.empty()) {
      tell([&] {
        if (warnings_.insert(warning).second) observer_.warned(job, warning);
      });
      result.notes.push_back(warning);
    }
    std::string note = complaint(run.err, "note", job.mesh.string());
    if (!note.empty()) result.notes.push_back(std::move(note));
    result.state = State::failed;
    result.code = run.end == End::exited ? run.code : kInternal;
    switch (run.end) {
      case End::exited:
        if (run.code == 0) return Json::parse(run.out);
        result.error = complaint(run.err, "error", job.mesh.string());
        if (result.error.empty()) result.error = fmt::format("the bake ended with code {}; bake it alone", run.code);
        break;
      case End::killed:
        result.error =
            run.code == SIGKILL
                ? "the system killed the bake, most likely for want of memory; bake fewer at once with --jobs"
                : fmt::format("the bake crashed (signal {}); please report it", run.code);
        break;
      case End::timed_out:
        result.code = kBadInput;
        result.error = fmt::format("not baked in {:g} s; raise --timeout or choose larger voxels", options_.timeout);
        break;
      case End::stopped:
        result.state = State::not_started;  // nothing of it is left
        result.code = kIo;
        result.error = "stopped while it was baked; run the batch again";
        break;
      case End::cannot_start:
        result.error =
            fmt::format("no process can be started ({}); bake fewer at once with --jobs", std::strerror(run.code));
        break;
    }
    return std::nullopt;
  }

  JobResult bake(const Job& job, JobResult result) {
    if (stop_) return not_started(std::move(result));
    if (!options_.dry_run) {
      if (const std::string refusal = prepare(job.asset()); !refusal.empty()) return unwritable(job, refusal);
    }
    const std::vector<std::string> words = words_for(job);
    std::vector<std::string> bake_words = words;
    if (!options_.cache.empty() && options_.cache_bytes > 0)
      bake_words.insert(bake_words.begin(), fmt::format("--cache-size={}B", options_.cache_bytes));
    bake_words.insert(bake_words.begin(), options_.cache.empty() ? "--no-cache" : "--cache=" + options_.cache);
    std::size_t predicted = options_.memory_bytes;
    // A bake that runs alone refuses by itself what does not fit. The memory of a search for the voxel size is unknown
    // before the search.
    const bool alone = options_.jobs == 1 || searches(job);
    if (options_.dry_run || !alone) {
      const std::size_t bytes = alone ? options_.memory_bytes : import_memory(job.mesh, job.settings.import);
      // Most bakes are small. These need no plan before: they end with one if they are not small after all.
      const std::size_t small = std::min<std::size_t>(kSmallBake, options_.memory_bytes / options_.jobs);
      const bool at_once = !options_.dry_run && bytes <= small;
      std::vector<std::string> plan = at_once ? bake_words : words;
      plan.insert(plan.begin(), at_once ? fmt::format("--dry-run-above={}B", small) : "--dry-run");
      const MemoryBudget::Share share(budget_, at_once ? small : bytes);
      const auto said = ask(job, plan, result);
      if (!said) return result;
      if (said->contains("bytes")) return baked(*said, std::move(result));
      predicted = said->at("plan").at("predicted_memory_bytes");
      if (options_.dry_run) {
        result.state = State::would_bake;
        result.bytes = said->at("plan").at("predicted_asset_bytes");
        result.memory_bytes = predicted;
        return result;
      }
    }
    const MemoryBudget::Share share(budget_, predicted);
    const auto said = ask(job, bake_words, result);
    return said ? baked(*said, std::move(result)) : result;
  }

  static JobResult baked(const Json& said, JobResult result) {
    result.state = said.at("cache") == "hit" ? State::cached : State::baked;
    result.bytes = said.at("bytes");
    for (const Json& note : said.at("notes")) result.notes.push_back(note.get<std::string>());
    if (!result.key.empty()) return result;
    return failure(kBadInput, "its buffers cannot be told, nor when it is up to date; export it again, as UTF-8");
  }

  const std::vector<Job>& jobs_;
  const RunOptions& options_;
  const Observer& observer_;
  const std::atomic<bool>& stop_;
  MemoryBudget budget_;
  std::vector<JobResult> results_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex observing_, planning_;
  std::set<std::string> warnings_;
  std::map<std::string, std::size_t> first_;                 // by key: the job that bakes or has it
  std::map<std::string, std::vector<std::size_t>> waiting_;  // by key: jobs that wait for it
  std::set<std::string> finished_;
};

}  // namespace

const char* describe(State state) {
  switch (state) {
    case State::unchanged:
      return "unchanged";
    case State::baked:
      return "baked";
    case State::cached:
      return "from cache";
    case State::copied:
      return "copied";
    case State::failed:
      return "FAILED";
    case State::not_started:
      return "not started";
    case State::would_bake:
      return "to bake";
  }
  return "";
}

std::vector<JobResult> run_jobs(const std::vector<Job>& jobs, const RunOptions& options, const Observer& observer,
                                const std::atomic<bool>& stop) {
  return Runner(jobs, options, observer, stop).run();
}

}  // namespace vps::cli::batch
