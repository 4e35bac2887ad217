// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shows a page in the user's browser.
#pragma once

#include <CLI/App.hpp>
#include <filesystem>

namespace vps::cli {

/// `--open`: show the page when it is written.
CLI::Option* add_open_option(CLI::App& app, bool& open);

/// Starts the environment's BROWSER, or xdg-open, and does not wait for it. A failure is a warning: the page is
/// written.
void open_page(const std::filesystem::path& page);

}  // namespace vps::cli
