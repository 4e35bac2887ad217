// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shared by the commands on folders of meshes.
#pragma once

#include <functional>

#include "cli/batch/find_jobs.h"
#include "cli/terminal/options.h"

namespace vps::cli {

/// Adds options for paths and globs, and those of bakes. It leaves `inputs.options` empty: fill it with `given_options`
/// after parsing.
/// @param scratch  receives the values of bake options, only to check them
void add_input_options(CLI::App& app, batch::Inputs& inputs, BakeArguments& scratch);

/// The bake options that were given to a command. @pre add_bake_options was called on it, and it was parsed
[[nodiscard]] batch::OptionTexts given_options(const CLI::App& app);

/// Reads the options of a batch as those of `vpsbake MESH`.
[[nodiscard]] const batch::OptionReader& option_reader();

/// Prints a note for each glob of a vpsbake.toml that matches no mesh.
void note_idle(const batch::SettingsRead& read);

/// Runs `work`, and turns an error in the inputs or options into one line on stderr and an exit code.
[[nodiscard]] int guarded_batch(const std::function<int()>& work);

}  // namespace vps::cli
