// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "cli/commands/commands.h"
#include "cli/terminal/command_tree.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/suggest.h"
#include "cli/tools/provenance.h"

namespace vps::cli {

Command add_help_command(CLI::App& app) {
  CLI::App* const help = app.add_subcommand("help", "Print the help of the program or of a command");
  const auto words = std::make_shared<std::vector<std::string>>();
  help->add_option("COMMAND", *words, "Command, such as batch, or cache stats");
  help->footer("Example: vpsbake help batch");
  return {help, [words, &app] {
            const CLI::App* named = &app;
            for (const std::string& word : *words) {
              const auto found = named->get_subcommands([&](const CLI::App* one) { return one->get_name() == word; });
              if (found.empty()) return fail(kCommandLine, "command line", unknown_command(*named, word));
              named = found.front();
            }
            fmt::print("{}", named->get_formatter()->make_help(named, full_name(*named), CLI::AppFormatMode::Normal));
            return int{kOk};
          }};
}

Command add_version_command(CLI::App& app) {
  CLI::App* const version = app.add_subcommand("version", "Print the versions of the program and of its libraries");
  version->footer("Example: vpsbake version | head -n 1");
  return {version, [] {
            fmt::print("{}\n", version_text());
            return int{kOk};
          }};
}

}  // namespace vps::cli
