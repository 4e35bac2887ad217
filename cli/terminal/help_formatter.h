// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Layout of --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vps::cli {

/// Usage, arguments, options by group, commands; wrapped to the terminal, to 100 columns at most.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
};

}  // namespace vps::cli
