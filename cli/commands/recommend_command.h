// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake recommend MESH`: the setting to bake with, and why.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

/// Exits with 3 when no setting keeps within the limits: the nearest is told.
[[nodiscard]] Command add_recommend_command(CLI::App& app);

}  // namespace vps::cli
