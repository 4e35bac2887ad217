// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake view ASSET`: a page that shows what an asset holds.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_view_command(CLI::App& app);

}  // namespace vps::cli
