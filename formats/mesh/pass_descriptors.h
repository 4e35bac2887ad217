// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Messages between processes, with open files.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace vps {

constexpr std::size_t kMostDescriptors = 4;

/// Sends bytes and open files as one message. @param socket  one of SOCK_SEQPACKET
/// @return false when nobody receives it
[[nodiscard]] bool send_message(int socket, std::string_view bytes, std::span<const int> descriptors);

/// Waits for a message of up to `bytes.size()` bytes, and cuts `bytes` to what came.
/// @return false when the other side has ended, or the message has not as many open files as `descriptors`
[[nodiscard]] bool receive_message(int socket, std::string& bytes, std::span<int> descriptors);

}  // namespace vps
