// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads and writes jobs.jsonl: one bake per line, for other machines. docs/schemas/job.schema.json
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

/// Gives a refusal to jobs whose names are not UTF-8, which no line can hold.
void refuse_unwritable(std::vector<Job>& jobs);

/// The lines of the file. Paths are relative to its folder, where meshes and assets are in the same tree.
[[nodiscard]] std::string to_lines(const std::vector<Job>& jobs, const std::filesystem::path& file);

/// @throw BatchError with the line
[[nodiscard]] std::vector<Job> read_jobs(const std::filesystem::path& file, const OptionReader& reader);

/// The jobs of share i of n, 1 <= i <= n: i, i + n, i + 2 n and so on.
[[nodiscard]] std::vector<Job> share_of(const std::vector<Job>& jobs, std::size_t i, std::size_t n);

}  // namespace vps::cli::batch
