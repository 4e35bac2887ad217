// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/child_program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "formats/mesh/pass_descriptors.h"

namespace vps::cli::batch {
namespace {

using Clock = std::chrono::steady_clock;

// A worker that keeps more memory than this ends, and a new one is started for the next program. Small bakes leave 10
// MB.
constexpr std::size_t kKeptMemory = 32'000'000;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Memory for a worker's output. Unlike a pipe it never fills.
class Text {
 public:
  Text() : fd_(::memfd_create("text", MFD_CLOEXEC)) {}
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

// A worker is asked with the words, each with a zero behind it, and the descriptors of standard output and error. The
// server is asked for a worker with the descriptor of the worker's end of its socket.
constexpr std::size_t kLongestWords = 1 << 17;  // a socket takes 200 kB

// A worker's answers. The first one, when it has begun, has its number only.
struct Answer {
  pid_t worker;
  int code;
  std::size_t peak_memory_bytes;
  std::size_t kept_memory_bytes;
};

// A number of kB in /proc/self/status. [bytes]
std::size_t status_value(const char* name) {
  char text[4096] = {};
  const int fd = ::open("/proc/self/status", O_RDONLY | O_CLOEXEC);
  const ssize_t got = fd < 0 ? 0 : ::read(fd, text, sizeof text - 1);
  if (fd >= 0) ::close(fd);
  const char* const at = got > 0 ? std::strstr(text, name) : nullptr;
  return at == nullptr ? 0 : std::strtoull(at + std::strlen(name), nullptr, 10) * 1024;
}

// From here on the peak of resident memory is counted anew.
void forget_peak() {
  const int fd = ::open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  if (fd < 0) return;
  // Some kernels are built without it: there, peaks of earlier programs count.
  [[maybe_unused]] const ssize_t written = ::write(fd, "5", 1);
  ::close(fd);
}

int run(Program program, std::string& words, const std::array<int, 2>& streams) {
  ::dup2(streams[0], STDOUT_FILENO);
  ::dup2(streams[1], STDERR_FILENO);
  for (const int fd : streams) ::close(fd);
  std::vector<char*> arguments;
  for (std::size_t at = 0; at < words.size(); at = words.find('\0', at) + 1) arguments.push_back(words.data() + at);
  const auto count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  const int code = program(count, arguments.data());
  std::fflush(nullptr);
  std::clearerr(stdout);
  return code;
}

bool send_answer(int socket, const Answer& answer) {
  return send_message(socket, {reinterpret_cast<const char*>(&answer), sizeof answer}, {});
}

// A worker, once it belongs to `parent`: runs what it is asked for until the socket's other end is closed.
[[noreturn]] void work(int socket, Program program, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  const int null = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::dup2(null, STDIN_FILENO);
  ::close(null);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
  Answer answer{::getpid(), 0, 0, 0};
  std::array<int, 2> streams{};
  for (std::string words(kLongestWords, '\0'); send_answer(socket, answer) && receive_message(socket, words, streams);
       words.resize(kLongestWords)) {
    forget_peak();
    answer.code = run(program, words, streams);
    answer.peak_memory_bytes = status_value("VmHWM:");
    answer.kept_memory_bytes = status_value("RssAnon:");
  }
  ::_exit(0);
}

// The server: a process without threads that forks workers. The process between ends at once, so that they become
// those of `parent`, which waits for them.
[[noreturn]] void serve(int socket, Program program, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(0);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  int its_socket = -1;
  for (std::string byte; byte.resize(1), receive_message(socket, byte, {&its_socket, 1});) {
    const pid_t between = ::fork();
    if (between == 0) {
      ::close(socket);
      const pid_t self = ::getpid();
      if (::fork() != 0) ::_exit(0);
      while (::getppid() == self) ::usleep(20);
      work(its_socket, program, parent);
    }
    ::waitpid(between, nullptr, 0);
    ::close(its_socket);
  }
  ::_exit(0);
}

int server = -1;  // the socket to it

// @return false when the worker has ended
bool read_answer(int socket, Answer& answer) {
  std::string bytes(sizeof answer, '\0');
  if (!receive_message(socket, bytes, {}) || bytes.size() != sizeof answer) return false;
  std::memcpy(&answer, bytes.data(), sizeof answer);
  return true;
}

// This side of a worker.
struct Worker {
  pid_t number = 0;
  int socket = -1;
  bool used = false;
};

// @return a worker without number and with `errno` set, when none can be started
Worker start_worker() {
  int sockets[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) != 0) return {};
  const bool sent = send_message(server, "w", {&sockets[1], 1});
  int failed = errno;
  ::close(sockets[1]);
  Answer answer{};
  if (sent && read_answer(sockets[0], answer)) return {answer.worker, sockets[0]};
  if (sent) failed = EAGAIN;  // no more processes
  ::close(sockets[0]);
  errno = failed;
  return {};
}

// Workers that wait for work.
class IdleWorkers {
 public:
  Worker take() {
    const std::lock_guard lock(mutex_);
    if (workers_.empty()) return {};
    const Worker worker = workers_.back();
    workers_.pop_back();
    return worker;
  }
  void give(const Worker& worker) {
    const std::lock_guard lock(mutex_);
    workers_.push_back(worker);
  }

 private:
  std::mutex mutex_;
  std::vector<Worker> workers_;
};

IdleWorkers idle;  // they end with this process

// Waits until the worker answers or ends. Returns false, with the end in `result`, when that took too long.
bool wait_for(int socket, double timeout, const std::atomic<bool>& stop, ProgramResult& result) {
  const auto begin = Clock::now();
  while (true) {
    constexpr int kLook = 100;  // interval at which `stop` is checked. [ms]
    const double left = timeout > 0 ? std::max(0.0, 1000 * (timeout - seconds_since(begin))) : kLook;
    pollfd waiting{socket, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(std::min<double>(left + 1, kLook))) > 0) return true;
    if (stop) result.end = ProgramResult::End::stopped;
    if (timeout > 0 && seconds_since(begin) > timeout) result.end = ProgramResult::End::timed_out;
    if (result.end != ProgramResult::End::cannot_start) return false;
  }
}

// Runs the program in `worker`, which afterwards is idle or has ended.
ProgramResult run_in(Worker worker, const std::string& words, double timeout, const std::atomic<bool>& stop) {
  using End = ProgramResult::End;
  ProgramResult result;
  const Text out, err;
  Answer answer{};
  const bool sent = send_message(worker.socket, words, std::array{out.fd(), err.fd()});
  const bool in_time = !sent || wait_for(worker.socket, timeout, stop, result);
  const bool answered = sent && in_time && read_answer(worker.socket, answer);
  if (answered) {
    result.end = End::exited;
    result.code = answer.code;
    result.peak_memory_bytes = answer.peak_memory_bytes;
  }
  if (answered && answer.kept_memory_bytes <= kKeptMemory) {
    worker.used = true;
    idle.give(worker);
  } else {
    if (!in_time) ::kill(-worker.number, SIGKILL);
    ::close(worker.socket);
    rusage usage{};
    int status = 0;
    while (::wait4(worker.number, &status, 0, &usage) < 0 && errno == EINTR) {
    }
    if (result.end == End::cannot_start) {
      result.end = WIFEXITED(status) ? End::exited : End::killed;
      result.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
    }
    if (!answered) result.peak_memory_bytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
  }
  result.out = out.read();
  result.err = err.read();
  return result;
}

}  // namespace

void prepare_programs(Program program) {
  int sockets[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) != 0) return;
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  std::fflush(nullptr);  // or children would print it again
  const pid_t parent = ::getpid();
  const pid_t forked = ::fork();
  if (forked == 0) {
    ::close(sockets[0]);
    serve(sockets[1], program, parent);
  }
  ::close(sockets[1]);
  if (forked > 0) server = sockets[0];
}

ProgramResult run_program(const std::vector<std::string>& words, double timeout, const std::atomic<bool>& stop) {
  const auto begin = Clock::now();
  std::string text = "vpsbake";
  text += '\0';
  for (const std::string& word : words) text.append(word) += '\0';
  ProgramResult result;
  if (text.size() > kLongestWords) {
    result.code = E2BIG;
    return result;
  }
  bool again = false;
  do {
    Worker worker = again ? Worker{} : idle.take();
    if (worker.number == 0) worker = start_worker();
    if (worker.number == 0) {
      result.code = errno;
      return result;
    }
    result = run_in(worker, text, timeout, stop);
    // An earlier program may have left something broken. This one's verdict comes from a worker of its own.
    again = worker.used && result.end == ProgramResult::End::killed;
  } while (again);
  result.seconds = seconds_since(begin);
  return result;
}

}  // namespace vps::cli::batch
