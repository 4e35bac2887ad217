// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Prints results: in lines that fit a terminal, with colours where they are wanted.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "cli/terminal/wrapped.h"

namespace vps::cli {

enum class TextColour : std::uint8_t { plain, bold, green, yellow, red };

/// The text in a colour, where the stream takes colours; see `takes_colour`.
[[nodiscard]] std::string painted(const std::string& text, TextColour colour, int fd);

/// Formats and prints whole lines, `fitted` to the stream.
template <class... Values>
void print_lines(std::FILE* file, fmt::format_string<Values...> form, Values&&... values) {
  fmt::print(file, "{}", fitted(fmt::format(form, std::forward<Values>(values)...), ::fileno(file)));
}

/// The same to standard output.
template <class... Values>
void print_lines(fmt::format_string<Values...> form, Values&&... values) {
  print_lines(stdout, form, std::forward<Values>(values)...);
}

}  // namespace vps::cli
