// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Manual pages from the tree of commands.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vps::cli {

/// The page's file name without the section: "vpsbake-check".
[[nodiscard]] std::string page_name(const CLI::App& app);

/// The page of one command, in the language of man(7), section 1.
[[nodiscard]] std::string man_page(const CLI::App& app);

}  // namespace vps::cli
