// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake compare A B`: whether two assets are the same, and if not, by how much they differ.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_compare_command(CLI::App& app);

}  // namespace vps::cli
