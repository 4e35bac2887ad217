// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Hash grid of points that grows and shrinks: neighbour searches while clustering, and nearest points for tools.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

/// Cells of a given edge hold point numbers. k-d trees (nanoflann) can neither grow nor shrink, and sequential
/// clustering needs that. Cells lie in blocks of 8x8x8, so that a search hashes a few times only.
class PointGrid {
 public:
  explicit PointGrid(double cell) : cell_(cell) {}

  /// Numbers should be small and dense; a number may be inserted once.
  void insert(const Vector& p, std::uint32_t number) {
    const Coordinate c = coordinate(p);
    const auto [it, fresh] = blocks_.try_emplace(key(block_of(c)), static_cast<std::uint32_t>(heads_.size()));
    if (fresh) heads_.emplace_back().fill(kEnd);
    if (next_.size() <= number) next_.resize(std::max<std::size_t>(number + 1, 2 * next_.size()), kEnd);
    std::uint32_t& head = heads_[it->second][cell_in_block(c)];
    next_[number] = head;
    head = number;
  }

  /// @pre the number was inserted at p and not removed since
  void remove(const Vector& p, std::uint32_t number) {
    const Coordinate c = coordinate(p);
    std::uint32_t* link = &heads_[blocks_.find(key(block_of(c)))->second][cell_in_block(c)];
    while (*link != number) link = &next_[*link];
    *link = next_[number];
  }

  /// Calls visit(number) for every point in the cells within `reach` cells of p's: all points nearer than reach cells.
  template <class Visit>
  void for_each_near(const Vector& p, int reach, Visit visit) const {
    const Coordinate c = coordinate(p);
    const Coordinate low = {c[0] - reach, c[1] - reach, c[2] - reach};
    const Coordinate high = {c[0] + reach, c[1] + reach, c[2] + reach};
    const Coordinate first = block_of(low);
    const Coordinate last = block_of(high);
    for (std::int64_t bz = first[2]; bz <= last[2]; ++bz) {
      for (std::int64_t by = first[1]; by <= last[1]; ++by) {
        for (std::int64_t bx = first[0]; bx <= last[0]; ++bx) {
          const auto it = blocks_.find(key({bx, by, bz}));
          if (it != blocks_.end()) visit_block(heads_[it->second], {bx, by, bz}, low, high, visit);
        }
      }
    }
  }

 private:
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFu;
  static constexpr int kShift = 3;
  using Coordinate = std::array<std::int64_t, 3>;
  using Block = std::array<std::uint32_t, 512>;
  struct KeyHash {
    std::size_t operator()(std::uint64_t k) const {
      k *= 0x9E3779B97F4A7C15ull;
      return static_cast<std::size_t>(k ^ (k >> 32));
    }
  };

  template <class Visit>
  void visit_block(const Block& heads, const Coordinate& block, const Coordinate& low, const Coordinate& high,
                   Visit& visit) const {
    Coordinate from;
    Coordinate to;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      from[axis] = std::max(low[axis], block[axis] << kShift);
      to[axis] = std::min(high[axis], (block[axis] << kShift) + 7);
    }
    for (std::int64_t z = from[2]; z <= to[2]; ++z) {
      for (std::int64_t y = from[1]; y <= to[1]; ++y) {
        for (std::int64_t x = from[0]; x <= to[0]; ++x) {
          for (std::uint32_t n = heads[cell_in_block({x, y, z})]; n != kEnd; n = next_[n]) visit(n);
        }
      }
    }
  }

  [[nodiscard]] Coordinate coordinate(const Vector& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x() / cell_)), static_cast<std::int64_t>(std::floor(p.y() / cell_)),
            static_cast<std::int64_t>(std::floor(p.z() / cell_))};
  }
  static Coordinate block_of(const Coordinate& c) { return {c[0] >> kShift, c[1] >> kShift, c[2] >> kShift}; }
  static std::size_t cell_in_block(const Coordinate& c) {
    return static_cast<std::size_t>((c[2] & 7) << 6 | (c[1] & 7) << 3 | (c[0] & 7));
  }
  // 21 bits per axis; two blocks that share a key only cost time.
  static std::uint64_t key(const Coordinate& c) {
    constexpr std::uint64_t kMask = (1ull << 21) - 1;
    return (static_cast<std::uint64_t>(c[0]) & kMask) << 42 | (static_cast<std::uint64_t>(c[1]) & kMask) << 21 |
           (static_cast<std::uint64_t>(c[2]) & kMask);
  }

  double cell_;
  std::unordered_map<std::uint64_t, std::uint32_t, KeyHash> blocks_;
  std::vector<Block> heads_;
  std::vector<std::uint32_t> next_;
};

}  // namespace vps::bake
