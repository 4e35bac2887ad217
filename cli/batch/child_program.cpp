// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/child_program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>

namespace vps::cli::batch {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Memory for a child's output. Unlike a pipe it never fills.
class Text {
 public:
  Text() : fd_(::memfd_create("output", MFD_CLOEXEC)) {}
  Text(const Text&) = delete;
  Text& operator=(const Text&) = delete;
  ~Text() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::string read() const {
    std::string text;
    char buffer[1 << 14];
    for (ssize_t got = 0; (got = ::pread(fd_, buffer, sizeof buffer, static_cast<off_t>(text.size()))) > 0;)
      text.append(buffer, static_cast<std::size_t>(got));
    return text;
  }

 private:
  int fd_;
};

// Runs in the child between fork and exec, with system calls only.
[[noreturn]] void become(char* const* arguments, pid_t parent, int out, int err) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  const int null = ::open("/dev/null", O_RDONLY);
  ::dup2(null, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::signal(signal, SIG_DFL);
  ::execv("/proc/self/exe", arguments);
  ::_exit(127);
}

// Waits for the child. Returns true when it ended by itself.
bool wait_for(pid_t child, double timeout, const std::atomic<bool>& stop, ProgramResult& result) {
  const auto begin = Clock::now();
  // A system call, because glibc 2.36 declares the function only for C.
  const auto process = static_cast<int>(::syscall(SYS_pidfd_open, child, 0));
  bool ended = false;
  while (!ended) {
    constexpr int kLook = 100;  // interval at which `stop` is checked. [ms]
    const double left = timeout > 0 ? std::max(0.0, 1000 * (timeout - seconds_since(begin))) : kLook;
    pollfd waiting{process, POLLIN, 0};
    ended = process >= 0 && ::poll(&waiting, 1, static_cast<int>(std::min<double>(left + 1, kLook))) > 0;
    if (process < 0) {  // an old kernel
      siginfo_t info{};
      ended = ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0;
      if (!ended) ::usleep(kLook * 1000);
    }
    if (!ended && stop) result.end = ProgramResult::End::stopped;
    if (!ended && timeout > 0 && seconds_since(begin) > timeout) result.end = ProgramResult::End::timed_out;
    if (result.end != ProgramResult::End::cannot_start) break;
  }
  if (process >= 0) ::close(process);
  return ended;
}

}  // namespace

ProgramResult run_program(const std::vector<std::string>& words, double timeout, const std::atomic<bool>& stop) {
  ProgramResult result;
  const auto begin = Clock::now();
  std::string name = "vpsbake";
  std::vector<std::string> copies = words;
  std::vector<char*> arguments = {name.data()};
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const Text out, err;
  const pid_t parent = ::getpid();
  const pid_t child = out.fd() < 0 || err.fd() < 0 ? -1 : ::fork();
  if (child == 0) become(arguments.data(), parent, out.fd(), err.fd());
  if (child < 0) {
    result.code = errno;
    return result;
  }
  ::setpgid(child, child);  // in both processes: either may run first
  if (!wait_for(child, timeout, stop, result)) ::kill(-child, SIGKILL);
  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  if (result.end == ProgramResult::End::cannot_start) {
    result.end = WIFEXITED(status) ? ProgramResult::End::exited : ProgramResult::End::killed;
    result.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
  }
  result.out = out.read();
  result.err = err.read();
  result.seconds = seconds_since(begin);
  result.peak_memory_bytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
  return result;
}

}  // namespace vps::cli::batch
