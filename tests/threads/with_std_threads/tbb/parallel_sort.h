// SPDX-License-Identifier: GPL-3.0-or-later
/// @file tbb::parallel_sort on one thread, in place of TBB's: see parallel_for.h.
#pragma once

#include <algorithm>

namespace tbb {

template <class Iterator, class... Compare>
void parallel_sort(Iterator first, Iterator last, const Compare&... compare) {
  std::sort(first, last, compare...);
}

}  // namespace tbb
