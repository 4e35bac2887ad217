// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake report MESH...`: error against run time, size and bake time, of ours and of others.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

/// Writes NAME.html, NAME.csv and NAME.json (docs/report.md), prints a short table and the Pareto front.
[[nodiscard]] Command add_report_command(CLI::App& app);

}  // namespace vps::cli
