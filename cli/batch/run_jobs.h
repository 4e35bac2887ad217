// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes the assets that are not up to date, several at once.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

struct RunOptions {
  unsigned jobs = 0;             ///< number of bakes at once. [Limits: 1 <= value]
  unsigned threads = 0;          ///< cores of each bake; 0: an equal share of the machine's
  std::size_t memory_bytes = 0;  ///< for all bakes together
  double timeout = 0;            ///< of each bake; 0: none. [s]
  std::string cache;             ///< folder; empty: none
  std::size_t cache_bytes = 0;   ///< its limit; 0: none
  bool dry_run = false;
  std::map<std::string, std::string> known_failures;  ///< by key, errors that a bake would only repeat
};

struct JobResult {
  enum class State { unchanged, baked, cached, copied, failed, not_started, would_bake };
  State state = State::failed;
  std::vector<std::string> reasons;  ///< to bake it
  std::string key;                   ///< of the cache; empty when the mesh cannot be read or understood
  std::string error;                 ///< with failed and not_started: "reason; what to do"
  int code = 0;                      ///< with these two: the exit code of a single bake
  bool known = false;                ///< with failed: it is one of the known failures, and was not tried again
  std::vector<std::string> notes;    ///< of the bake
  std::size_t bytes = 0;             ///< of the asset; in a dry run an upper bound
  std::size_t memory_bytes = 0;      ///< peak; in a dry run the prediction
  double seconds = 0;
};

/// "unchanged", "baked" and so on.
[[nodiscard]] const char* describe(JobResult::State state);

/// Callbacks during a run. Called by one thread at a time.
struct Observer {
  std::function<void(const Job&)> began;
  std::function<void(const Job&, const JobResult&)> ended;
  /// Each warning once, with the first mesh that has it.
  std::function<void(const Job& job, const std::string& line)> warned;
};

/// Results in the order of the jobs. A mesh that two jobs bake with the same settings is baked once. Assets that are up
/// to date are not touched.
/// @param stop  when it becomes true, running bakes are killed and no other bake is begun
[[nodiscard]] std::vector<JobResult> run_jobs(const std::vector<Job>& jobs, const RunOptions& options,
                                              const Observer& observer, const std::atomic<bool>& stop);

}  // namespace vps::cli::batch
