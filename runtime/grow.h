// SPDX-License-Identifier: Zlib
/// @file Growth of working memory in functions that never throw. Internal.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <type_traits>

#include "formats/vps_format.h"

namespace vps::detail {

/// Calls grow(), which allocates. @return no_memory where that fails
template <class Grow>
[[nodiscard]] Status try_to_grow(const Grow& grow) noexcept {
  try {
    grow();
    return Status::ok;
  } catch (const std::bad_alloc&) {
    return Status::no_memory;
  } catch (const std::length_error&) {
    return Status::no_memory;
  }
}

/// Values that are written before they are read. Nothing is written when the room grows: pages that are never used cost
/// no time.
template <class T>
class Room {
 public:
  /// Loses the content. @throws std::bad_alloc
  std::span<T> grow(std::size_t size) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_aggregate_v<T>, "bytes are an array of these");
    if (size > size_) {
      bytes_ = std::make_unique_for_overwrite<std::byte[]>(size * sizeof(T));
      size_ = size;
    }
    return {reinterpret_cast<T*>(bytes_.get()), size_};
  }

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_ = 0;
};

}  // namespace vps::detail
