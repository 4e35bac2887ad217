// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake plan`: bakes as lines of a file, for other machines to do.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_plan_command(CLI::App& app);

}  // namespace vps::cli
