// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/command_tree.h"

#include <algorithm>
#include <sstream>

namespace vps::cli {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

}  // namespace

std::vector<OptionGroup> option_groups(const CLI::App& app) {
  std::vector<OptionGroup> groups;
  OptionGroup common{"Help", {}};
  for (const CLI::Option* const option : app.get_options()) {
    if (option->get_positional() || option->get_group().empty()) continue;
    if (option == app.get_help_ptr() || option == app.get_version_ptr()) {
      common.options.push_back(option);
      continue;
    }
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const OptionGroup& one) { return one.title == option->get_group(); });
    if (group == groups.end()) group = groups.insert(groups.end(), {option->get_group(), {}});
    group->options.push_back(option);
  }
  if (!common.options.empty()) groups.push_back(common);
  return groups;
}

std::vector<const CLI::Option*> positionals(const CLI::App& app) {
  return app.get_options(
      [](const CLI::Option* option) { return option->get_positional() && !option->get_group().empty(); });
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* one) { return !one->get_name().empty() && !one->get_group().empty(); });
}

std::string names_of(const CLI::Option& option) {
  if (option.get_positional()) return value_name(option);
  return CLI::detail::find_and_replace(option.get_name(false, true), ",", ", ");
}

bool is_flag(const CLI::Option& option) {
  return option.get_items_expected_max() == 0;
}

std::string value_name(const CLI::Option& option) {
  std::string text = CLI::detail::trim_copy(option.get_option_text());
  if (!text.empty() || is_flag(option)) return text;
  return option.get_positional() ? option.get_name(true)
                                 : option.get_type_name().substr(0, option.get_type_name().find(':'));
}

std::string description_of(const CLI::Option& option) {
  if (!is_flag(option) || option.get_excludes().empty()) return option.get_description();
  std::vector<std::string> others;
  for (const CLI::Option* const other : option.get_excludes()) others.push_back(other->get_name());
  std::sort(others.begin(), others.end());  // CLI11 keeps them in order of their addresses
  return option.get_description() + " (not with " + CLI::detail::join(others, ", ") + ")";
}

std::vector<std::string> values_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{');
  const std::size_t end = type.find('}', begin);
  return end == std::string::npos ? std::vector<std::string>() : split(type.substr(begin + 1, end - begin - 1), ',');
}

std::vector<std::string> usages(const CLI::App& app, const std::string& name) {
  const bool commands = !commands_of(app).empty();
  std::string words = name;
  for (const CLI::Option* const one : positionals(app)) {
    // Required unless a command is given, so without brackets.
    words += " " + (one->get_required() || commands ? value_name(*one) : "[" + value_name(*one) + "]");
  }
  std::vector<std::string> lines = {words + " [OPTIONS]"};
  if (commands) lines.push_back(name + " COMMAND [OPTIONS]");
  return lines;
}

std::string full_name(const CLI::App& app) {
  return app.get_parent() == nullptr ? app.get_name() : full_name(*app.get_parent()) + " " + app.get_name();
}

std::vector<std::string> footer_lines(const CLI::App& app) {
  return split(app.get_footer(), '\n');
}

}  // namespace vps::cli
