// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One bake of a batch, as data: what the commands batch, plan, run, merge and explain hand to each other.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/terminal/bake_arguments.h"
#include "cli/terminal/exit_code.h"

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

struct Job {
  std::filesystem::path mesh;
  std::filesystem::path folder;  ///< of the whole batch's assets
  std::string output;            ///< the asset below `folder`, with slashes
  OptionTexts options;
  std::string refusal;  ///< why it cannot be baked, told before anything is; empty otherwise
  [[nodiscard]] std::filesystem::path asset() const { return folder / output; }
};

/// Arguments of `vpsbake` for these options, each as --name=value.
[[nodiscard]] std::vector<std::string> command_words(const OptionTexts& options);

/// The options as the program understands them. @throw BatchError naming the job's mesh
[[nodiscard]] BakeArguments bake_arguments(const Job& job);

/// What the options decide. @throw BatchError
[[nodiscard]] inline bake::BakeSettings bake_settings(const Job& job) {
  return complete_settings(bake_arguments(job));
}

/// Names that options may have, the most usual first.
[[nodiscard]] const std::vector<std::string>& option_names();

/// A file's path from a folder; links in the way are followed, but not that of the file itself.
[[nodiscard]] std::string path_from(const std::filesystem::path& file, const std::filesystem::path& folder);

/// The options of bakes that were given to a command. @pre add_bake_options was called on it, and it was parsed
[[nodiscard]] OptionTexts given_options(const CLI::App& app);

}  // namespace vps::cli::batch
