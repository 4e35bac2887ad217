// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Counts allocations, for the promise that queries make none. Replaces operator new: for one source of a
/// program.
#pragma once

#ifndef VPS_SANITIZE  // has operators of its own
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

static std::atomic<std::size_t> allocations{0};
// Not inlined: the compiler would see malloc and free meet new and delete, and warn.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* const memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif
