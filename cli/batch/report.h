// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reports the results of a batch, for people, programs and CI.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/batch/job.h"
#include "cli/batch/run_jobs.h"

namespace vps::cli::batch {

/// The rows of a table: assets that were made or would be, or those that were up to date, too.
enum class TableRows : std::uint8_t { made, all };

/// A line for each asset of these rows, with the reasons, a line with the counts, and one with the options
/// that would help those that failed. Errors are not repeated.
/// @param seconds  time of the whole batch
[[nodiscard]] std::string to_table(const std::vector<Job>& jobs, const std::vector<JobResult>& results, double seconds,
                                   TableRows rows = TableRows::made);

/// docs/schemas/batch.schema.json
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<Job>& jobs, const std::vector<JobResult>& results);

/// JUnit XML: a test case for each job.
[[nodiscard]] std::string to_junit(const std::vector<Job>& jobs, const std::vector<JobResult>& results);

/// Name of the last batch's log in its folder of assets, for `vpsbake explain`: the object of `to_json`, with `cwd`,
/// the folder that its paths are relative to.
inline constexpr const char* kLog = ".vpsbake-run.json";

/// The failures in a log that depend on mesh and settings alone, for RunOptions::known_failures: not those that more
/// memory or time may avoid. Empty when there is no log.
[[nodiscard]] std::map<std::string, std::string> known_failures(const std::filesystem::path& log);

/// Whether some failed or were not started.
[[nodiscard]] bool any_failed(const std::vector<JobResult>& results);

}  // namespace vps::cli::batch
