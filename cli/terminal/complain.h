// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The line on stderr that goes with an exit code.
#pragma once

#include <cctype>
#include <cstdio>
#include <string>
#include <string_view>

#include "cli/terminal/terminal.h"
#include "cli/terminal/wrapped.h"
#include "cli/tools/exit_code.h"

namespace vps::cli {

/// Prints `vpsbake: KIND: FILE: reason` to stderr, on terminals an error red and a warning yellow.
inline void complain(const char* kind, const std::string& file, const std::string& reason) {
  constexpr std::string_view kStart = "vpsbake: ";
  std::string line = std::string(kStart) + kind + ": " + file + ": " + reason;
  // A control character in a name must not break the line.
  for (char& c : line) c = std::iscntrl(static_cast<unsigned char>(c)) != 0 ? '?' : c;
  line = fitted(line, STDERR_FILENO);
  if (takes_colour(STDERR_FILENO)) {
    const std::string_view what = kind;
    const char* const colour = what == "error" ? "1;31" : what == "warning" ? "1;33" : "1";
    line.insert(kStart.size() + what.size() + 1, "\033[0m");
    line.insert(kStart.size(), std::string("\033[") + colour + "m");
  }
  std::fprintf(stderr, "%s\n", line.c_str());
}

/// Prints `vpsbake: error: FILE: reason; what to do` to stderr and returns the code.
inline int fail(ExitCode code, const std::string& file, const std::string& reason) {
  complain("error", file, reason);
  return code;
}

}  // namespace vps::cli
