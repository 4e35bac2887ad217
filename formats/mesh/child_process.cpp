// SPDX-License-Identifier: GPL-3.0-or-later
// A child process as a fence round code that may crash, hang or eat memory.
#include "formats/mesh/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <new>

namespace vps {
namespace {

constexpr int kOutOfMemory = 90;
constexpr int kCannotWrite = 91;

void limit(int resource, rlim_t value) {
  const rlimit both{value, value};
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &both);
}

[[noreturn]] void run_child(const ChildLimits& limits, const std::function<void(int)>& work, int fd) {
  // Whatever a library prints or installs must not reach the user or outlive the parent.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int null = ::open("/dev/null", O_RDWR);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(null, standard);
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGTERM, SIGINT}) ::signal(signal, SIG_DFL);
  ::signal(SIGPIPE, SIG_IGN);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.timeout)) + 1);
#ifndef __SANITIZE_ADDRESS__
  // AddressSanitizer reserves terabytes of address space.
  limit(RLIMIT_AS, limits.memory_bytes);
#endif
  int code = 0;
  try {
    work(fd);
  } catch (const std::bad_alloc&) {
    code = kOutOfMemory;
  } catch (...) {
    code = 1;
  }
  ::_exit(code);
}

}  // namespace

void write_all(int fd, const void* data, std::size_t bytes) {
  const auto* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = ::write(fd, at, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(kCannotWrite);
    at += written;
    bytes -= static_cast<std::size_t>(written);
  }
}

ChildResult run_in_child(const ChildLimits& limits, const std::function<void(int)>& work) {
  using Clock = std::chrono::steady_clock;
  ChildResult result;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return result;
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    return result;
  }
  if (child == 0) {
    ::close(ends[0]);
    run_child(limits, work, ends[1]);
  }
  ::close(ends[1]);

  const auto deadline = Clock::now() + std::chrono::duration<double>(limits.timeout);
  bool late = false;
  for (bool open = true; open && !late;) {
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    late = left <= 0;
    pollfd waiting{ends[0], POLLIN, 0};
    if (late || ::poll(&waiting, 1, static_cast<int>(std::min(left * 1000, 1e9)) + 1) <= 0) continue;
    std::byte buffer[1 << 16];
    const ssize_t got = ::read(ends[0], buffer, sizeof buffer);
    open = got > 0 || (got < 0 && errno == EINTR);
    if (got > 0) result.bytes.insert(result.bytes.end(), buffer, buffer + got);
  }
  ::close(ends[0]);
  if (late) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (late || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)) {
    result.end = ChildResult::End::timed_out;
  } else if (WIFSIGNALED(status)) {
    result.end = ChildResult::End::crashed;
    result.signal = WTERMSIG(status);
  } else {
    result.end = WEXITSTATUS(status) == kOutOfMemory ? ChildResult::End::out_of_memory
                 : WEXITSTATUS(status) == 0          ? ChildResult::End::finished
                                                     : ChildResult::End::crashed;
  }
  return result;
}

}  // namespace vps
