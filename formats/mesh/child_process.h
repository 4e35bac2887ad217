// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs a function in a forked child with limits, and hands back the bytes it wrote.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace vps {

struct ChildLimits {
  std::size_t memory_bytes = 0;  ///< address space on top of what the parent has. Not enforced under AddressSanitizer
  double timeout = 0;            ///< wall clock, and processor time. [s]
};

/// Bytes whose number is not known beforehand. They grow without a copy where the system can move pages.
class GrowingBytes {
 public:
  /// @return room behind the bytes, for `add`. @throw std::bad_alloc
  [[nodiscard]] std::span<std::byte> room(std::size_t bytes);
  /// The first `bytes` of the room have been written.
  void add(std::size_t bytes) { size_ += bytes; }

  [[nodiscard]] const std::byte* data() const { return data_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::byte, Free> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

struct ChildResult {
  enum class End { finished, failed, crashed, out_of_memory, timed_out, cannot_start };
  End end = End::cannot_start;
  int signal = 0;      ///< with crashed
  GrowingBytes bytes;  ///< with finished: what the child wrote
};

/// Forks, limits the child, runs `work(fd)` there and collects what it writes to `fd`. The child never returns: it ends
/// with _exit. std::bad_alloc thrown by `work` counts as out_of_memory, any other exception as failed.
///
/// The parent may have threads. The child has only the calling one, and a lock that another thread held at the fork
/// stays locked in the child. The C library makes its allocator safe for this; so `work` may allocate, but must not use
/// anything else the parent's threads share: no logger, no thread pool. If it hangs anyway, the timeout ends it.
/// AddressSanitizer's allocator is not safe in this way: under it, fork while no other thread allocates.
[[nodiscard]] ChildResult run_in_child(const ChildLimits& limits, const std::function<void(int fd)>& work);

/// Work whose data is text, so that it can be asked of another process.
using ChildWork = void (*)(const std::string& request, int fd);

/// Runs `work(request, fd)` in the same way.
[[nodiscard]] ChildResult run_in_child(const ChildLimits& limits, ChildWork work, const std::string& request);

/// Forks a process that from now on forks the children of the function above. A fork shares all pages with its child,
/// and each page that is written afterwards costs a fault: a quarter of the time of a small bake in a process that has
/// baked before. Call it while this process is small; a second call does nothing. The process ends with the calling
/// thread.
void prepare_children();

/// Writes all bytes, or ends the child. For use in `work`.
void write_all(int fd, const void* data, std::size_t bytes);

}  // namespace vps
