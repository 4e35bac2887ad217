// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Completion of the command line in shells, from the tree of commands: commands, options, their values, and
/// files by extension.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vps::cli {

/// For bash 4 or later, with or without the package bash-completion.
[[nodiscard]] std::string bash_completion(const CLI::App& app);

/// For zsh: a file `_vpsbake` in its fpath, with descriptions.
[[nodiscard]] std::string zsh_completion(const CLI::App& app);

}  // namespace vps::cli
