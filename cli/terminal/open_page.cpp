// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/open_page.h"

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "cli/terminal/complain.h"

namespace vps::cli {

CLI::Option* add_open_option(CLI::App& app, bool& open) {
  return app.add_flag("--open", open, "Show the page with the environment's BROWSER, or xdg-open");
}

void open_page(const std::filesystem::path& page) {
  const char* const wanted = std::getenv("BROWSER");
  std::string program = wanted != nullptr && *wanted != '\0' ? wanted : "xdg-open";
  std::string file = std::filesystem::absolute(page).string();
  char* const arguments[] = {program.data(), file.data(), nullptr};
  posix_spawn_file_actions_t streams;
  posix_spawn_file_actions_init(&streams);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&streams, stream, "/dev/null", O_RDWR, 0);
  posix_spawnattr_t session;  // of its own, so that the browser outlives the terminal
  posix_spawnattr_init(&session);
  posix_spawnattr_setflags(&session, POSIX_SPAWN_SETSID);
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, program.c_str(), &streams, &session, arguments, environ);
  posix_spawnattr_destroy(&session);
  posix_spawn_file_actions_destroy(&streams);
  if (error != 0)
    complain("warning", page.string(), program + ": " + std::strerror(error) + "; open the page in a browser yourself");
}

}  // namespace vps::cli
