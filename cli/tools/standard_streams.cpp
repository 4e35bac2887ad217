// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/standard_streams.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <vector>

#include "bake/quantity_text.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli {
namespace {

using Kind = ImportError::Kind;

[[noreturn]] void refuse_input(int code) {
  throw ImportError(
      Kind::io, fmt::format("standard input cannot be kept in memory ({}); write it to a file", std::strerror(code)));
}

using Clock = std::chrono::steady_clock;

// Waits for standard input. @throw ImportError after `seconds` since `begin`
void wait_for_input(Clock::time_point begin, double seconds) {
  if (!std::isfinite(seconds)) return;
  for (;;) {
    const double left = seconds - std::chrono::duration<double>(Clock::now() - begin).count();
    pollfd input{STDIN_FILENO, POLLIN, 0};
    const int ready = left > 0 ? ::poll(&input, 1, static_cast<int>(std::min(1000 * left + 1, 1e9))) : 0;
    if (ready > 0 || (ready < 0 && errno != EINTR)) return;
    if (left > 0) continue;
    throw ImportError(Kind::bad_input,
                      fmt::format("standard input did not end within {:.4g} s; check the program that writes to it, or "
                                  "give it a longer --import-timeout",
                                  seconds));
  }
}

// Meshes and assets are read more than once and mapped, which a pipe does not allow.
std::filesystem::path keep_standard_input(const InputLimits& limits) {
  if (::isatty(STDIN_FILENO) != 0)
    throw ImportError(Kind::io, "standard input is a terminal; redirect it, or give the name of a file");
  const int fd = ::memfd_create("standard input", MFD_CLOEXEC);
  if (fd < 0) refuse_input(errno);
  std::vector<char> buffer(std::size_t{1} << 20);
  std::size_t total = 0;
  const Clock::time_point begin = Clock::now();
  for (;;) {
    wait_for_input(begin, limits.seconds);
    const ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) refuse_input(errno);
    if (got == 0) break;
    for (ssize_t put = 0, one = 0; put < got; put += one) {
      one = ::write(fd, buffer.data() + put, static_cast<std::size_t>(got - put));
      if (one < 0) refuse_input(errno);
    }
    total += static_cast<std::size_t>(got);
    if (total <= limits.bytes) continue;
    throw ImportError(Kind::bad_input,
                      fmt::format("standard input has more than {}; check the program that writes to it, or allow more "
                                  "with --import-memory",
                                  bake::format_bytes(static_cast<double>(limits.bytes))));
  }
  if (total == 0) throw ImportError(Kind::bad_input, "standard input is empty; check the program that writes to it");
  return fmt::format("/proc/{}/fd/{}", ::getpid(), fd);  // importers run in children, which close it
}

}  // namespace

std::filesystem::path file_to_read(const std::filesystem::path& name, const InputLimits& limits) {
  if (!is_standard_stream(name)) return name;
  static const std::filesystem::path kept = keep_standard_input(limits);
  return kept;
}

void write_to_standard_output(std::span<const std::byte> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() && std::fflush(stdout) == 0) return;
  const std::error_code code(errno, std::generic_category());
  std::clearerr(stdout);  // reported once
  throw std::system_error(code, "it cannot be written");
}

}  // namespace vps::cli
