// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The tree of commands and options, as --help, the manual and the shells' completions show it. It is read from
/// CLI::App, so a new option or command appears in all of them. Options and commands in the group "" are left out.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace vps::cli {

struct OptionGroup {
  std::string title;
  std::vector<const CLI::Option*> options;
};

/// Options by group, in order of definition; the options of every command (--help, --version) come last.
[[nodiscard]] std::vector<OptionGroup> option_groups(const CLI::App& app);

/// Positional arguments, in order.
[[nodiscard]] std::vector<const CLI::Option*> positionals(const CLI::App& app);

/// Its sub-commands, in order.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& app);

/// "-o, --output", or the placeholder of a positional argument.
[[nodiscard]] std::string names_of(const CLI::Option& option);

/// Whether it takes no value.
[[nodiscard]] bool is_flag(const CLI::Option& option);

/// Placeholder of the value, such as LENGTH; empty for a flag.
[[nodiscard]] std::string value_name(const CLI::Option& option);

/// Its description; for a flag also the options that it excludes.
[[nodiscard]] std::string description_of(const CLI::Option& option);

/// The values that it accepts, from its validator or type name "{one,two}"; empty: any.
[[nodiscard]] std::vector<std::string> values_of(const CLI::Option& option);

/// One line for each way to call it: "vpsbake check MESH [OPTIONS]".
/// @param name  the whole name of the command
[[nodiscard]] std::vector<std::string> usages(const CLI::App& app, const std::string& name);

/// The whole name of a command: "vpsbake check".
[[nodiscard]] std::string full_name(const CLI::App& app);

/// The lines of its footer.
[[nodiscard]] std::vector<std::string> footer_lines(const CLI::App& app);

}  // namespace vps::cli
