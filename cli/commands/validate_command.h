// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake validate FILE...`: checks assets, against their mesh too.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_validate_command(CLI::App& app);

}  // namespace vps::cli
