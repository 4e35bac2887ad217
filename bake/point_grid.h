// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Hash grid of points that grows and shrinks, for neighbour searches while sampling and clustering. Internal to bake.
#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "bake/geometry.h"

namespace vps {

/// Cells of edge `cell` hold point numbers in order of insertion. k-d trees (nanoflann) can neither grow nor shrink, and
/// both sampling and sequential clustering need that.
class PointGrid {
 public:
  explicit PointGrid(double cell) : cell_(cell) {}

  void insert(const Vector& p, std::uint32_t number) { cells_[key(coordinate(p))].push_back(number); }

  void remove(const Vector& p, std::uint32_t number) {
    auto& cell = cells_.find(key(coordinate(p)))->second;
    std::erase(cell, number);
  }

  /// Calls visit(number) for every point in the cells within `reach` cells of p's: all points nearer than reach * cell.
  template <class Visit>
  void for_each_near(const Vector& p, int reach, Visit visit) const {
    const Coordinate c = coordinate(p);
    for (std::int64_t z = c[2] - reach; z <= c[2] + reach; ++z) {
      for (std::int64_t y = c[1] - reach; y <= c[1] + reach; ++y) {
        for (std::int64_t x = c[0] - reach; x <= c[0] + reach; ++x) {
          const auto it = cells_.find(key({x, y, z}));
          if (it == cells_.end()) continue;
          for (const std::uint32_t number : it->second) visit(number);
        }
      }
    }
  }

  [[nodiscard]] double cell() const { return cell_; }

 private:
  using Coordinate = std::array<std::int64_t, 3>;
  struct KeyHash {
    std::size_t operator()(std::uint64_t k) const {
      k ^= k >> 31;
      k *= 0x9E3779B97F4A7C15ull;
      return static_cast<std::size_t>(k ^ (k >> 29));
    }
  };

  [[nodiscard]] Coordinate coordinate(const Vector& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x() / cell_)), static_cast<std::int64_t>(std::floor(p.y() / cell_)),
            static_cast<std::int64_t>(std::floor(p.z() / cell_))};
  }
  // 21 bits an axis; two cells that share a key only cost time.
  static std::uint64_t key(const Coordinate& c) {
    constexpr std::uint64_t kMask = (1ull << 21) - 1;
    return (static_cast<std::uint64_t>(c[0]) & kMask) << 42 | (static_cast<std::uint64_t>(c[1]) & kMask) << 21 |
           (static_cast<std::uint64_t>(c[2]) & kMask);
  }

  double cell_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>, KeyHash> cells_;
};

}  // namespace vps
