// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

namespace vps::cli {

std::vector<Command> add_lab_commands(CLI::App&) {
  return {};
}

}  // namespace vps::cli
