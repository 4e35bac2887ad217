// SPDX-License-Identifier: Zlib
// Sends messages about wrong use to the handler. The default handler prints to stderr.
#include "runtime/bullet/messages.h"

#include <atomic>
#include <cstdio>

namespace vps::bullet {
namespace {

void print(const char* line) {
  std::fprintf(stderr, "%s\n", line);
}
std::atomic<MessageHandler> handler{print};

}  // namespace

void set_message_handler(MessageHandler to) {
  handler.store(to);
}

void send_message(const Shape& shape, const std::string& text) {
  const MessageHandler to = handler.load();
  if (to == nullptr) return;
  to(("vps: shape '" + shape.label() + "': " + text).c_str());
}

}  // namespace vps::bullet
