// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/pass_descriptors.h"

#include <sys/socket.h>

#include <cerrno>
#include <cstring>

namespace vps {
namespace {

// A message as sendmsg and recvmsg take it.
struct Message {
  iovec content;
  alignas(cmsghdr) char control[CMSG_SPACE(kMostDescriptors * sizeof(int))] = {};
  msghdr header{};

  Message(char* bytes, std::size_t size, std::size_t descriptors) : content{bytes, size} {
    header.msg_iov = &content;
    header.msg_iovlen = 1;
    header.msg_control = descriptors > 0 ? control : nullptr;
    header.msg_controllen = descriptors > 0 ? CMSG_SPACE(descriptors * sizeof(int)) : 0;
  }
};

}  // namespace

bool send_message(int socket, std::string_view bytes, std::span<const int> descriptors) {
  Message message(const_cast<char*>(bytes.data()), bytes.size(), descriptors.size());  // sendmsg does not write to them
  if (cmsghdr* const rights = CMSG_FIRSTHDR(&message.header)) {
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(descriptors.size_bytes());
    std::memcpy(CMSG_DATA(rights), descriptors.data(), descriptors.size_bytes());
  }
  ssize_t sent = 0;
  do {
    sent = ::sendmsg(socket, &message.header, MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(bytes.size());
}

bool receive_message(int socket, std::string& bytes, std::span<int> descriptors) {
  Message message(bytes.data(), bytes.size(), descriptors.size());
  ssize_t got = 0;
  do {
    got = ::recvmsg(socket, &message.header, MSG_CMSG_CLOEXEC);
  } while (got < 0 && errno == EINTR);
  if (got <= 0 || (message.header.msg_flags & MSG_TRUNC) != 0) return false;
  bytes.resize(static_cast<std::size_t>(got));
  if (descriptors.empty()) return true;
  const cmsghdr* const rights = CMSG_FIRSTHDR(&message.header);
  if (rights == nullptr || rights->cmsg_len != CMSG_LEN(descriptors.size_bytes())) return false;
  std::memcpy(descriptors.data(), CMSG_DATA(rights), descriptors.size_bytes());
  return true;
}

}  // namespace vps
