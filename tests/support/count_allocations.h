// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Counts allocations, to test that queries make none, and makes them fail. Replaces operator new: include it in
/// one source of a program only.
#pragma once

#ifndef VPS_SANITIZE  // sanitizers replace the operators themselves
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

static std::atomic<std::size_t> allocations{0};
static std::atomic<bool> allocations_fail{false};
// Not inlined: otherwise the compiler warns that malloc is paired with delete and new with free.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  ++allocations;
  if (allocations_fail) throw std::bad_alloc();
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
