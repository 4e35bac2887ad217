// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What the commands on folders of meshes have in common.
#pragma once

#include <functional>

#include "cli/batch/find_jobs.h"
#include "cli/terminal/options.h"

namespace vps::cli {

/// Paths, globs and the options of bakes. `inputs.options` is for `given_options`, after the command line is
/// read.
/// @param scratch  where the options are checked
void add_input_options(CLI::App& app, batch::Inputs& inputs, BakeArguments& scratch);

/// The options of bakes that were given to a command. @pre add_bake_options was called on it, and it was parsed
[[nodiscard]] batch::OptionTexts given_options(const CLI::App& app);

/// Reads the options of a batch as those of `vpsbake MESH`.
[[nodiscard]] const batch::OptionReader& option_reader();

/// Turns what is thrown before anything is baked into one line and an exit code.
[[nodiscard]] int guarded_batch(const std::function<int()>& work);

}  // namespace vps::cli
