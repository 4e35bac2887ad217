// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake export ASSET --to FORMAT`: an asset for other programs.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_export_command(CLI::App& app);

}  // namespace vps::cli
