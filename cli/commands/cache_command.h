// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake cache stats|prune|verify`: looks after the folder of `--cache`.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_cache_command(CLI::App& app);

}  // namespace vps::cli
