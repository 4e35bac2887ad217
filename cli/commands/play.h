// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs a batch with its progress, warnings and table, for the commands batch and run.
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
  nlohmann::ordered_json asked;  ///< goes into the log: inputs from which `explain` finds the jobs again
  bool json = false;
  Verbosity verbosity = Verbosity::usual;
};

/// Adds --dry-run, --jobs, --threads, --memory, --timeout, those of add_cache_options, --json, --junit, -q, -v.
void add_play_options(CLI::App& app, PlayArguments& arguments);

struct Played {
  int code = 0;                           ///< kOk, kSomeFailed or kIo
  std::vector<batch::JobResult> results;  ///< empty: nothing was done
  double seconds = 0;
};

/// Bakes, reports errors, and writes the JUnit report and the log. On SIGINT, SIGTERM and SIGHUP it kills the running
/// bakes, starts no more, and still writes both.
[[nodiscard]] Played play(const std::vector<batch::Job>& jobs, PlayArguments arguments);

/// Prints the table, JSON or JUnit XML. Call it after all files are written: standard output may be a closed pipe.
void print_played(const std::vector<batch::Job>& jobs, const Played& played, const PlayArguments& arguments);

/// Both. @return the exit code
[[nodiscard]] int play_and_print(const std::vector<batch::Job>& jobs, const PlayArguments& arguments);

}  // namespace vps::cli
