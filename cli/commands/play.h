// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A batch with its progress, warnings and table: what the commands batch and run have in common.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/batch/run_jobs.h"
#include "cli/terminal/options.h"

namespace vps::cli {

struct PlayArguments {
  batch::RunOptions run;
  std::string junit, log;        ///< files; empty: none
  nlohmann::ordered_json asked;  ///< goes into the log: from what jobs are found again
  bool json = false;
};

/// --dry-run, --jobs, --threads, --memory, --timeout, those of add_cache_options, --json, --junit.
void add_play_options(CLI::App& app, PlayArguments& arguments);

struct Played {
  int code = 0;                           ///< kOk, kSomeFailed or kIo
  std::vector<batch::JobResult> results;  ///< empty: nothing was done
  double seconds = 0;
};

/// Bakes, says what goes wrong, and writes the files. SIGINT and SIGTERM stop it in an orderly way.
[[nodiscard]] Played play(const std::vector<batch::Job>& jobs, PlayArguments arguments);

/// The table or JSON, after all files: nobody may read it.
void print_played(const std::vector<batch::Job>& jobs, const Played& played, bool json);

}  // namespace vps::cli
