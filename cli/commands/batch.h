// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What `vpsbake batch` and `vpsbake plan` have in common.
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

}  // namespace vps::cli
