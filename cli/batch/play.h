// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A batch with its progress, warnings and table: what the commands batch and run have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "cli/batch/run_jobs.h"

namespace vps::cli::batch {

struct PlayArguments {
  RunOptions run;
  std::string junit, log;  ///< files; empty: none
  bool json = false;
};

/// --jobs, --memory, --timeout, --cache, --no-cache, --json, --junit.
void add_play_options(CLI::App& app, PlayArguments& arguments);

/// Bakes, says what happens, and prints the table or JSON. SIGINT and SIGTERM stop it in an orderly way.
/// @return kOk, kSomeFailed or kIo
[[nodiscard]] int play(const std::vector<Job>& jobs, PlayArguments arguments);

}  // namespace vps::cli::batch
