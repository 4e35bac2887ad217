// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake slice ASSET`: a picture of the field across an axis.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_slice_command(CLI::App& app);

}  // namespace vps::cli
