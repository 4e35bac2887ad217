// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The line on stderr that goes with an exit code.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

#include "cli/terminal/print.h"
#include "cli/terminal/terminal.h"
#include "cli/tools/exit_code.h"
#include "cli/tools/utf8.h"

namespace vps::cli {

/// Prints `vpsbake: KIND: FILE: reason` to stderr, on terminals an error red and a warning yellow.
inline void complain(const char* kind, const std::string& file, const std::string& reason) {
  constexpr std::string_view kStart = "vpsbake: ";
  std::string line = one_line(std::string(kStart) + kind + ": " + file + ": " + reason);
  const std::string_view what = kind;
  const TextColour colour = what == "error"     ? TextColour::red
                            : what == "warning" ? TextColour::yellow
                                                : TextColour::bold;
  line.replace(kStart.size(), what.size() + 1, painted(std::string(what) + ":", colour, STDERR_FILENO));
  std::fprintf(stderr, "%s\n", fitted(line, STDERR_FILENO).c_str());
}

/// Prints `vpsbake: error: FILE: reason; what to do` to stderr and returns the code.
inline int fail(ExitCode code, const std::string& file, const std::string& reason) {
  complain("error", file, reason);
  return code;
}

}  // namespace vps::cli
