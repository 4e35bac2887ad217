// SPDX-License-Identifier: GPL-3.0-or-later
// Runs code that may crash, hang or use too much memory in a child process.
#include "formats/mesh/child_process.h"

#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <new>

#include "formats/mesh/pass_descriptors.h"

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
bool collect(int fd, double timeout, GrowingBytes& bytes) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(timeout);
  while (true) {
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd waiting{fd, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(std::min(left * 1000, 1e9)) + 1) <= 0) continue;
    const std::span<std::byte> room = bytes.room(1 << 16);  // as much as a pipe holds
    const ssize_t got = ::read(fd, room.data(), room.size());
    if (got > 0) bytes.add(static_cast<std::size_t>(got));
    if (got == 0 || (got < 0 && errno != EINTR)) return true;
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

struct Verdict {
  ChildResult::End end = ChildResult::End::cannot_start;
  int signal = 0;
};

// @param status  as waitpid gives it
Verdict judge(int status, bool in_time) {
  using End = ChildResult::End;
  if (!in_time || (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)) return {End::timed_out};
  if (WIFSIGNALED(status)) return {End::crashed, WTERMSIG(status)};
  const int code = WEXITSTATUS(status);
  return {code == 0 ? End::finished : code == kOutOfMemory ? End::out_of_memory : End::failed};
}

// What the server is asked for, followed by the request's text. Both processes have the same code at the same place.
struct Order {
  ChildLimits limits;
  ChildWork work;
};
constexpr std::size_t kLongestRequest = 1 << 15;  // a path has up to 4096 bytes

// Waits for the only child, and ends it when its time is over. SIGCHLD is blocked.
Verdict watch(pid_t child, double timeout, const sigset_t& its_end) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(timeout);
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    if (left <= 0) {
      ::kill(child, SIGKILL);
      return judge(wait_for(child), false);
    }
    const double whole = std::floor(std::min(left, 1e6));
    const timespec time{static_cast<time_t>(whole), static_cast<long>(1e9 * std::min(left - whole, 0.999))};
    ::sigtimedwait(&its_end, nullptr, &time);
  }
  return judge(status, true);
}

// The server: a small process without threads. It ends with the thread that forked it.
[[noreturn]] void serve(int socket) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  socket = keep_only(socket);
  sigset_t child_ends;
  ::sigemptyset(&child_ends);
  ::sigaddset(&child_ends, SIGCHLD);
  ::sigprocmask(SIG_BLOCK, &child_ends, nullptr);
  std::signal(SIGCHLD, SIG_DFL);  // where it is ignored, nobody learns how a child ended
  int fd = -1;
  for (std::string message(kLongestRequest, '\0'); receive_message(socket, message, {&fd, 1});
       message.resize(kLongestRequest)) {
    Order order{};
    std::memcpy(&order, message.data(), sizeof order);
    const pid_t child = ::fork();
    if (child == 0) {
      ::sigprocmask(SIG_UNBLOCK, &child_ends, nullptr);
      run_child(
          order.limits, [&](int to) { order.work(message.substr(sizeof order), to); }, fd);
    }
    ::close(fd);
    const Verdict verdict = child > 0 ? watch(child, order.limits.timeout, child_ends) : Verdict{};
    if (!send_message(socket, {reinterpret_cast<const char*>(&verdict), sizeof verdict}, {})) break;
  }
  ::_exit(0);
}

// This side of the server.
struct Server {
  std::mutex busy;
  pid_t number = 0;
  int socket = -1;

  [[nodiscard]] bool start_child(const ChildLimits& limits, ChildWork work, const std::string& request, int fd) const {
    const Order order{limits, work};
    return send_message(socket, std::string(reinterpret_cast<const char*>(&order), sizeof order) + request, {&fd, 1});
  }
  void end() {
    ::kill(number, SIGKILL);  // and with it the child
    wait_for(number);
    ::close(socket);
    socket = -1;
  }
};
Server server;

// Takes the bytes and the verdict of the server's child.
ChildResult collect_from_server(int fd) {
  ChildResult result;
  (void)collect(fd, std::numeric_limits<double>::infinity(), result.bytes);  // the server ends it in time
  std::string answer(sizeof(Verdict), '\0');
  Verdict verdict;
  if (receive_message(server.socket, answer, {}) && answer.size() == sizeof verdict)
    std::memcpy(&verdict, answer.data(), sizeof verdict);
  result.end = verdict.end;
  result.signal = verdict.signal;
  return result;
}

}  // namespace

std::span<std::byte> GrowingBytes::room(std::size_t bytes) {
  if (capacity_ - size_ < bytes) {
    const std::size_t capacity = std::max(size_ + bytes, 2 * capacity_);
    auto* const moved = static_cast<std::byte*>(std::realloc(data_.get(), capacity));
    if (moved == nullptr) throw std::bad_alloc();
    (void)data_.release();
    data_.reset(moved);
    capacity_ = capacity;
  }
  return {data_.get() + size_, bytes};
}

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
      wait_for(child);
      throw;
    }
    if (!in_time) ::kill(child, SIGKILL);
    const Verdict verdict = judge(wait_for(child), in_time);
    result.end = verdict.end;
    result.signal = verdict.signal;
  }
  ::close(ends[0]);
  return result;
}

ChildResult run_in_child(const ChildLimits& limits, ChildWork work, const std::string& request) {
  const std::unique_lock lock(server.busy, std::try_to_lock);
  int ends[2];
  if (!lock || server.socket < 0 || request.size() + sizeof(Order) > kLongestRequest || ::pipe2(ends, O_CLOEXEC) != 0)
    return run_in_child(limits, [&](int fd) { work(request, fd); });
  const bool started = server.start_child(limits, work, request, ends[1]);
  ::close(ends[1]);
  ChildResult result;
  try {
    if (started) result = collect_from_server(ends[0]);
  } catch (...) {  // no memory for the answer
    server.end();
    ::close(ends[0]);
    throw;
  }
  ::close(ends[0]);
  if (started) return result;
  server.end();
  return run_in_child(limits, [&](int fd) { work(request, fd); });
}

void prepare_children() {
  int sockets[2];
  if (server.socket >= 0 || ::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) != 0) return;
  const pid_t forked = ::fork();
  if (forked == 0) serve(sockets[1]);
  ::close(sockets[1]);
  if (forked < 0) {
    ::close(sockets[0]);
    return;
  }
  server.number = forked;
  server.socket = sockets[0];
}

}  // namespace vps
