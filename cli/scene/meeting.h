// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Which bodies of a scene can meet.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "cli/scene/scene.h"

namespace vps::cli {

/// Two bodies can meet when their masks allow it, one of them is dynamic, and no joint holds them. Pairs are decided
/// one by one and not listed: their number grows with the square of the bodies'.
class Meeting {
 public:
  Meeting() = default;
  /// @throw SceneError for more than kMostApart pairs that are kept apart
  explicit Meeting(const Scene& scene);

  /// @pre a != b
  [[nodiscard]] bool can_meet(std::size_t a, std::size_t b) const {
    return masks_allow(a, b) && (bodies_[a].motion == Motion::dynamic || bodies_[b].motion == Motion::dynamic) &&
           !are_joined(a, b);
  }
  /// Calls visit(b) for each body that `a` can meet, in their order, until it returns false.
  template <class Visit>
  void for_each_partner(std::size_t a, const Visit& visit) const {
    if (partners_[a] == 0) return;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (b != a && can_meet(a, b) && !visit(b)) return;
    }
  }
  /// Calls visit(a, b) for each pair that can meet, a < b.
  template <class Visit>
  void for_each_pair(const Visit& visit) const {
    for (std::size_t a = 0; a < bodies_.size(); ++a) {
      for (std::size_t b = partners_[a] == 0 ? bodies_.size() : a + 1; b < bodies_.size(); ++b) {
        if (can_meet(a, b)) visit(a, b);
      }
    }
  }
  [[nodiscard]] std::size_t partners(std::size_t body) const { return partners_[body]; }
  /// Pairs that can meet.
  [[nodiscard]] std::size_t pairs() const { return pairs_; }
  /// Pairs that Bullet would collide and must not.
  [[nodiscard]] const std::vector<std::pair<std::size_t, std::size_t>>& apart() const { return apart_; }

  static constexpr std::size_t kMostApart = std::size_t{1} << 20;

 private:
  struct Body {
    std::int32_t group = 0, mask = 0;
    Motion motion{};
    std::vector<std::size_t> joined;  // ascending
  };
  [[nodiscard]] bool masks_allow(std::size_t a, std::size_t b) const {
    return (bodies_[a].group & bodies_[b].mask) != 0 && (bodies_[b].group & bodies_[a].mask) != 0;
  }
  [[nodiscard]] bool are_joined(std::size_t a, std::size_t b) const;

  std::vector<Body> bodies_;
  std::vector<std::size_t> partners_;  // number of each body's partners
  std::size_t pairs_ = 0;
  std::vector<std::pair<std::size_t, std::size_t>> apart_;
};

}  // namespace vps::cli
