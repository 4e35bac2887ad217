// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/man_page.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "cli/terminal/command_tree.h"
#include "cli/terminal/complain.h"
#include "version.h"

namespace vps::cli {
namespace {

constexpr std::string_view kExample = "Example: ";
constexpr std::string_view kExit = "Exit codes: ";

// Escapes a text for roff: a bare hyphen may print as another character, and a leading dot is a request.
std::string plain(const std::string& text) {
  std::string out = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) out += c == '-' ? "\\-" : c == '\\' ? "\\e" : std::string(1, c);
  return out;
}

std::string bold(const std::string& text) {
  return "\\fB" + plain(text) + "\\fR";
}

std::string heading(const CLI::Option& option) {
  const std::string value = value_name(option);
  if (option.get_positional()) return "\\fI" + plain(value) + "\\fR";
  std::string names = CLI::detail::find_and_replace(names_of(option), ", ", "\n");
  names = CLI::detail::find_and_replace(bold(names), "\n", "\\fR, \\fB");
  return names + (value.empty() ? "" : " \\fI" + plain(value) + "\\fR");
}

std::string man_entry(const CLI::Option& option) {
  return ".TP\n" + heading(option) + "\n" + plain(description_of(option)) + "\n";
}

std::string synopsis(const CLI::App& app) {
  const std::string name = full_name(app);
  std::string out = ".SH SYNOPSIS\n";
  for (const std::string& usage : usages(app, name)) {
    out += (out.ends_with("SYNOPSIS\n") ? "" : ".br\n") + bold(name) + plain(usage.substr(name.size())) + "\n";
  }
  return out;
}

std::string options(const CLI::App& app) {
  std::string out;
  if (const auto arguments = positionals(app); !arguments.empty()) {
    out += ".SH ARGUMENTS\n";
    for (const CLI::Option* const one : arguments) out += man_entry(*one);
  }
  out += ".SH OPTIONS\n";
  for (const OptionGroup& group : option_groups(app)) {
    if (group.title != "Options") out += ".SS " + plain(group.title) + "\n";
    for (const CLI::Option* const option : group.options) out += man_entry(*option);
  }
  return out;
}

std::string commands(const CLI::App& app) {
  std::string out;
  for (const CLI::App* const one : commands_of(app)) {
    out += ".TP\n.BR " + plain(page_name(*one)) + " (1)\n" + plain(one->get_description()) + "\n";
  }
  return out.empty() ? "" : ".SH COMMANDS\n" + out;
}

// The description, and the lines of the footer that are neither examples nor exit codes.
std::string description(const CLI::App& app) {
  std::string out = ".SH DESCRIPTION\n" + plain(app.get_description()) + ".\n";
  if (out.ends_with("..\n")) out.erase(out.size() - 2, 1);
  for (const std::string& line : footer_lines(app)) {
    if (!line.empty() && !line.starts_with(kExample) && !line.starts_with(kExit)) out += ".PP\n" + plain(line) + "\n";
  }
  return out;
}

std::string examples(const CLI::App& app) {
  std::string out;
  for (const std::string& line : footer_lines(app)) {
    if (line.starts_with(kExample)) out += ".nf\n" + plain(line.substr(kExample.size())) + "\n.fi\n";
  }
  return out.empty() ? "" : ".SH EXAMPLES\n" + out;
}

std::string environment() {
  return ".SH ENVIRONMENT\n"
         ".TP\n.B VPSBAKE_CACHE\nThe folder that \\fB\\-\\-cache\\fR would name\n"
         ".TP\n.B VPSBAKE_CACHE_SIZE\nThe size that \\fB\\-\\-cache\\-size\\fR would name\n"
         ".TP\n.B BROWSER\nThe program that \\fB\\-\\-open\\fR starts; otherwise xdg\\-open\n"
         ".TP\n.B NO_COLOR\nWhen it is not empty, errors and warnings have no colour\n"
         ".TP\n.B COLUMNS\nWidth of \\fB\\-\\-help\\fR where it is not printed to a terminal\n";
}

}  // namespace

std::string page_name(const CLI::App& app) {
  return CLI::detail::find_and_replace(full_name(app), " ", "-");
}

std::string man_page(const CLI::App& app) {
  const std::string name = page_name(app);
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(), [](unsigned char c) { return std::toupper(c); });
  std::string purpose = app.get_description();
  purpose[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(purpose[0])));
  if (purpose.ends_with('.')) purpose.pop_back();
  std::string out = ".\\\" Written by vpsbake help\\-files from the program's options.\n";
  out += ".TH " + plain(title) + " 1 \"\" \"vpsbake " VPSBAKE_VERSION "\" \"User Commands\"\n";
  out += ".SH NAME\n" + plain(name) + " \\- " + plain(purpose) + "\n";
  out += synopsis(app) + description(app) + options(app) + commands(app);
  out += ".SH EXIT STATUS\n" + plain(kExitCodes) + "\n" + environment() + examples(app);
  const bool root = app.get_parent() == nullptr;
  return out + (root ? "" : ".SH SEE ALSO\n.BR " + plain(page_name(*app.get_parent())) + " (1)\n");
}

}  // namespace vps::cli
