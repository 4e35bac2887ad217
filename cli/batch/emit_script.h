// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The script that runs the shares of a jobs file on an engine.
#pragma once

#include <cstddef>
#include <string>

namespace vps::cli::batch {

struct ScriptOptions {
  std::string engine;     ///< slurm, snakemake or parallel
  std::string file;       ///< jobs.jsonl; the script stands beside it
  std::size_t tasks = 1;  ///< number of shares
  std::string cache;      ///< empty: none
  std::string memory;     ///< of a task, as given; empty: the engine's default
};

/// Name of the script beside the jobs file.
[[nodiscard]] std::string script_name(const ScriptOptions& options);

[[nodiscard]] std::string script_text(const ScriptOptions& options);

/// The first bytes of every script for the engine.
[[nodiscard]] std::string script_beginning(const ScriptOptions& options);

/// The command that starts the script, for people.
[[nodiscard]] std::string start_line(const ScriptOptions& options);

}  // namespace vps::cli::batch
