// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A vector that threads fill. Internal to bake.
#pragma once

#include <memory>
#include <utility>
#include <vector>

namespace vps::bake {

template <class T>
struct UnsetAllocator : std::allocator<T> {
  template <class Other>
  // NOLINTNEXTLINE(readability-identifier-naming): std::allocator_traits asks for it.
  struct rebind {
    using other = UnsetAllocator<Other>;
  };
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    if constexpr (sizeof...(Arguments) == 0) {
      ::new (static_cast<void*>(at)) U;
    } else {
      ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
  }
};

/// `resize` leaves new numbers unset. So each thread has the pages that it writes from the system, and one thread does
/// not clear them all first.
template <class T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

}  // namespace vps::bake
