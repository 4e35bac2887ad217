// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake explain`: why an asset was baked or not, and whether it would be now.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_explain_command(CLI::App& app);

}  // namespace vps::cli
