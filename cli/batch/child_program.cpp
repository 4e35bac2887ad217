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

namespace vps::cli::batch {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Memory for a child's words and output. Unlike a pipe it never fills.
class Text {
 public:
  Text() : fd_(::memfd_create("text", MFD_CLOEXEC)) {}
  explicit Text(int fd) : fd_(fd) {}
  Text(const Text&) = delete;
  Text& operator=(const Text&) = delete;
  ~Text() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool write(const std::string& text) const {
    return ::write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  }
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

// A request to the server: descriptors of the words, each with a zero behind it, of standard output and error, and of
// the pipe for the child's number.
enum Part { kWords, kOut, kErr, kReply, kParts };
using Request = std::array<int, kParts>;

// A message with descriptors, as sendmsg and recvmsg take it.
class Message {
 public:
  Message() {
    header_.msg_iov = &content_;
    header_.msg_iovlen = 1;
    header_.msg_control = control_;
    header_.msg_controllen = sizeof control_;
  }
  bool send(int socket, const Request& request) {
    cmsghdr* const rights = CMSG_FIRSTHDR(&header_);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof request);
    std::memcpy(CMSG_DATA(rights), request.data(), sizeof request);
    return ::sendmsg(socket, &header_, MSG_NOSIGNAL) == 1;
  }
  bool receive(int socket, Request& request) {
    ssize_t got = 0;
    do {
      got = ::recvmsg(socket, &header_, MSG_CMSG_CLOEXEC);
    } while (got < 0 && errno == EINTR);
    const cmsghdr* const rights = CMSG_FIRSTHDR(&header_);
    if (got != 1 || rights == nullptr || rights->cmsg_len != CMSG_LEN(sizeof request)) return false;
    std::memcpy(request.data(), CMSG_DATA(rights), sizeof request);
    return true;
  }

 private:
  char byte_ = 0;
  iovec content_{&byte_, 1};
  alignas(cmsghdr) char control_[CMSG_SPACE(sizeof(Request))] = {};
  msghdr header_{};
};

// The child, once it belongs to `parent`.
[[noreturn]] void become(Program program, const Request& request, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  const int null = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::dup2(null, STDIN_FILENO);
  ::dup2(request[kOut], STDOUT_FILENO);
  ::dup2(request[kErr], STDERR_FILENO);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
  std::string words = Text(request[kWords]).read();
  std::vector<char*> arguments;
  for (std::size_t at = 0; at < words.size(); at = words.find('\0', at) + 1) arguments.push_back(words.data() + at);
  const auto count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  const pid_t self = ::getpid();
  if (::write(request[kReply], &self, sizeof self) != sizeof self) ::_exit(127);
  for (const int fd : {null, request[kOut], request[kErr], request[kReply]}) ::close(fd);
  std::exit(program(count, arguments.data()));
}

// The server: a process without threads that forks children. The process between ends at once, so that they become
// those of `parent`, which waits for them.
[[noreturn]] void serve(int socket, Program program, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(0);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  Request request{};
  while (Message().receive(socket, request)) {
    const pid_t between = ::fork();
    if (between == 0) {
      ::close(socket);
      const pid_t self = ::getpid();
      if (::fork() != 0) ::_exit(0);
      while (::getppid() == self) ::usleep(20);
      become(program, request, parent);
    }
    ::waitpid(between, nullptr, 0);
    for (const int fd : request) ::close(fd);
  }
  ::_exit(0);
}

int server = -1;  // the socket to it

// Starts a child. @return its number, or 0 with `errno` set
pid_t start(const std::vector<std::string>& words, const Text& out, const Text& err) {
  std::string text = "vpsbake";
  text += '\0';
  for (const std::string& word : words) text.append(word) += '\0';
  const Text listed;
  int reply[2];
  if (!listed.write(text) || ::pipe2(reply, O_CLOEXEC) != 0) return 0;
  const bool sent = Message().send(server, {listed.fd(), out.fd(), err.fd(), reply[1]});
  ::close(reply[1]);
  pid_t child = 0;
  ssize_t got = 0;
  do {
    got = sent ? ::read(reply[0], &child, sizeof child) : -1;
  } while (got < 0 && sent && errno == EINTR);
  if (got == 0) errno = EAGAIN;  // no more processes
  const int failed = errno;
  ::close(reply[0]);
  errno = failed;
  return got == sizeof child ? child : 0;
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
  ProgramResult result;
  const auto begin = Clock::now();
  const Text out, err;
  const pid_t child = start(words, out, err);
  if (child == 0) {
    result.code = errno;
    return result;
  }
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
