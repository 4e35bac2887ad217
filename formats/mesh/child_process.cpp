// SPDX-License-Identifier: GPL-3.0-or-later
// Runs code that may crash, hang or use too much memory in a child process.
#include "formats/mesh/child_process.h"

#include <fcntl.h>
#include <malloc.h>
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
#include <cstdlib>
#include <new>

namespace vps {
namespace {

// AddressSanitizer reserves terabytes of address space: nothing would run under a limit. gcc and clang differ in how it
// is detected.
#ifdef __has_feature
#define VPS_HAS_FEATURE(feature) __has_feature(feature)
#else
#define VPS_HAS_FEATURE(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || VPS_HAS_FEATURE(address_sanitizer)
constexpr bool kAddressSanitizer = true;
#else
constexpr bool kAddressSanitizer = false;
#endif

constexpr int kOutOfMemory = 90;
constexpr int kFailed = 91;

void limit(int resource, rlim_t value) {
  const rlimit both{value, value};
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &both);
}

// Address space that this process already has. The fork copies that of the parent's threads and arenas.
std::size_t address_space() {
  char text[64] = {};
  const int fd = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  const ssize_t got = fd < 0 ? 0 : ::read(fd, text, sizeof text - 1);
  if (fd >= 0) ::close(fd);
  return got <= 0 ? 0 : std::strtoull(text, nullptr, 10) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

// Closes all descriptors but the standard ones, which it puts on /dev/null, and `fd`, which it moves to number 3. Above
// all it closes the pipes of other children, which would otherwise stay open until this child ends.
int keep_only(int fd) {
  // In a parent without standard descriptors the pipe may have one of their numbers.
  if (fd <= STDERR_FILENO) fd = ::fcntl(fd, F_DUPFD, STDERR_FILENO + 1);
  const int null = ::open("/dev/null", O_RDWR);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(null, standard);
  constexpr int kOurs = 3;
  if (fd != kOurs) ::dup2(fd, kOurs);
  ::close_range(kOurs + 1, ~0U, 0);
  return kOurs;
}

[[noreturn]] void run_child(const ChildLimits& limits, const std::function<void(int)>& work, int fd) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  fd = keep_only(fd);
  // Handlers of the parent must not run here, and a crash must end the child with its signal.
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGTERM, SIGINT}) ::signal(signal, SIG_DFL);
  ::signal(SIGPIPE, SIG_IGN);
#ifdef __GLIBC__
  ::malloc_trim(0);  // memory that the parent has freed would add to the limit
#endif
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.timeout)) + 1);
  if (!kAddressSanitizer) limit(RLIMIT_AS, address_space() + limits.memory_bytes);
  int code = 0;
  try {
    work(fd);
  } catch (const std::bad_alloc&) {
    code = kOutOfMemory;
  } catch (...) {
    code = kFailed;
  }
  ::_exit(code);
}

// Reads up to the end of the pipe. False when the time runs out before that.
bool collect(int fd, double timeout, std::vector<std::byte>& bytes) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(timeout);
  std::vector<std::byte> buffer(1 << 20);
  while (true) {
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd waiting{fd, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(std::min(left * 1000, 1e9)) + 1) <= 0) continue;
    const ssize_t got = ::read(fd, buffer.data(), buffer.size());
    if (got > 0) bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + got);
    if (got == 0 || (got < 0 && errno != EINTR)) return true;
  }
}

// Waits for the child, which may end later than its pipe.
void judge(pid_t child, bool in_time, ChildResult& result) {
  using End = ChildResult::End;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)) {
    result.end = End::timed_out;
  } else if (WIFSIGNALED(status)) {
    result.end = End::crashed;
    result.signal = WTERMSIG(status);
  } else {
    const int code = WEXITSTATUS(status);
    result.end = code == 0 ? End::finished : code == kOutOfMemory ? End::out_of_memory : End::failed;
  }
}

}  // namespace

void write_all(int fd, const void* data, std::size_t bytes) {
  const auto* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = ::write(fd, at, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ::_exit(kFailed);
    at += written;
    bytes -= static_cast<std::size_t>(written);
  }
}

ChildResult run_in_child(const ChildLimits& limits, const std::function<void(int)>& work) {
  ChildResult result;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return result;
  const pid_t child = ::fork();
  if (child == 0) run_child(limits, work, ends[1]);
  ::close(ends[1]);
  if (child > 0) {
    bool in_time = false;
    try {
      in_time = collect(ends[0], limits.timeout, result.bytes);
    } catch (...) {
      // No memory for the answer. Ends the child and closes its descriptor before the exception leaves.
      ::kill(child, SIGKILL);
      ::close(ends[0]);
      judge(child, true, result);
      throw;
    }
    if (!in_time) ::kill(child, SIGKILL);
    judge(child, in_time, result);
  }
  ::close(ends[0]);
  return result;
}

}  // namespace vps
