// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake info FILE`: prints what an asset holds.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_info_command(CLI::App& app);

}  // namespace vps::cli
