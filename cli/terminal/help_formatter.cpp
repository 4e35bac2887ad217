// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/help_formatter.h"

#include <unistd.h>

#include <algorithm>

#include "cli/terminal/command_tree.h"
#include "cli/terminal/terminal.h"
#include "cli/terminal/wrapped.h"

namespace vps::cli {
namespace {

// Width of a line, and the column where descriptions begin.
struct Layout {
  std::size_t width = std::size_t(std::clamp(columns_of(STDOUT_FILENO), 40, 100));
  std::size_t column = width < 60 ? 8 : 28;
};

// A name and its description, which starts at a fixed column of this line or of the next.
std::string entry(const std::string& name, const std::string& text, const Layout& layout) {
  std::string out = "  " + name;
  if (text.empty()) return out + "\n";
  if (out.size() + 2 > layout.column) {
    out += "\n" + std::string(layout.column, ' ');
  } else {
    out.resize(layout.column, ' ');
  }
  return out + wrapped(text, layout.width, layout.column) + "\n";
}

std::string entry(const CLI::Option& option, const Layout& layout) {
  const std::string value = option.get_positional() ? "" : value_name(option);
  return entry(names_of(option) + (value.empty() ? "" : " ") + value, description_of(option), layout);
}

}  // namespace

std::string HelpFormatter::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode /*mode*/) const {
  const Layout layout;
  std::string out = wrapped(app->get_description(), layout.width, 0) + "\n\n";
  const char* begin = "Usage: ";
  for (const std::string& usage : usages(*app, name)) {
    out += begin + wrapped(usage, layout.width, 7) + "\n";
    begin = "       ";
  }
  if (const auto arguments = positionals(*app); !arguments.empty()) {
    out += "\nArguments:\n";
    for (const CLI::Option* const one : arguments) out += entry(*one, layout);
  }
  for (const OptionGroup& group : option_groups(*app)) {
    out += "\n" + group.title + ":\n";
    for (const CLI::Option* const option : group.options) out += entry(*option, layout);
  }
  if (const auto commands = commands_of(*app); !commands.empty()) {
    out += "\nCommands (" + name + " COMMAND --help says more):\n";
    for (const CLI::App* const one : commands) out += entry(one->get_name(), one->get_description(), layout);
  }
  const auto footer = footer_lines(*app);
  if (!footer.empty()) out += "\n";
  for (const std::string& line : footer) out += wrapped(line, layout.width, 2) + "\n";
  return out;
}

}  // namespace vps::cli
