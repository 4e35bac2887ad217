// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The items of many bricks, numbered, without a list of them. Internal to bake.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace vps::bake {

/// Items in the order of their bricks. Only their numbers are kept: a list of all voxels of the band would be as large
/// as their distances.
template <class Item, class ForEach>
class BrickItems {
 public:
  struct Found {
    std::size_t brick;
    Item item;
  };

  /// @param for_each  calls its second argument for each item of a brick, in the same order each time. Several threads
  /// use it.
  BrickItems(std::size_t bricks, ForEach for_each) : for_each_(std::move(for_each)), start_(bricks + 1, 0) {
    tbb::parallel_for(std::size_t{0}, bricks,
                      [&](std::size_t brick) { for_each_(brick, [&](const Item&) { ++start_[brick + 1]; }); });
    for (std::size_t brick = 0; brick < bricks; ++brick) start_[brick + 1] += start_[brick];
  }

  [[nodiscard]] std::size_t count() const { return start_.back(); }

  /// The items with these numbers, in the same order. Each brick is visited once.
  /// @param numbers  [Limits: value < count()]
  [[nodiscard]] std::vector<Found> find(const std::vector<std::size_t>& numbers) const {
    std::vector<std::size_t> order(numbers.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return numbers[a] < numbers[b]; });
    std::vector<Found> found(numbers.size());
    tbb::parallel_for(std::size_t{0}, start_.size() - 1, [&](std::size_t brick) {
      auto at =
          std::partition_point(order.begin(), order.end(), [&](std::size_t n) { return numbers[n] < start_[brick]; });
      if (at == order.end() || numbers[*at] >= start_[brick + 1]) return;
      std::size_t next = start_[brick];
      for_each_(brick, [&](const Item& item) {
        for (; at != order.end() && numbers[*at] == next; ++at) found[*at] = {brick, item};
        ++next;
      });
    });
    return found;
  }

 private:
  ForEach for_each_;
  std::vector<std::size_t> start_;  // number of each brick's first item
};

template <class Item, class ForEach>
[[nodiscard]] BrickItems<Item, ForEach> brick_items(std::size_t bricks, ForEach for_each) {
  return {bricks, std::move(for_each)};
}

}  // namespace vps::bake
