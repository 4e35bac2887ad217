// SPDX-License-Identifier: GPL-3.0-or-later
/// @file tbb::parallel_for on std::thread, in place of TBB's. ThreadSanitizer does not know how TBB's library, which is
/// built without it, orders its threads, and would report hundreds of races that are none.
#pragma once

#include <tbb/blocked_range.h>

#include <algorithm>

#include "tests/threads/threads.h"

namespace tbb {

/// Calls body(i) for i from `first` to below `last`.
template <class Index, class Body>
void parallel_for(Index first, Index last, const Body& body) {
  vps::test::deal_out(last - first, vps::test::kThreads, [&](std::size_t i) { body(first + i); });
}

/// Calls body(part) for parts of the range.
template <class Index, class Body>
void parallel_for(const blocked_range<Index>& range, const Body& body) {
  const std::size_t parts = std::min(range.size(), 4 * vps::test::kThreads);
  vps::test::deal_out(parts, vps::test::kThreads, [&](std::size_t i) {
    const auto at = [&](std::size_t part) { return range.begin() + range.size() * part / parts; };
    body(blocked_range<Index>(at(i), at(i + 1)));
  });
}

}  // namespace tbb
