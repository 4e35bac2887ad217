// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Texts as lines that fit a terminal.
#pragma once

#include <cstddef>
#include <string>

namespace vps::cli {

/// The words as lines of at most `width` where they fit, all but the first indented; without a line end.
/// @param indent  columns; the first line begins there, too, after what is printed before
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width, std::size_t indent);

/// On a terminal each line cut at spaces to its width, 100 columns at most, and continued below its own last column;
/// elsewhere as it is. Columns are separated by two spaces or more. Colours take no width.
[[nodiscard]] std::string fitted(const std::string& text, int fd);

}  // namespace vps::cli
