// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One bake of a batch, as data: what the commands batch, plan, run, merge and explain hand to each other.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "bake/store/cache.h"
#include "cli/terminal/units.h"
#include "cli/tools/exit_code.h"

namespace vps::cli::batch {

/// A folder, a list or a job that cannot be used. `what()` is "reason; what to do".
struct BatchError : std::runtime_error {
  std::string file;
  ExitCode code;
  BatchError(std::string file_in, const std::string& message, ExitCode code_in = kBadInput)
      : std::runtime_error(message), file(std::move(file_in)), code(code_in) {}
};

/// Options of a bake as on its command line, without dashes: "voxel" to "5mm".
using OptionTexts = std::map<std::string, std::string>;

/// Understands options as the command line does, which hands this in: the library knows none of them.
struct OptionReader {
  std::vector<std::string> names;                                  ///< that options may have, the most usual first
  std::function<bake::BakeSettings(const OptionTexts&)> settings;  ///< @throw UsageError
};

struct Job {
  std::filesystem::path mesh;
  std::filesystem::path folder;  ///< of the whole batch's assets
  std::string output;            ///< the asset below `folder`, with slashes
  OptionTexts options;
  bake::BakeSettings settings;  ///< what `options` decide; not read where there is a refusal
  std::string refusal;          ///< why it cannot be baked, known before the bake; empty otherwise
  [[nodiscard]] std::filesystem::path asset() const { return folder / output; }
};

/// Arguments of `vpsbake` for these options, each as --name=value.
[[nodiscard]] std::vector<std::string> command_words(const OptionTexts& options);

/// What a job's options decide. @throw BatchError naming the job's mesh
[[nodiscard]] bake::BakeSettings read_settings(const Job& job, const OptionReader& reader);

/// A file's path from a folder; links in the way are followed, but not that of the file itself.
[[nodiscard]] std::string path_from(const std::filesystem::path& file, const std::filesystem::path& folder);

}  // namespace vps::cli::batch
