// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a batch did, for people, programs and CI.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/batch/job.h"
#include "cli/batch/run_jobs.h"

namespace vps::cli::batch {

/// A line for each job that is not unchanged, with its reason in a dry run, and a line that counts.
/// @param seconds  that all took together
[[nodiscard]] std::string to_table(const std::vector<Job>& jobs, const std::vector<JobResult>& results, double seconds);

/// docs/schemas/batch.schema.json
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<Job>& jobs, const std::vector<JobResult>& results);

/// JUnit XML: a test case for each job.
[[nodiscard]] std::string to_junit(const std::vector<Job>& jobs, const std::vector<JobResult>& results);

/// What the last batch did, in its folder of assets, for `vpsbake explain`: `to_json`, and `cwd`, from where its paths
/// go.
inline constexpr const char* kLog = ".vpsbake-run.json";

[[nodiscard]] bool any_failed(const std::vector<JobResult>& results);

}  // namespace vps::cli::batch
