// SPDX-License-Identifier: GPL-3.0-or-later
// How the program gets memory. A bake writes 25,000 pages for the first time, and each costs a fault. Blocks with room
// for a huge page get those, one fault for 512 pages; smaller ones are kept when they are freed (setting in main.cpp).
// docs/internals/benchmarks/bake.md, "Huge pages, and a shorter start".
#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;

void* allocate(std::size_t size) noexcept {
  if (size < kHugePage) return std::malloc(size > 0 ? size : 1);
  void* block = nullptr;
  if (::posix_memalign(&block, kHugePage, size) != 0) return nullptr;
  // Not the last part of a page: it would take memory that nobody asked for.
  (void)::madvise(block, size / kHugePage * kHugePage, MADV_HUGEPAGE);
  return block;
}

}  // namespace

// The other forms of new and delete call these.
void* operator new(std::size_t size) {
  for (;;) {
    if (void* const block = allocate(size); block != nullptr) return block;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

void operator delete(void* block) noexcept {
  std::free(block);
}
void operator delete(void* block, std::size_t) noexcept {
  std::free(block);
}
