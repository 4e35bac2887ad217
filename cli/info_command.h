// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake info FILE`: prints what an asset holds.
#pragma once

#include <string>

namespace vps::cli {

/// @return the exit code of the program
[[nodiscard]] int run_info(const std::string& path, bool json);

}  // namespace vps::cli
