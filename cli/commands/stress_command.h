// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake stress ASSET...`: stability cases in Bullet and in a penalty loop, each with a limit and a verdict.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_stress_command(CLI::App& app);

}  // namespace vps::cli
