// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs the program on its own pseudo-terminal.
#pragma once

#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "tests/support/temporary_folder.h"

namespace vps::test {

/// Everything that the program prints to a terminal, with "\n" as line ends.
/// @param settings  of the environment, such as "TERM=xterm"
inline std::string on_terminal(const TemporaryFolder& folder, const std::string& settings, const std::string& arguments,
                               unsigned short columns = 80) {
  const std::string line =
      "cd " + folder.path().string() + " && exec env -u NO_COLOR " + settings + " " + VPSBAKE + " " + arguments;
  winsize size{24, columns, 0, 0};
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  std::string out;
  char buffer[4096];
  for (ssize_t got = 0; (got = ::read(terminal, buffer, sizeof buffer)) > 0;) out.append(buffer, std::size_t(got));
  ::close(terminal);
  ::waitpid(child, nullptr, 0);
  std::erase(out, '\r');
  return out;
}

}  // namespace vps::test
