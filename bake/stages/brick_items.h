// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The items of many bricks, numbered, without a list of them. Internal to bake.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
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

  /// @param number  [Limits: value < count()]
  [[nodiscard]] Found find(std::size_t number) const {
    const auto after = std::upper_bound(start_.begin(), start_.end(), number);
    Found found{static_cast<std::size_t>(after - start_.begin()) - 1, {}};
    std::size_t next = start_[found.brick];
    for_each_(found.brick, [&](const Item& item) {
      if (next++ == number) found.item = item;
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
