// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes what is not up to date, several at once.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

struct RunOptions {
  unsigned jobs = 0;             ///< at once. [Limits: 1 <= value]
  unsigned threads = 0;          ///< cores of each; 0: the machine's, shared out
  std::size_t memory_bytes = 0;  ///< for all of them together
  double timeout = 0;            ///< of each; 0: none. [s]
  std::string cache;             ///< folder; empty: none
  std::size_t cache_bytes = 0;   ///< its limit; 0: none
  bool dry_run = false;
};

struct JobResult {
  enum class State { unchanged, baked, cached, copied, failed, would_bake };
  State state = State::failed;
  std::vector<std::string> reasons;  ///< to bake
  std::string key;                   ///< of the cache; empty when the mesh cannot be read
  std::string error;                 ///< with failed: "reason; what to do"
  int code = 0;                      ///< with failed: the exit code that a bake alone would have
  std::vector<std::string> notes;    ///< of the bake
  std::size_t bytes = 0;             ///< of the asset; in a dry run at most
  std::size_t memory_bytes = 0;      ///< peak; in a dry run predicted
  double seconds = 0;
};

/// "unchanged", "baked" and so on.
[[nodiscard]] const char* describe(JobResult::State state);

/// What happens meanwhile. Called by one thread at a time.
struct Observer {
  std::function<void(const Job&)> began;
  std::function<void(const Job&, const JobResult&)> ended;
  std::function<void(const std::string& line)> warned;  ///< each warning once
};

/// Results in the order of the jobs. A mesh that two jobs bake with the same settings is baked once. No asset is
/// touched that is up to date.
/// @param stop  when it becomes true, what runs is killed and what is left is not begun
[[nodiscard]] std::vector<JobResult> run_jobs(const std::vector<Job>& jobs, const RunOptions& options,
                                              const Observer& observer, const std::atomic<bool>& stop);

}  // namespace vps::cli::batch
