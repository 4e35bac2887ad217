// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake help-files --into DIR`: writes what an installation has below share/ to help people at a terminal.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

/// For the build, so that --help does not list it: man/man1/NAME.1, one page for each command,
/// bash-completion/completions/vpsbake and zsh/site-functions/_vpsbake, of all commands that `app` has when it runs.
[[nodiscard]] Command add_help_files_command(CLI::App& app);

}  // namespace vps::cli
