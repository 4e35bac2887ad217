// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Numbers of equal positions. Internal to mesh import and bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "formats/vps_format.h"

namespace vps {

/// Numbers positions in the order of their first use. -0 and 0 are one position.
/// A table of numbers with open addressing: no memory per position, as in std::unordered_map, to take and to free.
/// @tparam Position  three doubles
template <class Position = std::array<double, 3>>
class PositionNumbers {
  static_assert(sizeof(Position) == 3 * sizeof(double));

 public:
  /// @param expected  number of different positions; more are accepted
  explicit PositionNumbers(std::size_t expected) : slots_(least_slots(expected), kFree) {
    positions_.reserve(expected);
  }

  [[nodiscard]] std::uint32_t number_of(Position p) {
    for (int axis = 0; axis < 3; ++axis) p[axis] += 0.0;
    std::size_t at = slot_of(p);
    for (; slots_[at] != kFree; at = (at + 1) & (slots_.size() - 1)) {
      if (positions_[slots_[at]] == p) return slots_[at];
    }
    slots_[at] = static_cast<std::uint32_t>(positions_.size());
    positions_.push_back(p);
    if (2 * positions_.size() > slots_.size()) grow();
    return static_cast<std::uint32_t>(positions_.size() - 1);
  }

  [[nodiscard]] const std::vector<Position>& positions() const { return positions_; }
  /// Ends the numbering. @return the positions
  [[nodiscard]] std::vector<Position> take_positions() && { return std::move(positions_); }

 private:
  static constexpr std::uint32_t kFree = ~0U;

  static std::size_t least_slots(std::size_t expected) {
    std::size_t slots = 16;
    while (slots < 2 * expected) slots *= 2;
    return slots;
  }

  [[nodiscard]] std::size_t slot_of(const Position& p) const {
    return static_cast<std::size_t>(hash_bytes(std::as_bytes(std::span(&p, 1)))) & (slots_.size() - 1);
  }

  void grow() {
    slots_.assign(2 * slots_.size(), kFree);
    for (std::uint32_t n = 0; n < positions_.size(); ++n) {
      std::size_t at = slot_of(positions_[n]);
      while (slots_[at] != kFree) at = (at + 1) & (slots_.size() - 1);
      slots_[at] = n;
    }
  }

  std::vector<std::uint32_t> slots_;  // a power of two, at most half of them taken
  std::vector<Position> positions_;
};

}  // namespace vps
