// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The tree of commands and options as --help, the manual and the shells' completions show it. Everything is read
/// from CLI::App, so that a new option or command is in all of them. What is in the group "" stays out.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace vps::cli {

struct OptionGroup {
  std::string title;
  std::vector<const CLI::Option*> options;
};

/// Options with their groups in order of definition; what every command has (--help, --version) comes last.
[[nodiscard]] std::vector<OptionGroup> option_groups(const CLI::App& app);

/// What stands without a name, in order.
[[nodiscard]] std::vector<const CLI::Option*> positionals(const CLI::App& app);

/// Its sub-commands, in order.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& app);

/// "-o, --output", or what stands for the value of a positional.
[[nodiscard]] std::string names_of(const CLI::Option& option);

/// Whether it takes no value.
[[nodiscard]] bool is_flag(const CLI::Option& option);

/// What stands for the value, such as LENGTH; empty of a flag.
[[nodiscard]] std::string value_name(const CLI::Option& option);

/// Its description, and what it cannot go with where nothing stands for its value.
[[nodiscard]] std::string description_of(const CLI::Option& option);

/// The words that it takes, from its validator or type name "{one,two}"; empty: any.
[[nodiscard]] std::vector<std::string> values_of(const CLI::Option& option);

/// One line for each way to call it: "vpsbake check MESH [OPTIONS]".
/// @param name  of the command and those above it
[[nodiscard]] std::vector<std::string> usages(const CLI::App& app, const std::string& name);

/// The whole name of a command: "vpsbake check".
[[nodiscard]] std::string full_name(const CLI::App& app);

/// The lines of its footer.
[[nodiscard]] std::vector<std::string> footer_lines(const CLI::App& app);

}  // namespace vps::cli
