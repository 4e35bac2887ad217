// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

namespace vps::cli {

std::vector<Command> add_lab_commands(CLI::App& app) {
  return {add_recommend_command(app), add_report_command(app), add_stress_command(app)};
}

}  // namespace vps::cli
