// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One bake of a batch as data, shared by the commands batch, plan, run, merge and explain.
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

/// Options of a bake as on its command line, without dashes: key "voxel", value "5mm".
using OptionTexts = std::map<std::string, std::string>;

/// Reads options like the command line, which provides this: the library itself knows no option.
struct OptionReader {
  std::vector<std::string> names;                                  ///< all names of options, the most usual first
  std::function<bake::BakeSettings(const OptionTexts&)> settings;  ///< @throw UsageError
};

struct Job {
  std::filesystem::path mesh;
  std::filesystem::path folder;  ///< for all assets of the batch
  std::string output;            ///< the asset's path below `folder`, with slashes
  OptionTexts options;
  bake::BakeSettings settings;  ///< read from `options`; not set where there is a refusal
  std::string refusal;          ///< why it cannot be baked, known before the bake; empty otherwise
  [[nodiscard]] std::filesystem::path asset() const { return folder / output; }
};

/// Arguments of `vpsbake` for these options, each as --name=value.
[[nodiscard]] std::vector<std::string> command_words(const OptionTexts& options);

/// Reads the settings from a job's options. @throw BatchError with the job's mesh
[[nodiscard]] bake::BakeSettings read_settings(const Job& job, const OptionReader& reader);

/// A file's path relative to a folder. Links to folders are followed, but not a link that is the file itself.
[[nodiscard]] std::string path_from(const std::filesystem::path& file, const std::filesystem::path& folder);

}  // namespace vps::cli::batch
