// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake batch`, and `run` and `merge`, which do a part of it each: folders of meshes to folders of assets.
#pragma once

#include <functional>

#include "cli/batch/find_jobs.h"
#include "cli/terminal/options.h"

namespace vps::cli {

/// Paths, globs and the options of bakes. `inputs.options` is for `batch::given_options`, after the command line is
/// read.
/// @param scratch  where the options are checked
void add_input_options(CLI::App& app, batch::Inputs& inputs, BakeArguments& scratch);

/// Turns what is thrown before anything is baked into one line and an exit code.
[[nodiscard]] int guarded_batch(const std::function<int()>& work);

[[nodiscard]] Command add_batch_command(CLI::App& app);
[[nodiscard]] Command add_run_command(CLI::App& app);
[[nodiscard]] Command add_merge_command(CLI::App& app);

}  // namespace vps::cli
